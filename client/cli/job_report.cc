#include <cerrno>
#include <cstdio>
#include <ctime>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/cli/command.h"
#include "client/cli/file.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct JobReportArguments {
  std::string session;
  std::string output;
  std::string language = "en";
  double required_coverage = 0.95;
  bool utc = false;
  bool json = false;
};

// What this machine adds to UTC now.
int64_t LocalOffsetMinutes() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  return local.tm_gmtoff / 60;
}

absl::StatusOr<ExitCode> RunJobReport(Environment& environment,
                                      const JobReportArguments& arguments) {
  v1::ExportReportRequest request;
  request.set_name(client::SessionName(arguments.session));
  request.set_language(arguments.language);
  request.set_required_coverage(arguments.required_coverage);
  if (!arguments.utc) request.mutable_utc_offset()->set_seconds(60 * LocalOffsetMinutes());
  // All or nothing: a page that breaks off would look whole.
  const auto page = environment.client().ExportBytes(request);
  if (!page.ok()) return page.status();
  if (arguments.output == "-") {
    if (std::fwrite(page->data(), 1, page->size(), stdout) != page->size() ||
        std::fflush(stdout) != 0) {
      return absl::ErrnoToStatus(errno, "cannot write the report to standard output");
    }
    return ExitCode::kOk;
  }
  const std::string output =
      arguments.output.empty()
          ? absl::StrCat(client::IdOf(client::SessionName(arguments.session)), ".html")
          : arguments.output;
  AtomicFile file(output);
  if (absl::Status written = file.Append(*page); !written.ok()) return written;
  if (absl::Status committed = file.Commit(); !committed.ok()) return committed;
  if (arguments.json) {
    PrintJson({{"file", output}, {"sizeBytes", page->size()}});
    return ExitCode::kOk;
  }
  std::printf("%s: %s\n", output.c_str(), Bytes(static_cast<double>(page->size())).c_str());
  return ExitCode::kOk;
}

}  // namespace

void AddJobReport(CLI::App& parent, Environment& environment) {
  AddCommand<JobReportArguments>(
      parent, environment, "report",
      "Save the report of a job: what was required and reached, plans, stations, decisions (HTML)",
      "  vantage report flat                        to flat.html, which prints on A4\n"
      "  vantage report flat --language de -o bericht.html\n"
      "  vantage report flat -o - --utc | mail-it",
      [](CLI::App& command, JobReportArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_option("-o,--output", a.output,
                           "File to write, '-' for standard output; SESSION.html if not given");
        command.add_option("--language", a.language, "Of the report: en or de")
            ->capture_default_str();
        command
            .add_option("--required-coverage", a.required_coverage,
                        "Share of a region's attainable surface that has to be at its density")
            ->capture_default_str()
            ->check(CLI::Range(0.0, 1.0));
        command.add_flag("--utc", a.utc, "Times in UTC, not as this machine tells them");
        command.add_flag("--json", a.json, "Say what was written as JSON");
      },
      RunJobReport);
}

}  // namespace vantage::cli
