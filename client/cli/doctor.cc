// What stands between a client and its server, one thing after the other.
#include <cmath>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/terminal.h"
#include "client/cli/tls_probe.h"
#include "client/library/address.h"
#include "client/library/error.h"

namespace vantage::cli {
namespace {

constexpr double kPatience = 5;    // s, for a connection
constexpr double kSoon = 30;       // days: who runs the server should know by now
constexpr double kClockOff = 5;    // s
constexpr double kHeartbeat = 15;  // s until the server's time comes at the latest
// Can be nobody's: no session has such an id.
constexpr char kNobody[] = "sessions/?";

struct DoctorArguments {
  bool quick = false;
  bool json = false;
};

enum class Finding { kOk, kWarning, kFault, kNotLookedAt };

struct Check {
  std::string what;
  Finding finding;
  std::string words;
  std::string cure;
};

const char* Word(Finding finding) {
  switch (finding) {
    case Finding::kOk:
      return "ok";
    case Finding::kWarning:
      return "warn";
    case Finding::kFault:
      return "fail";
    case Finding::kNotLookedAt:
      return "-";
  }
  return "";
}

std::string Marked(Finding finding) {
  std::string word = absl::StrFormat("%-4s", Word(finding));
  switch (finding) {
    case Finding::kOk:
      return Painted(word, Paint::kGood, stdout);
    case Finding::kWarning:
      return Painted(word, Paint::kWarning, stdout);
    case Finding::kFault:
      return Painted(word, Paint::kBad, stdout);
    case Finding::kNotLookedAt:
      break;
  }
  return word;
}

// Roles, and a call that leaves everything as it is and needs just that one: where it is let in, it
// finds nothing.
absl::StatusOr<bool> Allowed(const absl::Status& outcome) {
  if (absl::IsPermissionDenied(outcome)) return false;
  if (outcome.ok() || absl::IsNotFound(outcome) || absl::IsInvalidArgument(outcome)) return true;
  return outcome;
}

class Examination {
 public:
  Examination(Environment& environment, const DoctorArguments& arguments)
      : environment_(environment), arguments_(arguments), options_(environment.connection) {}

  // True when all went well enough to work.
  bool Run() {
    LookAtConfiguration();
    if (LookAtReach() && LookAtCertificate() && LookAtHealth() && LookAtToken()) {
      LookAtRoles();
      LookAtClock();
      LookAtVersion();
    }
    return sound_;
  }

  const std::vector<Check>& checks() const { return checks_; }
  // Of the fault that was found.
  ExitCode fault() const { return reached_ ? ExitCode::kUnwelcome : ExitCode::kUnreachable; }

 private:
  bool Say(const std::string& what, Finding finding, const std::string& words,
           const std::string& cure = "") {
    waiting_.Clear();
    checks_.push_back({what, finding, words, cure});
    if (finding == Finding::kFault) sound_ = false;
    if (!arguments_.json) {
      std::printf("%s  %-12s %s\n", Marked(finding).c_str(), what.c_str(), words.c_str());
      if (!cure.empty()) std::printf("      %-12s -> %s\n", "", cure.c_str());
      std::fflush(stdout);
    }
    return finding != Finding::kFault;
  }

  bool Say(const std::string& what, const absl::Status& fault, const std::string& cure = "") {
    const client::Explanation why = client::Explain(fault);
    return Say(what, Finding::kFault, why.cause, cure.empty() ? why.fix : cure);
  }

  void LookAtConfiguration() {
    const absl::StatusOr<ServerBook> book = environment_.ReadBook();
    const std::string from =
        environment_.server_name.empty()
            ? options_.server
            : absl::StrCat("'", environment_.server_name, "' in ", book.ok() ? book->path : "?",
                           ": ", options_.server);
    Say("server", Finding::kOk, from);
  }

