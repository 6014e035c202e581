#include "server/web/router.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"

namespace vantage::web {
namespace {

// What an allowed page may send along, and read of an answer. Browsers let pass the rest.
constexpr char kSentFields[] =
    "authorization, connect-protocol-version, connect-timeout-ms, content-type, traceparent";
// Browsers ask again after two hours at the latest, whatever is said.
constexpr char kPreflightSeconds[] = "7200";

// 'crew.example:8080' of 'https://crew.example:8080'; empty: it has another form.
std::string HostOfOrigin(absl::string_view origin) {
  if (!absl::ConsumePrefix(&origin, "https://") && !absl::ConsumePrefix(&origin, "http://")) {
    return "";
  }
  return absl::AsciiStrToLower(origin);
}

// 'crew.example' of 'crew.example:8080', '::1' of '[::1]:8080'.
std::string WithoutPort(absl::string_view host) {
  if (absl::ConsumePrefix(&host, "[")) return std::string(host.substr(0, host.find(']')));
  return std::string(host.substr(0, host.find(':')));
}

bool IsAddress(const std::string& host) {
  in_addr four{};
  in6_addr six{};
  return inet_pton(AF_INET, host.c_str(), &four) == 1 ||
         inet_pton(AF_INET6, host.c_str(), &six) == 1;
}

std::string HostOf(const Request& head) {
  const std::string* host = head.Find("host");
  return host == nullptr ? "" : absl::AsciiStrToLower(*host);
}

grpc::Status Foreign(const std::string& origin) {
  return {grpc::StatusCode::PERMISSION_DENIED,
          absl::StrCat("pages of ", origin, " may not call this server: --web-allow-origin")};
}

}  // namespace

Router::Router(RouterOptions options, PageFiles page)
    : options_(std::move(options)), rpcs_(options_.services), page_(std::move(page)) {}

bool Router::Allows(const std::string& origin) const {
  return std::find(options_.allowed_origins.begin(), options_.allowed_origins.end(), origin) !=
         options_.allowed_origins.end();
}

// By the host alone: behind a proxy that encrypts, this server does not know the scheme.
bool Router::SameOrigin(const Request& head, const std::string& origin) const {
  const std::string host = HostOfOrigin(origin);
  return !host.empty() && host == HostOf(head);
}

// Where nobody shows who they are, being at the right place is all that lets a caller in. A page
// from elsewhere could be in the same place, in the browser of somebody who is there, once the name
// that it came from is given this server's address (DNS rebinding). So only addresses are taken,
// which nobody can give away, and names that were configured.
bool Router::KnownHost(const Request& head) const {
  if (options_.identified) return true;
  const std::string host = HostOf(head);
  const std::string name = WithoutPort(host);
  if (name == "localhost" || IsAddress(name)) return true;
  return std::any_of(options_.allowed_origins.begin(), options_.allowed_origins.end(),
                     [&](const std::string& origin) { return HostOfOrigin(origin) == host; });
}

std::variant<CallRequest, Response> Router::RouteCall(
    const Request& head, const google::protobuf::MethodDescriptor& method) const {
  const std::string* origin = head.Find("origin");
  const bool foreign = origin != nullptr && !SameOrigin(head, *origin);
  if (head.method == "OPTIONS" && foreign && Allows(*origin)) {
    Response preflight;
    preflight.status = 204;
    preflight.fields = {{"access-control-allow-methods", "POST"},
                        {"access-control-allow-headers", kSentFields},
                        {"access-control-max-age", kPreflightSeconds}};
    return preflight;
  }
  std::variant<CallRequest, Response> read = ReadCall(method, head);
  if (auto* call = std::get_if<CallRequest>(&read);
      call != nullptr && foreign && !Allows(*origin)) {
    return ErrorAnswer(*call, Foreign(*origin));
  }
  return read;
}

std::variant<CallRequest, Response> Router::Route(const Request& head) const {
  if (!KnownHost(head)) {
    return TextResponse(421,
                        "this server is asked for by its address, or by a name that "
                        "--web-allow-origin gives it, since callers need not show who they are");
  }
  const auto* method = rpcs_.Find(head.path());
  std::variant<CallRequest, Response> answer;
  if (method != nullptr) {
    answer = RouteCall(head, *method);
  } else if (absl::StartsWith(head.path(), "/vantage.")) {
    answer = TextResponse(404, "no such RPC");
  } else {
    answer = page_.Answer(head);
  }
  if (auto* response = std::get_if<Response>(&answer); response != nullptr) {
    Permit(head, *response);
  }
  return answer;
}

void Router::Permit(const Request& head, Response& answer) const {
  if (options_.allowed_origins.empty()) return;
  answer.fields.push_back({"vary", "origin"});
  const std::string* origin = head.Find("origin");
  if (origin == nullptr || !Allows(*origin)) return;
  answer.fields.push_back({"access-control-allow-origin", *origin});
}

}  // namespace vantage::web
