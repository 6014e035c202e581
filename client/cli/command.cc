#include "client/cli/command.h"

#include <cstdio>

#include "client/library/error.h"

namespace vantage::cli {

ExitCode ExitCodeOf(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return ExitCode::kOk;
    case absl::StatusCode::kNotFound:
      return ExitCode::kNotFound;
    case absl::StatusCode::kUnavailable:
      return ExitCode::kUnreachable;
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kOutOfRange:
    case absl::StatusCode::kAlreadyExists:
    case absl::StatusCode::kPermissionDenied:
    case absl::StatusCode::kUnauthenticated:
      return ExitCode::kRefused;
    case absl::StatusCode::kResourceExhausted:
    case absl::StatusCode::kDeadlineExceeded:
    case absl::StatusCode::kAborted:
      return ExitCode::kTryAgain;
    case absl::StatusCode::kUnimplemented:
      return ExitCode::kNotSupported;
    default:
      return ExitCode::kInternal;
  }
}

ExitCode ExitCodeOf(const v1::Plan& plan) {
  if (plan.state() == v1::PLAN_STATE_FAILED) return ExitCode::kInternal;
  switch (plan.result().outcome()) {
    case v1::PLAN_OUTCOME_VIEWS:
    case v1::PLAN_OUTCOME_NOTHING_TO_GAIN:
      return ExitCode::kOk;
    case v1::PLAN_OUTCOME_NO_FEASIBLE_VIEW:
    case v1::PLAN_OUTCOME_NO_REGISTRABLE_VIEW:
      return ExitCode::kUnwelcome;
    default:  // cancelled, or the budget was too small: nothing is known
      return ExitCode::kTryAgain;
  }
}

void PrintError(const absl::Status& status) {
  const client::Explanation e = client::Explain(status);
  std::fprintf(stderr, "vantage: %s\n", e.cause.c_str());
  for (const std::string& violation : e.violations) {
    std::fprintf(stderr, "  %s\n", violation.c_str());
  }
  if (!e.fix.empty()) std::fprintf(stderr, "  fix: %s\n", e.fix.c_str());
  if (!e.reason.empty()) std::fprintf(stderr, "  reason: %s\n", e.reason.c_str());
}

}  // namespace vantage::cli