  bool LookAtReach() {
    const absl::StatusOr<HostPort> address = ParseAddress(options_.server);
    if (!address.ok()) {
      return Say("address", address.status(), "write HOST:PORT, unix:PATH, or a server's name");
    }
    address_ = *address;
    if (!address_.port.empty()) {
      waiting_.Show(absl::StrCat("looking up ", address_.host), kPatience);
      const auto addresses = Resolve(address_, kPatience);
      if (!addresses.ok()) {
        return Say("name", addresses.status(),
                   "correct the name, or ask whoever runs the network (VPN? DNS?)");
      }
      Say("name", Finding::kOk,
          absl::StrCat(address_.host, " is ", absl::StrJoin(*addresses, ", ")));
    }
    waiting_.Show(absl::StrCat("connecting to ", options_.server), kPatience);
    if (absl::Status reached = Reach(address_, kPatience); !reached.ok()) {
      return Say("reach", Finding::kFault,
                 absl::StrCat(options_.server, ": ", std::string(reached.message())),
                 "start the server ('vantaged'), correct the port, or open it in the firewall");
    }
    reached_ = true;
    return Say("reach", Finding::kOk, absl::StrCat(options_.server, " takes connections"));
  }

  bool LookAtCertificate() {
    const bool wanted = !options_.tls_ca.empty();
    if (address_.port.empty() && !wanted) {
      return Say("certificate", Finding::kOk, "none is needed within this machine");
    }
    waiting_.Show("shaking hands", kPatience);
    const auto shown = ShakeHands(address_, options_, kPatience);
    if (absl::IsUnavailable(shown.status())) {
      return Say("certificate", Finding::kFault, std::string(shown.status().message()),
                 "look whether a server of ours runs there, and behind a proxy whether it is up");
    }
    if (!shown.ok()) {
      return Say("certificate", shown.status(),
                 "correct --tls-ca, --tls-cert or --tls-key, or the configuration file");
    }
    if (!shown->has_value()) {
      if (wanted) {
        return Say("certificate", Finding::kFault,
                   "the server does not speak TLS, or refuses this client",
                   "leave --tls-ca out if it is not encrypted; name --tls-cert and --tls-key if it "
                   "asks for a certificate");
      }
      return client::StaysOnThisMachine(options_.server)
                 ? Say("certificate", Finding::kOk, "not encrypted, and within this machine")
                 : Say("certificate", Finding::kWarning,
                       "not encrypted: everyone on the way can read and change what is sent",
                       "have the server's operator set up TLS, and name its --tls-ca");
    }
    const Certificate& certificate = **shown;
    const std::string names =
        certificate.names.empty() ? certificate.subject : absl::StrJoin(certificate.names, ", ");
    if (!wanted) {
      return Say("certificate", Finding::kFault,
                 absl::StrCat("the server encrypts (", names, "), and this client would not"),
                 "name what signed its certificate with --tls-ca FILE");
    }
    if (certificate.days_left < 0) {
      return Say("certificate", Finding::kFault,
                 absl::StrFormat("for %s: expired %.0f days ago", names, -certificate.days_left),
                 "have the server's operator renew it");
    }
    if (!certificate.trusted.ok()) {
      return Say("certificate", Finding::kFault,
                 absl::StrCat("for ", names, ": ", std::string(certificate.trusted.message())),
                 "call the server by a name that it is for, and name what signed it with --tls-ca");
    }
    const std::string words =
        absl::StrFormat("for %s, for another %.0f days", names, certificate.days_left);
    return certificate.days_left < kSoon
               ? Say("certificate", Finding::kWarning, words, "have the server's operator renew it")
               : Say("certificate", Finding::kOk, words);
  }

  bool LookAtHealth() {
    waiting_.Show("asking whether it takes work", options_.timeout);
    const auto health = environment_.client().CheckHealth("");
    if (!health.ok()) return Say("health", health.status());
    return *health == client::Health::kServing
               ? Say("health", Finding::kOk, "the server takes work")
               : Say("health", Finding::kWarning, "the server starts, or drains before its end",
                     "wait a moment and try again");
  }

