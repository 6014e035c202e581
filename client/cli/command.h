// Shared by all commands: the connection, the action that parsing chose, and exit codes.
#ifndef VANTAGE_CLIENT_CLI_COMMAND_H_
#define VANTAGE_CLIENT_CLI_COMMAND_H_

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/server_book.h"
#include "client/library/client.h"
#include "vantage/v1/plan.pb.h"

namespace vantage::cli {

// Documented in the top-level help; scripts rely on them.
enum class ExitCode : int {
  kOk = 0,
  kInternal = 1,      // a fault of ours or the server's
  kUsage = 2,         // the command line makes no sense
  kNotFound = 3,      // no such session, scan, plan or file
  kUnreachable = 4,   // no server there
  kRefused = 5,       // the input was refused: file, value, or the state it is in
  kTryAgain = 6,      // a limit or time-out: later it may work
  kUnwelcome = 7,     // it worked, and the answer is no: scan not registered, no view to offer
  kNotSupported = 8,  // not in this release of the server
};

// The table of exit codes for the help.
ExitCode ExitCodeOf(const absl::Status& status);
ExitCode ExitCodeOf(const v1::Plan& plan);

// Prints cause, violations and fix on the error stream.
void PrintError(const absl::Status& status);

struct Environment {
  client::ClientOptions connection;
  // Named by flag or environment; empty: the user's own, where there is one.
  std::string client_config;
  // By which the server was found in that file; empty: by its address.
  std::string server_name;
  // Set by the command that was given, run after parsing.
  std::function<absl::StatusOr<ExitCode>()> action;

  absl::StatusOr<ServerBook> ReadBook() const;
  // Takes what the configuration file says of the server that is named, or is its default, where
  // neither flag nor environment says otherwise. Before the first use of client(). `app`: the whole
  // command line, parsed.
  absl::Status ChooseServer(const CLI::App& app);
  // The flags of another command to the same server, with a blank behind; empty: none are needed.
  std::string ServerFlags() const;

  // Connects on first use; shows how long it waits for a server that loads a model.
  client::Client& client();

 private:
  std::unique_ptr<client::Client> client_;
};

// Adds a subcommand whose arguments live in a fresh `Arguments`, with an example in its help.
// `define` declares the options, `run` is the action.
template <typename Arguments, typename Define, typename Run>
CLI::App* AddCommand(CLI::App& parent, Environment& environment, const std::string& name,
                     const std::string& description, const std::string& examples, Define define,
                     Run run) {
  CLI::App* command = parent.add_subcommand(name, description);
  auto arguments = std::make_shared<Arguments>();
  define(*command, *arguments);
  command->footer("Examples:\n" + examples);
  command->callback([&environment, arguments, run] {
    environment.action = [&environment, arguments, run]() -> absl::StatusOr<ExitCode> {
      return run(environment, *arguments);
    };
  });
  return command;
}

// One function per command, each in the file of that name (scanner and claim: of their
// group's; file: scan_file; report: job_report).
void AddSessionCreate(CLI::App& parent, Environment& environment);
void AddSessionList(CLI::App& parent, Environment& environment);
void AddSessionShow(CLI::App& parent, Environment& environment);
void AddSessionUpdate(CLI::App& parent, Environment& environment);
void AddSessionDelete(CLI::App& parent, Environment& environment);
void AddSessionImport(CLI::App& parent, Environment& environment);
void AddScanPush(CLI::App& parent, Environment& environment);
void AddScanList(CLI::App& parent, Environment& environment);
void AddScanShow(CLI::App& parent, Environment& environment);
void AddScanAccept(CLI::App& parent, Environment& environment);
void AddScanWithdraw(CLI::App& parent, Environment& environment);
void AddScanSetPose(CLI::App& parent, Environment& environment);
void AddPlan(CLI::App& parent, Environment& environment);
void AddTour(CLI::App& parent, Environment& environment);
void AddScannerAdd(CLI::App& parent, Environment& environment);
void AddScannerList(CLI::App& parent, Environment& environment);
void AddScannerUpdate(CLI::App& parent, Environment& environment);
void AddScannerDelete(CLI::App& parent, Environment& environment);
void AddScannerPresets(CLI::App& parent, Environment& environment);
void AddClaimTake(CLI::App& parent, Environment& environment);
void AddClaimRenew(CLI::App& parent, Environment& environment);
void AddClaimRelease(CLI::App& parent, Environment& environment);
void AddClaimList(CLI::App& parent, Environment& environment);
void AddStationAdd(CLI::App& parent, Environment& environment);
void AddStationList(CLI::App& parent, Environment& environment);
void AddStationDelete(CLI::App& parent, Environment& environment);
void AddUploadList(CLI::App& parent, Environment& environment);
void AddUploadAbort(CLI::App& parent, Environment& environment);
void AddRejectionList(CLI::App& parent, Environment& environment);
void AddRejectionDelete(CLI::App& parent, Environment& environment);
void AddEvaluate(CLI::App& parent, Environment& environment);
void AddPriorSet(CLI::App& parent, Environment& environment);
void AddPriorShow(CLI::App& parent, Environment& environment);
void AddPriorClear(CLI::App& parent, Environment& environment);
void AddReject(CLI::App& parent, Environment& environment);
void AddCoverage(CLI::App& parent, Environment& environment);
void AddLinks(CLI::App& parent, Environment& environment);
void AddWatch(CLI::App& parent, Environment& environment);
void AddPlansList(CLI::App& parent, Environment& environment);
void AddPlansDelete(CLI::App& parent, Environment& environment);
void AddExport(CLI::App& parent, Environment& environment);
void AddJobReport(CLI::App& parent, Environment& environment);
void AddPicture(CLI::App& parent, Environment& environment);
void AddSimulate(CLI::App& parent, Environment& environment);
void AddStudy(CLI::App& parent, Environment& environment);
void AddHealth(CLI::App& parent, Environment& environment);
void AddFile(CLI::App& parent, Environment& environment);
void AddFollow(CLI::App& parent, Environment& environment);
void AddServers(CLI::App& parent, Environment& environment);
void AddDoctor(CLI::App& parent, Environment& environment);
void AddCompletion(CLI::App& parent, Environment& environment);

// What stands behind 'vantage completion words' for the scripts: what can be typed next, by the
// tree of all commands, and their list: name, what it does, options, a line each.
void PrintCompletions(CLI::App& program, Environment& environment,
                      const std::vector<std::string>& words);
void PrintCommands(const CLI::App& program);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_COMMAND_H_
