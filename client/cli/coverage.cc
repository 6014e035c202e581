#include <algorithm>
#include <cstdio>

#include "absl/strings/str_format.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct CoverageArguments {
  std::string session;
  bool json = false;
};

absl::StatusOr<ExitCode> RunCoverage(Environment& environment, const CoverageArguments& arguments) {
  v1::GetCoverageRequest request;
  request.set_name(client::SessionName(arguments.session));
  const auto got = environment.client().Call(request);
  if (!got.ok()) return got.status();
  if (arguments.json) {
    std::fputs(ToJson(*got).c_str(), stdout);
    return ExitCode::kOk;
  }
  std::fputs(CoverageReport(got->coverage()).c_str(), stdout);
  std::fputs(StoreysReport(got->storeys()).c_str(), stdout);
  if (got->has_best_remaining_model_gain_m2()) {
    const double known = got->best_remaining_model_gain_lower_m2();
    const double expected = got->best_remaining_expected_gain_lower_m2();
    std::printf(
        "the next scan can bring %.2f m\u00b2 to density%s, at most %.2f m\u00b2, says %s\n",
        std::max(known, expected),
        expected > known ? absl::StrFormat(", of which %.2f m\u00b2 are seen today", known).c_str()
                         : "",
        std::max(got->best_remaining_model_gain_m2(), got->best_remaining_expected_gain_m2()),
        client::IdOf(got->plan()).c_str());
  } else {
    std::puts("what the next scan brings is not known: 'vantage plan' finds it");
  }
  return ExitCode::kOk;
}

}  // namespace

void AddCoverage(CLI::App& parent, Environment& environment) {
  AddCommand<CoverageArguments>(
      parent, environment, "coverage", "How complete the model is",
      "  vantage coverage flat\n  vantage coverage flat --json",
      [](CLI::App& command, CoverageArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_flag("--json", a.json, "Print the figures as JSON");
      },
      RunCoverage);
}

}  // namespace vantage::cli