  // When a JWT expires, as it says itself.
  std::optional<absl::Time> Expiry() const {
    std::ifstream file(options_.token_file);
    std::ostringstream text;
    text << file.rdbuf();
    const std::vector<std::string> parts = absl::StrSplit(std::move(text).str(), '.');
    std::string claims;
    if (parts.size() != 3 || !absl::WebSafeBase64Unescape(parts[1], &claims)) return std::nullopt;
    const Json read = Json::parse(claims, nullptr, false);
    if (!read.is_object() || !read.contains("exp") || !read["exp"].is_number()) return std::nullopt;
    return absl::FromUnixSeconds(static_cast<int64_t>(read["exp"].get<double>()));
  }

  bool LookAtToken() {
    waiting_.Show("showing the token", options_.timeout);
    v1::ListSessionsRequest request;
    request.set_page_size(1);
    const auto listed = environment_.client().Call(request);
    const absl::Status& outcome = listed.status();
    if (listed.ok() && listed->sessions_size() > 0) {
      session_ = listed->sessions(0).name();
      last_sequence_ = listed->sessions(0).last_sequence();
    }
    reads_ = listed.ok();
    if (!listed.ok() && !absl::IsPermissionDenied(outcome)) return Say("token", outcome);
    const std::string file = options_.token_file;
    if (file.empty()) {
      return Say("token", Finding::kOk,
                 options_.tls_cert.empty() ? "none is shown, and the server asks for none"
                                           : "none is shown: the certificate says who calls");
    }
    const std::optional<absl::Time> expiry = Expiry();
    if (!expiry) return Say("token", Finding::kOk, absl::StrCat(file, " is accepted"));
    const double minutes = absl::ToDoubleMinutes(*expiry - absl::Now());
    const std::string words =
        absl::StrFormat("%s is accepted, for another %.0f minutes", file, minutes);
    return minutes < 5
               ? Say("token", Finding::kWarning, words, "have your identity provider renew it")
               : Say("token", Finding::kOk, words);
  }

  void LookAtRoles() {
    waiting_.Show("asking what this caller may do", options_.timeout);
    client::Client& client = environment_.client();
    v1::GetUploadRequest upload;
    upload.set_name(absl::StrCat(kNobody, "/uploads/none"));
    v1::EvaluateViewRequest evaluate;
    evaluate.set_parent(kNobody);
    evaluate.mutable_position();
    v1::DeleteSessionRequest administer;
    administer.set_name(kNobody);
    std::vector<std::string> may;
    std::vector<std::string> may_not;
    const std::pair<const char*, absl::Status> asked[] = {
        {"read", reads_ ? absl::OkStatus() : absl::PermissionDeniedError("")},
        {"submit", client.Call(upload).status()},
        {"plan", client.Call(evaluate).status()},
        {"administer", client.Call(administer).status()}};
    for (const auto& [role, outcome] : asked) {
      const absl::StatusOr<bool> allowed = Allowed(outcome);
      if (!allowed.ok()) {
        Say("role", allowed.status());
        return;
      }
      (*allowed ? may : may_not).emplace_back(role);
    }
    const std::string words = may.empty() ? "none" : absl::StrCat("may ", absl::StrJoin(may, ", "));
    if (may.empty()) {
      Say("role", Finding::kFault, words, "ask the server's operator for a role");
    } else if (may.size() == 1 && !may_not.empty()) {
      Say("role", Finding::kWarning, absl::StrCat(words, "; not ", absl::StrJoin(may_not, ", ")),
          "to send scans and plan, ask the server's operator for submit and plan");
    } else {
      Say("role", Finding::kOk,
          may_not.empty() ? words : absl::StrCat(words, "; not ", absl::StrJoin(may_not, ", ")));
    }
  }

