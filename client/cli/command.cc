#include "client/cli/command.h"

#include <cstdio>

#include "absl/strings/str_cat.h"
#include "client/cli/terminal.h"
#include "client/library/error.h"

namespace vantage::cli {

ExitCode ExitCodeOf(const absl::Status& status) {
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return ExitCode::kOk;
    case absl::StatusCode::kNotFound:
      return ExitCode::kNotFound;
    case absl::StatusCode::kUnavailable:
      // With a reason it was the server that answered.
      return client::Explain(status).reason.empty() ? ExitCode::kUnreachable : ExitCode::kTryAgain;
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

absl::StatusOr<ServerBook> Environment::ReadBook() const {
  return ReadServerBook(client_config.empty() ? DefaultServerBookPath() : client_config,
                        !client_config.empty());
}

absl::Status Environment::ChooseServer(const CLI::App& app) {
  const auto given = [&](const char* flag) { return app.get_option(flag)->count() > 0; };
  const bool named = given("--server");
  if (named && !IsServerName(connection.server)) return absl::OkStatus();
  const absl::StatusOr<ServerBook> book = ReadBook();
  if (!book.ok()) return book.status();
  server_name = named ? connection.server : book->default_server;
  if (server_name.empty()) return absl::OkStatus();
  const absl::StatusOr<NamedServer> server = book->Find(server_name);
  if (!server.ok()) return server.status();
  connection.server = server->address;
  if (server->tls_ca && !given("--tls-ca")) connection.tls_ca = *server->tls_ca;
  if (server->tls_cert && !given("--tls-cert")) connection.tls_cert = *server->tls_cert;
  if (server->tls_key && !given("--tls-key")) connection.tls_key = *server->tls_key;
  if (server->token_file && !given("--token-file")) connection.token_file = *server->token_file;
  if (server->timeout && !given("--timeout")) connection.timeout = *server->timeout;
  return absl::OkStatus();
}

std::string Environment::ServerFlags() const {
  const std::string& server = server_name.empty() ? connection.server : server_name;
  return server == client::ClientOptions().server ? "" : absl::StrCat("--server ", server, " ");
}

client::Client& Environment::client() {
  if (client_ != nullptr) return *client_;
  const auto line = std::make_shared<WaitingLine>(5, 1);
  connection.on_call = [line](bool begins) {
    if (!begins) return line->Clear();
    line->Show("waiting for the server");
  };
  connection.on_loading = [line](std::optional<double> seconds) {
    if (!seconds) return line->Clear();
    line->Show("waiting for the server, which loads the job's model");
  };
  client_ = std::make_unique<client::Client>(connection);
  return *client_;
}

void PrintError(const absl::Status& status) {
  const client::Explanation e = client::Explain(status);
  std::fprintf(stderr, "%s %s\n", Painted("vantage:", Paint::kBad, stderr).c_str(),
               e.cause.c_str());
  for (const std::string& violation : e.violations) {
    std::fprintf(stderr, "  %s\n", violation.c_str());
  }
  if (!e.fix.empty()) {
    std::fprintf(stderr, "  %s %s\n", Painted("fix:", Paint::kGood, stderr).c_str(), e.fix.c_str());
  }
  if (!e.reason.empty()) std::fprintf(stderr, "  reason: %s\n", e.reason.c_str());
}

}  // namespace vantage::cli
