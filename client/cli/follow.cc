// The folder in which an instrument's software leaves its exports, followed.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>
#include <set>
#include <system_error>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/command.h"
#include "client/cli/file_flags.h"
#include "client/cli/reading_progress.h"
#include "client/cli/scan_sending.h"
#include "client/cli/terminal.h"
#include "client/library/error.h"

namespace vantage::cli {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

// How often the folder is looked at, s.
constexpr double kLook = 1;

struct FollowArguments {
  std::string folder;
  SendingFlags flags;
  FileFlags file;
  double settle = 10;  // s
  bool preview = false;
  bool once = false;
};

// A file as it was when it was looked at last.
struct Export {
  std::string path;
  uintmax_t size = 0;
  fs::file_time_type written;
  Clock::time_point since;  // that it has not changed
  // What is done with it as it is.
  bool preview_sent = false;
  bool done = false;
};

bool IsScanFile(const fs::path& path) {
  const std::string ending = absl::AsciiStrToLower(path.extension().string());
  return ending == ".e57" || ending == ".ptx" || ending == ".pcd" || ending == ".vrim";
}

class Follower {
 public:
  Follower(Environment& environment, const FollowArguments& arguments)
      : environment_(environment), arguments_(arguments) {}

  absl::StatusOr<ExitCode> Run() {
    ProgressLine line(60);
    while (true) {
      if (absl::Status looked = Look(); !looked.ok()) return looked;
      const std::pair<Export*, bool> next = Next();
      if (next.first == nullptr) {
        if (arguments_.once && !Growing()) return code_;
        line.Show(Waiting());
        std::this_thread::sleep_for(std::chrono::duration<double>(kLook));
        continue;
      }
      line.Clear();
      const absl::Status sent = SendAll(*next.first, next.second);
      const ExitCode code = ExitCodeOf(sent);
      if (code == ExitCode::kUnreachable || code == ExitCode::kTryAgain) {
        if (arguments_.once) return sent;
        PrintError(sent);  // and again, for as long as it takes
        std::this_thread::sleep_for(std::chrono::duration<double>(arguments_.settle));
        continue;
      }
      // The job is at fault, and no file will do better.
      if (code == ExitCode::kNotFound) return sent;
      if (!sent.ok()) {
        PrintError(sent);
        code_ = ExitCode::kUnwelcome;
      }
      next.first->preview_sent = true;
      next.first->done = !next.second || !sent.ok();
    }
  }

 private:
  // Takes in what is in the folder. A file that has changed is one that was not seen before.
  absl::Status Look() {
    std::error_code error;
    std::map<std::string, Export> there;
    for (fs::directory_iterator it(arguments_.folder, error), end; !error && it != end;
         it.increment(error)) {
      if (!IsScanFile(it->path()) || !it->is_regular_file(error)) continue;
      Export found;
      found.path = it->path().string();
      found.size = it->file_size(error);
      if (error) break;
      found.written = it->last_write_time(error);
      if (error) break;
      found.since = Clock::now();
      const auto known = exports_.find(found.path);
      if (known != exports_.end() && known->second.size == found.size &&
          known->second.written == found.written) {
        found = known->second;
      }
      there.emplace(found.path, std::move(found));
    }
    if (error && exports_.empty()) {
      return client::WithFix(
          absl::NotFoundError(absl::StrCat(arguments_.folder, ": ", error.message())),
          "name the folder into which the scanner's software exports");
    }
    // A share that is away for a moment comes back; what was done stays done.
    if (!error) exports_ = std::move(there);
    return absl::OkStatus();
  }

  bool Ready(const Export& file) const {
    const std::chrono::duration<double> quiet = Clock::now() - file.since;
    // What was written long ago is complete.
    const std::chrono::duration<double> age = fs::file_time_type::clock::now() - file.written;
    return std::max(quiet.count(), age.count()) >= arguments_.settle;
  }

  bool Growing() const {
    for (const auto& [path, file] : exports_) {
      if (!file.done && !Ready(file)) return true;
    }
    return false;
  }

