// vantage: the command line of the planner.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <iostream>

#include "client/cli/command.h"
#include "core/confinement/reader.h"
#include "core/sensor/confined_scan_file.h"
#include "core/simulation/confined_mesh.h"

namespace {

// Ends the program as it is. Threads of gRPC 1.51 go on after the last call, and one of them that
// met what static destructors had destroyed has crashed a command whose work was done. Sanitizers
// look for leaks at an orderly end.
int End(vantage::cli::ExitCode code) {
#ifndef VANTAGE_SANITIZED
  std::cout.flush();
  std::fflush(nullptr);
  std::_Exit(static_cast<int>(code));
#endif
  return static_cast<int>(code);
}

constexpr char kFooter[] =
    R"(A job from start to end:
  vantage session create flat
  vantage scan push flat scan1.ptx
  vantage plan flat
  vantage scan push flat scan2.ptx --prior 2.1,0.4,0,40
  vantage plan flat
  vantage export flat --format surface-ply -o flat.ply

Exit codes:
  0 done                          5 input refused: file, value, or not in this state
  1 internal fault                6 a limit or time-out: try again
  2 command line not understood   7 done, and the answer is no (scan not registered, no view)
  3 not found                     8 not in this release of the server
  4 server unreachable

Results go to standard output, progress and errors to standard error.)";

}  // namespace

