#include "tests/faults/crash_points.h"

#include <cerrno>
#include <filesystem>
#include <random>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "tests/faults/crashed_disk.h"
#include "tests/faults/disk_recorder.h"
#include "tests/faults/scripted_job.h"

namespace vantage::faults {
namespace {

// A run of the job: what it did to the disk, and what its client knew when.
struct Recording {
  std::vector<DiskStep> steps;
  std::vector<std::pair<size_t, Told>> told;  // after so many steps

  // What was known when the power went after `count` steps.
  Told KnownAfter(size_t count) const {
    Told known;
    for (const auto& [at, then] : told) {
      if (at <= count) known = then;
    }
    return known;
  }
};

const char* NameOf(Unsynced unsynced) {
  switch (unsynced) {
    case Unsynced::kLost:
      return "unsynced lost";
    case Unsynced::kKept:
      return "unsynced kept";
    case Unsynced::kTorn:
      return "unsynced torn";
  }
  return "";
}

}  // namespace

absl::StatusOr<CrashPoints> CrashAtEveryPoint(const std::string& scratch, size_t first,
                                              size_t stride, uint64_t seed,
                                              const std::function<bool()>& more) {
  const std::string folder = scratch + "/undisturbed";
  std::filesystem::create_directory(folder);
  Recording whole;
  DiskRecorder::Start(folder);
  const absl::StatusOr<JobEnding> undisturbed = RunScriptedJob(
      folder, {}, [&](const Told& told) { whole.told.emplace_back(DiskRecorder::Count(), told); });
  whole.steps = DiskRecorder::Stop();
  if (!undisturbed.ok()) return undisturbed.status();

  CrashPoints points;
  points.steps = whole.steps.size();
  std::mt19937_64 random(seed);
  const std::span<const DiskStep> steps(whole.steps);
  for (size_t count = first; count <= steps.size() && more(); count += stride) {
    for (const Unsynced unsynced : {Unsynced::kLost, Unsynced::kKept, Unsynced::kTorn}) {
      const uint64_t torn_seed = random();
      std::string where =
          absl::StrCat("after step ", count, " of ", steps.size(), ", ", NameOf(unsynced));
      Told known = whole.KnownAfter(count);
      std::string crashed = scratch + "/crashed";
      MakeCrashedFolder("", steps.first(count), unsynced, torn_seed, crashed);
      if (random() % 4 == 0) {
        // The power goes once more, somewhere on the way back.
        const std::string base = scratch + "/base";
        std::filesystem::copy(crashed, base, std::filesystem::copy_options::recursive);
        Recording again;
        DiskRecorder::Start(crashed);
        const auto recovered = RunScriptedJob(crashed, known, [&](const Told& told) {
          again.told.emplace_back(DiskRecorder::Count(), told);
        });
        again.steps = DiskRecorder::Stop();
        if (!recovered.ok()) {
          points.faults.push_back(absl::StrCat(where, ": ", recovered.status().ToString()));
        }
        const size_t second = random() % (again.steps.size() + 1);
        absl::StrAppend(&where, ", and again after step ", second);
        again.told.emplace(again.told.begin(), 0, known);
        known = again.KnownAfter(second);
        std::filesystem::remove_all(crashed);
        MakeCrashedFolder(base, std::span<const DiskStep>(again.steps).first(second), unsynced,
                          random(), crashed);
        std::filesystem::remove_all(base);
        ++points.crashes_twice;
      }
      ++points.crashes;
      const absl::StatusOr<JobEnding> ending = RunScriptedJob(crashed, known, [](const Told&) {});
      if (!ending.ok()) {
        points.faults.push_back(absl::StrCat(where, ": ", ending.status().ToString()));
      } else if (!(*ending == *undisturbed)) {
        points.faults.push_back(
            absl::StrCat(where, ": the job ends differently: ",
                         ending->scans != undisturbed->scans
                             ? "scans"
                             : (ending->model != undisturbed->model ? "model" : "plan")));
      }
      std::filesystem::remove_all(crashed);
    }
  }
  return points;
}

absl::StatusOr<DiskFaults> FailAtPoints(const std::string& scratch, size_t first, size_t stride,
                                        const std::function<bool()>& more) {
  const std::string folder = scratch + "/faulty";
  size_t steps = 0;
  std::filesystem::create_directory(folder);
  DiskRecorder::Start(folder);
  const absl::StatusOr<JobEnding> undisturbed = RunScriptedJob(folder, {}, [](const Told&) {});
  steps = DiskRecorder::Stop().size();
  std::filesystem::remove_all(folder);
  if (!undisturbed.ok()) return undisturbed.status();

  const std::vector<std::pair<int, const char*>> errors = {
      {ENOSPC, "no room"}, {EIO, "an I/O error"}, {EROFS, "read only"}};
  DiskFaults done;
  for (size_t at = first, i = 0; at < steps && more(); at += stride, ++i) {
    const auto& [error, name] = errors[i % errors.size()];
    const std::string where = absl::StrCat("from step ", at, " of ", steps, ", ", name);
    std::filesystem::create_directory(folder);
    constexpr size_t kUntilMended = ~size_t{0};
    DiskRecorder::FailSteps(folder, at, error, kUntilMended);
    bool refused = false;
    Told known;
    const auto mend = [&](const absl::Status& status) {
      if (refused) return false;
      refused = true;
      if (!absl::IsResourceExhausted(status) && !absl::IsUnavailable(status)) {
        done.faults.push_back(absl::StrCat(where, ": refused with ", status.ToString()));
      }
      DiskRecorder::FailNoMore();
      return true;
    };
    absl::StatusOr<JobEnding> ending = RunScriptedJob(
        folder, {}, [&](const Told& told) { known = told; }, mend);
    // A server that cannot start says so, and does when it can.
    if (!ending.ok() && mend(ending.status()))
      ending = RunScriptedJob(folder, known, [](const Told&) {});
    DiskRecorder::FailNoMore();
    done.faults_made += DiskRecorder::Failed() > 0 ? 1 : 0;
    done.refusals += refused ? 1 : 0;
    const auto judge = [&](const absl::StatusOr<JobEnding>& end, const char* when) {
      if (!end.ok()) {
        done.faults.push_back(absl::StrCat(where, when, ": ", end.status().ToString()));
      } else if (!(*end == *undisturbed)) {
        done.faults.push_back(absl::StrCat(where, when, ": the job ends differently"));
      }
    };
    judge(ending, "");
    judge(RunScriptedJob(folder, known, [](const Told&) {}), ", after a restart");
    std::filesystem::remove_all(folder);
  }
  return done;
}

}  // namespace vantage::faults