  // The next to be sent, in the order in which they were written, and whether as a preview: all
  // previews that can be sent come first.
  std::pair<Export*, bool> Next() {
    std::vector<Export*> in_order;
    for (auto& [path, file] : exports_) in_order.push_back(&file);
    std::sort(in_order.begin(), in_order.end(), [](const Export* a, const Export* b) {
      return std::tie(a->written, a->path) < std::tie(b->written, b->path);
    });
    for (const bool preview : {true, false}) {
      if (preview && !arguments_.preview) continue;
      for (Export* file : in_order) {
        if (file->done || (preview && file->preview_sent)) continue;
        if (!Ready(*file)) break;  // those after it wait for it
        return {file, preview};
      }
    }
    return {nullptr, false};
  }

  std::string Waiting() const {
    size_t open = 0;
    for (const auto& [path, file] : exports_) open += file.done ? 0 : 1;
    return absl::StrFormat("%s: %d files, %d still being written; waiting (Ctrl-C ends it)",
                           arguments_.folder, exports_.size(), open);
  }

  absl::Status SendAll(const Export& file, bool preview) {
    const auto scans = ScansOf(environment_, arguments_.flags.session);
    if (!scans.ok()) return scans.status();
    std::set<std::string> whole;  // names of what has arrived
    std::set<std::string> previews;
    for (const v1::Scan& scan : *scans) {
      if (scan.state() == v1::SCAN_STATE_WITHDRAWN) continue;
      (scan.preview() ? previews : whole).insert(scan.display_name());
    }
    // With one set-up the scan is called as the file, which then need not be read.
    if (whole.count(fs::path(file.path).stem().string()) > 0) return absl::OkStatus();
    const ReadingProgress reading(fs::path(file.path).filename().string());
    auto opened =
        sensor::ConfinedScanFile::Open(file.path, {}, arguments_.file.reader, reading.Watch());
    reading.Clear();
    if (!opened.ok()) return Refused(opened.status());
    absl::Status worst;
    for (size_t setup = 0; setup < opened->setups().size(); ++setup) {
      Sending sending;
      sending.name = NameOf(file.path, *opened, setup);
      sending.preview = preview;
      sending.limits = LimitsOf(arguments_.file);
      sending.reading = reading;
      if (whole.count(sending.name) > 0 || (preview && previews.count(sending.name) > 0)) continue;
      const auto scan = Send(environment_, arguments_.flags, sending, *opened, setup);
      if (!scan.ok()) {
        const ExitCode code = ExitCodeOf(scan.status());
        if (code == ExitCode::kUnreachable || code == ExitCode::kTryAgain) return scan.status();
        // What is wrong with one says nothing of the others.
        worst = Refused(scan.status());
        if (setup + 1 < opened->setups().size()) PrintError(worst);
        continue;
      }
      if (ReportSent(arguments_.flags, sending, *scan) != ExitCode::kOk) {
        code_ = ExitCode::kUnwelcome;
      }
    }
    return worst;
  }

  // A file that is at fault is not what the job lacks.
  static absl::Status Refused(const absl::Status& status) {
    return absl::IsNotFound(status) ? absl::InvalidArgumentError(status.message()) : status;
  }

  Environment& environment_;
  const FollowArguments& arguments_;
  std::map<std::string, Export> exports_;  // by path
  ExitCode code_ = ExitCode::kOk;
};

absl::StatusOr<ExitCode> RunFollow(Environment& environment, const FollowArguments& arguments) {
  return Follower(environment, arguments).Run();
}

}  // namespace

void AddFollow(CLI::App& parent, Environment& environment) {
  AddCommand<FollowArguments>(
      parent, environment, "follow",
      "Push the scans that appear in a folder, in order, when they are complete",
      "  vantage follow ~/exports flat --preview\n"
      "  vantage follow /media/stick school --once",
      [](CLI::App& command, FollowArguments& a) {
        command.add_option("FOLDER", a.folder, "Where the scanner's software exports to")
            ->required();
        command.add_option("SESSION", a.flags.session, "The job")->required();
        AddSendingFlags(command, a.flags);
        AddAppearanceFlag(command, a.file);
        AddReaderFlags(command, a.file.reader);
        command.add_flag("--preview", a.preview,
                         "Send previews of all files first, the whole scans when none is left");
        command
            .add_option("--settle", a.settle,
                        "Seconds for which a file has to stay as it is, to be complete [10]")
            ->check(CLI::Range(0.0, 3600.0));
        command.add_flag("--once", a.once, "End when all that is there was sent");
      },
      RunFollow);
}

}  // namespace vantage::cli