int main(int argc, char** argv) {
  vantage::confinement::RunIfReader(
      argc, argv, {vantage::sensor::ScanFileReader(), vantage::simulation::MeshReader()});
  CLI::App app("vantage: where to put the laser scanner next.", "vantage");
  app.set_version_flag("--version", VANTAGE_VERSION);
  app.require_subcommand(1);
  app.footer(kFooter);
  app.get_formatter()->column_width(34);

  vantage::cli::Environment environment;
  app.add_option(
         "--server", environment.connection.server,
         "Address of the server, HOST:PORT or unix:PATH, or its name in the configuration file")
      ->envname("VANTAGE_SERVER")
      ->capture_default_str();
  app.add_option("--client-config", environment.client_config,
                 "File that names servers [~/.config/vantage/config.toml]")
      ->envname("VANTAGE_CONFIG");
  app.add_option("--tls-ca", environment.connection.tls_ca,
                 "Encrypt, and know the server by what signed its certificate (PEM file)")
      ->envname("VANTAGE_TLS_CA");
  app.add_option("--tls-cert", environment.connection.tls_cert,
                 "Own certificate, where the server asks for one (PEM file)")
      ->envname("VANTAGE_TLS_CERT");
  app.add_option("--tls-key", environment.connection.tls_key, "Its key (PEM file)")
      ->envname("VANTAGE_TLS_KEY");
  app.add_option("--token-file", environment.connection.token_file,
                 "File with the token to call with")
      ->envname("VANTAGE_TOKEN_FILE");
  app.add_option("--traceparent", environment.connection.traceparent,
                 "W3C Trace Context that the calls belong to")
      ->envname("TRACEPARENT");
  app.add_option("--timeout", environment.connection.timeout, "Patience with a single call, s")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.fallthrough();

  CLI::App& session =
      *app.add_subcommand("session", "Jobs: create, list, show, update, delete, import");
  session.require_subcommand(1)->fallthrough();
  vantage::cli::AddSessionCreate(session, environment);
  vantage::cli::AddSessionList(session, environment);
  vantage::cli::AddSessionShow(session, environment);
  vantage::cli::AddSessionUpdate(session, environment);
  vantage::cli::AddSessionDelete(session, environment);
  vantage::cli::AddSessionImport(session, environment);

  CLI::App& scan =
      *app.add_subcommand("scan", "Scans: push, list, show, accept, withdraw, set-pose");
  scan.require_subcommand(1)->fallthrough();
  vantage::cli::AddScanPush(scan, environment);
  vantage::cli::AddScanList(scan, environment);
  vantage::cli::AddScanShow(scan, environment);
  vantage::cli::AddScanAccept(scan, environment);
  vantage::cli::AddScanWithdraw(scan, environment);
  vantage::cli::AddScanSetPose(scan, environment);

  CLI::App& scanner =
      *app.add_subcommand("scanner", "The fleet's scanners: add, list, update, delete");
  scanner.require_subcommand(1)->fallthrough();
  vantage::cli::AddScannerAdd(scanner, environment);
  vantage::cli::AddScannerList(scanner, environment);
  vantage::cli::AddScannerUpdate(scanner, environment);
  vantage::cli::AddScannerDelete(scanner, environment);
  vantage::cli::AddScannerPresets(scanner, environment);

  CLI::App& claim =
      *app.add_subcommand("claim", "Views that are reserved: take, renew, release, list");
  claim.require_subcommand(1)->fallthrough();
  vantage::cli::AddClaimTake(claim, environment);
  vantage::cli::AddClaimRenew(claim, environment);
  vantage::cli::AddClaimRelease(claim, environment);
  vantage::cli::AddClaimList(claim, environment);

  CLI::App& station = *app.add_subcommand(
      "station", "Scans that were made and whose data come later: add, list, delete");
  station.require_subcommand(1)->fallthrough();
  vantage::cli::AddStationAdd(station, environment);
  vantage::cli::AddStationList(station, environment);
  vantage::cli::AddStationDelete(station, environment);

  CLI::App& upload = *app.add_subcommand(
      "upload", "Scans that are being sent, or were not sent to their end: list, abort");
  upload.require_subcommand(1)->fallthrough();
  vantage::cli::AddUploadList(upload, environment);
  vantage::cli::AddUploadAbort(upload, environment);

  CLI::App& rejection =
      *app.add_subcommand("rejection", "Places that were refused with 'reject': list, delete");
  rejection.require_subcommand(1)->fallthrough();
  vantage::cli::AddRejectionList(rejection, environment);
  vantage::cli::AddRejectionDelete(rejection, environment);

  CLI::App& prior = *app.add_subcommand(
      "prior",
      "What is known of the site before it is scanned, for plans to expect: set, show, clear");
  prior.require_subcommand(1)->fallthrough();
  vantage::cli::AddPriorSet(prior, environment);
  vantage::cli::AddPriorShow(prior, environment);
  vantage::cli::AddPriorClear(prior, environment);

  CLI::App& plans = *app.add_subcommand("plans", "Plans that were made: list, delete");
  plans.require_subcommand(1)->fallthrough();
  vantage::cli::AddPlansList(plans, environment);
  vantage::cli::AddPlansDelete(plans, environment);

  vantage::cli::AddPlan(app, environment);
  vantage::cli::AddTour(app, environment);
  vantage::cli::AddEvaluate(app, environment);
  vantage::cli::AddReject(app, environment);
  vantage::cli::AddCoverage(app, environment);
  vantage::cli::AddLinks(app, environment);
  vantage::cli::AddWatch(app, environment);
  vantage::cli::AddExport(app, environment);
  vantage::cli::AddJobReport(app, environment);
  vantage::cli::AddPicture(app, environment);
  vantage::cli::AddSimulate(app, environment);
  vantage::cli::AddStudy(app, environment);
  vantage::cli::AddHealth(app, environment);
  vantage::cli::AddFile(app, environment);
  vantage::cli::AddFollow(app, environment);
  vantage::cli::AddServers(app, environment);
  vantage::cli::AddDoctor(app, environment);
  vantage::cli::AddCompletion(app, environment);

  // For scripts of shells and packages: words as they are being typed are no command line yet.
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() >= 2 && words[0] == "completion" && words[1] == "words") {
    vantage::cli::PrintCompletions(app, environment, {words.begin() + 2, words.end()});
    return End(vantage::cli::ExitCode::kOk);
  }
  if (words.size() == 2 && words[0] == "completion" && words[1] == "commands") {
    vantage::cli::PrintCommands(app);
    return End(vantage::cli::ExitCode::kOk);
  }

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return code == 0 ? 0 : static_cast<int>(vantage::cli::ExitCode::kUsage);
  }
  // What needs no server works with whatever its configuration says; 'servers' reads that itself.
  if (!app.got_subcommand("file") && !app.got_subcommand("completion") &&
      !app.got_subcommand("servers")) {
    if (absl::Status chosen = environment.ChooseServer(app); !chosen.ok()) {
      vantage::cli::PrintError(chosen);
      return End(vantage::cli::ExitCodeOf(chosen));
    }
  }
  const absl::StatusOr<vantage::cli::ExitCode> done = environment.action();
  if (done.ok()) return End(*done);
  vantage::cli::PrintError(done.status());
  return End(vantage::cli::ExitCodeOf(done.status()));
}
