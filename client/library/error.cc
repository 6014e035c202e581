#include "client/library/error.h"

#include <google/rpc/error_details.pb.h>
#include <google/rpc/status.pb.h>
#include <grpcpp/support/status.h>

#include "absl/strings/cord.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace vantage::client {
namespace {

constexpr char kDetailsUrl[] = "type.googleapis.com/google.rpc.Status";
constexpr char kServerUrl[] = "vantage.client/server";
constexpr char kFixUrl[] = "vantage.client/fix";

std::string Payload(const absl::Status& status, const char* url) {
  const auto payload = status.GetPayload(url);
  return payload ? std::string(*payload) : std::string();
}

// The fix where neither the server nor the caller names one.
std::string DefaultFix(const Explanation& e) {
  switch (e.code) {
    case absl::StatusCode::kUnavailable:
      // With a reason it was the server that answered.
      if (!e.reason.empty()) {
        return e.retry_seconds ? absl::StrFormat("try again in %.1f s", *e.retry_seconds)
                               : "try again";
      }
      return "start the server with 'vantaged', or name another one with --server ADDRESS or "
             "VANTAGE_SERVER";
    case absl::StatusCode::kDeadlineExceeded:
      return "try again, or allow more time with --timeout SECONDS";
    case absl::StatusCode::kUnimplemented:
      return "a later release of the server brings it";
    case absl::StatusCode::kAborted:
      return "someone else changed it in the meantime: read it again, then repeat";
    case absl::StatusCode::kResourceExhausted:
      // Without a time to wait, waiting does not help; the message says what to do.
      return e.retry_seconds ? absl::StrFormat("try again in %.1f s", *e.retry_seconds) : "";
    case absl::StatusCode::kUnauthenticated:
      return "show a token with --token-file FILE or VANTAGE_TOKEN_FILE, or a certificate with "
             "--tls-cert and --tls-key";
    case absl::StatusCode::kPermissionDenied:
      return "ask the server's operator for the role";
    case absl::StatusCode::kInvalidArgument:
      return e.violations.empty() ? "" : "correct the fields named above";
    case absl::StatusCode::kInternal:
    case absl::StatusCode::kUnknown:
      return "try again; if it happens again, the server's log says more";
    default:
      return "";
  }
}

// What shows the resources that there are, where one of that name is not.
std::string WhereToLook(absl::string_view name) {
  if (absl::StrContains(name, "/plans/")) return "'vantage plan SESSION' makes a plan";
  for (const char* kind : {"scan", "upload", "rejection", "scanner", "claim", "station"}) {
    if (!absl::StrContains(name, absl::StrCat("/", kind, "s/"))) continue;
    return absl::StrCat("'vantage ", kind, " list SESSION' shows the ", kind, "s there are");
  }
  return "'vantage session list' shows the sessions there are";
}

void ReadDetails(const google::rpc::Status& details, Explanation& e) {
  for (const google::protobuf::Any& any : details.details()) {
    google::rpc::BadRequest bad_request;
    google::rpc::ErrorInfo info;
    google::rpc::RetryInfo retry;
    google::rpc::ResourceInfo resource;
    v1::ClaimConflict conflict;
    v1::ExpectedPiece expected;
    if (any.UnpackTo(&bad_request)) {
      for (const auto& violation : bad_request.field_violations()) {
        e.violations.push_back(absl::StrCat(violation.field(), ": ", violation.description()));
      }
    } else if (any.UnpackTo(&info)) {
      e.reason = info.reason();
      e.metadata.insert(info.metadata().begin(), info.metadata().end());
    } else if (any.UnpackTo(&retry)) {
      e.retry_seconds =
          static_cast<double>(retry.retry_delay().seconds()) + 1e-9 * retry.retry_delay().nanos();
    } else if (any.UnpackTo(&conflict)) {
      e.claim_conflict = conflict;
    } else if (any.UnpackTo(&expected)) {
      e.expected_piece = expected;
    } else if (any.UnpackTo(&resource)) {
      if (e.code == absl::StatusCode::kNotFound && e.fix.empty()) {
        e.fix = WhereToLook(resource.resource_name());
      }
    }
  }
}

}  // namespace

absl::Status FromRpc(const grpc::Status& status, const std::string& server) {
  if (status.ok()) return absl::OkStatus();
  absl::Status out(static_cast<absl::StatusCode>(status.error_code()), status.error_message());
  if (!status.error_details().empty()) {
    out.SetPayload(kDetailsUrl, absl::Cord(status.error_details()));
  }
  out.SetPayload(kServerUrl, absl::Cord(server));
  return out;
}

absl::Status WithFix(absl::Status status, const std::string& fix) {
  if (!status.ok()) status.SetPayload(kFixUrl, absl::Cord(fix));
  return status;
}

Explanation Explain(const absl::Status& status) {
  Explanation e;
  e.code = status.code();
  e.cause = std::string(status.message());
  e.fix = Payload(status, kFixUrl);
  google::rpc::Status details;
  if (details.ParseFromString(Payload(status, kDetailsUrl))) ReadDetails(details, e);
  const std::string server = Payload(status, kServerUrl);
  // A status without details comes from the transport, not from the server.
  if (!server.empty() && e.reason.empty()) {
    if (e.code == absl::StatusCode::kUnavailable) {
      e.cause = absl::StrCat("cannot reach the server at ", server, " (", e.cause, ")");
    } else if (e.code == absl::StatusCode::kDeadlineExceeded) {
      e.cause = absl::StrCat("the server at ", server, " did not answer in time");
    }
  }
  while (absl::EndsWith(e.cause, ".")) e.cause.pop_back();
  if (e.cause.empty()) e.cause = absl::StatusCodeToString(e.code);
  if (e.fix.empty() && !server.empty()) e.fix = DefaultFix(e);
  return e;
}

}  // namespace vantage::client
