#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/pace.h"
#include "client/cli/terminal.h"
#include "client/library/error.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct SessionImportArguments {
  std::string file;
  std::string as;
  bool json = false;
};

absl::StatusOr<ExitCode> RunSessionImport(Environment& environment,
                                          const SessionImportArguments& arguments) {
  constexpr int64_t kPiece = 1 << 20;
  std::error_code error;
  const auto size = static_cast<int64_t>(std::filesystem::file_size(arguments.file, error));
  std::ifstream file(arguments.file, std::ios::binary);
  if (error || !file) {
    return client::WithFix(absl::NotFoundError(absl::StrCat(arguments.file, " cannot be read")),
                           "name a file that 'vantage export --format archive' wrote");
  }
  if (size == 0) {
    return client::WithFix(absl::InvalidArgumentError(absl::StrCat(arguments.file, " is empty")),
                           "name a file that 'vantage export --format archive' wrote");
  }
  ProgressLine line;
  Pace pace;
  const auto imported = environment.client().Import(
      arguments.as, size,
      [&](int64_t offset) -> absl::StatusOr<std::string> {
        std::string bytes(static_cast<size_t>(std::min(kPiece, size - offset)), '\0');
        file.seekg(offset);
        if (!file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) {
          return absl::DataLossError(absl::StrCat(arguments.file, " cannot be read on"));
        }
        return bytes;
      },
      [&](int64_t sent) {
        line.Show(absl::StrCat("sending ", arguments.file, ": ",
                               pace.Of(static_cast<double>(sent), static_cast<double>(size))));
      });
  line.Clear();
  if (!imported.ok()) return imported.status();
  if (arguments.json) {
    std::fputs(ToJson(*imported).c_str(), stdout);
    return ExitCode::kOk;
  }
  const v1::ScanCounts& scans = imported->scan_counts();
  std::printf("%s is here, with %d scans; its model is made anew from them\n",
              client::IdOf(imported->name()).c_str(),
              scans.merged_count() + scans.unmerged_count() + scans.doubtful_count() +
                  scans.failed_count());
  return ExitCode::kOk;
}

}  // namespace

void AddSessionImport(CLI::App& parent, Environment& environment) {
  AddCommand<SessionImportArguments>(
      parent, environment, "import", "Go on with a job that another server exported",
      "  vantage export flat --format archive -o flat.vantage\n"
      "  vantage --server office:7443 session import flat.vantage\n"
      "  vantage session import flat.vantage --as flat-2",
      [](CLI::App& command, SessionImportArguments& a) {
        command.add_option("FILE", a.file, "The archive")->required();
        command.add_option("--as", a.as, "The job's id here [as it was]");
        command.add_flag("--json", a.json, "Print the session as JSON");
      },
      RunSessionImport);
}

}  // namespace vantage::cli