  void LookAtClock() {
    if (arguments_.quick) {
      Say("clock", Finding::kNotLookedAt, "not looked at, with --quick");
      return;
    }
    if (session_.empty()) {
      Say("clock", Finding::kNotLookedAt,
          "not known: the server tells its time in the watch of a job, and there is none to read");
      return;
    }
    waiting_.Show("waiting for the server's time", kHeartbeat);
    const auto time = environment_.client().ReadServerTime(session_, last_sequence_);
    if (!time.ok()) {
      Say("clock", Finding::kWarning,
          absl::StrCat("not known: ", client::Explain(time.status()).cause));
      return;
    }
    const double off = std::chrono::duration<double>(time->here - time->there).count();
    const std::string words = absl::StrFormat("this one is %.1f s %s the server's", std::abs(off),
                                              off < 0 ? "behind" : "ahead of");
    if (std::abs(off) < kClockOff) {
      Say("clock", Finding::kOk, words);
    } else {
      Say("clock", Finding::kWarning, words,
          "set the clock that is wrong (NTP): claims, tokens and certificates end by it");
    }
  }

  void LookAtVersion() {
    waiting_.Show("comparing contracts", options_.timeout);
    const std::string own = absl::StrCat("client ", VANTAGE_VERSION);
    const auto compared = environment_.client().CompareContract();
    if (!compared.ok()) {
      Say("version", Finding::kNotLookedAt,
          absl::StrCat(own, "; the server does not describe itself: ",
                       client::Explain(compared.status()).cause));
      return;
    }
    const auto some = [](const std::vector<std::string>& names) {
      std::string words =
          absl::StrCat(names.size(), " thing", names.size() == 1 ? "" : "s", ", as ");
      return words + names.front();
    };
    if (!compared->server_lacks.empty()) {
      Say("version", Finding::kWarning,
          absl::StrCat(own, "; the server is older: it lacks ", some(compared->server_lacks)),
          "what it lacks ends with exit code 8, or has no effect; update the server");
    } else if (!compared->client_lacks.empty()) {
      Say("version", Finding::kOk,
          absl::StrCat(own, "; the server is newer: it has ", some(compared->client_lacks),
                       " more than this client knows"));
    } else {
      Say("version", Finding::kOk, absl::StrCat(own, "; the server has the same contract"));
    }
  }

  Environment& environment_;
  const DoctorArguments& arguments_;
  const client::ClientOptions& options_;
  WaitingLine waiting_;
  HostPort address_;
  std::string session_;  // one that can be read; empty: none
  uint64_t last_sequence_ = 0;
  bool reads_ = false;
  bool reached_ = false;
  bool sound_ = true;
  std::vector<Check> checks_;
};

absl::StatusOr<ExitCode> RunDoctor(Environment& environment, const DoctorArguments& arguments) {
  // What is found is said, not waited for.
  environment.connection.attempts = 1;
  environment.connection.timeout = std::min(environment.connection.timeout, 10.0);
  // Who hangs up in the middle of a handshake is a finding.
  std::signal(SIGPIPE, SIG_IGN);
  Examination examination(environment, arguments);
  const bool sound = examination.Run();
  if (arguments.json) {
    Json checks = Json::array();
    for (const Check& check : examination.checks()) {
      Json one = {
          {"check", check.what},
          {"finding", check.finding == Finding::kNotLookedAt ? "none" : Word(check.finding)},
          {"words", check.words}};
      if (!check.cure.empty()) one["cure"] = check.cure;
      checks.push_back(std::move(one));
    }
    PrintJson({{"server", environment.connection.server},
               {"sound", sound},
               {"checks", std::move(checks)}});
  }
  return sound ? ExitCode::kOk : examination.fault();
}

}  // namespace

void AddDoctor(CLI::App& parent, Environment& environment) {
  AddCommand<DoctorArguments>(
      parent, environment, "doctor",
      "Look for what stands between this client and its server: reach, certificate, token, role, "
      "clocks, version",
      "  vantage doctor\n  vantage --server office doctor --json",
      [](CLI::App& command, DoctorArguments& a) {
        command.add_flag("--quick", a.quick, "Don't wait for the server's time, 15 s at most");
        command.add_flag("--json", a.json, "Print what was found as JSON");
      },
      RunDoctor);
}

}  // namespace vantage::cli
