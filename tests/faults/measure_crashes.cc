#include <sys/wait.h>

#include <cstdlib>
#include <iostream>

#include "absl/strings/str_cat.h"
#include "tests/faults/crash_points.h"
#include "tests/faults/fault_figures.h"
#include "tests/integration/process.h"

namespace vantage::faults {
namespace {

constexpr uint64_t kSeed = 11;

template <typename Result>
bool Report(const absl::StatusOr<Result>& result) {
  if (!result.ok()) {
    std::cerr << "the undisturbed job failed: " << result.status() << "\n";
    return false;
  }
  for (const std::string& fault : result->faults) std::cerr << "LOST: " << fault << "\n";
  return result->faults.empty();
}

}  // namespace

bool MeasureCrashes(size_t stride, const GoOn& more, bench::Figures& figures) {
  bool kept = true;
  if (figures.Wants("disk.")) {
    const integration::ScratchFolder scratch;
    const auto faulty = FailAtPoints(scratch.path(), 0, 6 * stride, more);
    kept = Report(faulty) && kept;
    if (faulty.ok()) {
      figures.Add({"disk.faults", static_cast<double>(faulty->faults_made), "runs", "",
                   "the disk full, failing or read-only from some step on, then well again"});
      figures.Add({"disk.refused", static_cast<double>(faulty->refusals), "runs", "",
                   "of these, a client was refused a step; it went on afterwards"});
      figures.Add({"disk.lost", static_cast<double>(faulty->faults.size()), "runs", "0", ""});
    }
  }
  if (figures.Wants("crash.")) {
    const integration::ScratchFolder scratch;
    const auto points = CrashAtEveryPoint(scratch.path(), 0, stride, kSeed, more);
    kept = Report(points) && kept;
    if (points.ok()) {
      figures.Add({"crash.steps", static_cast<double>(points->steps), "", "",
                   "writes, syncs, renames, removals of the scripted job"});
      figures.Add(
          {"crash.crashes", static_cast<double>(points->crashes), "", "",
           absl::StrCat("cut off after every ", stride,
                        ". step, unsynced bytes and names lost, kept and torn; seed ", kSeed)});
      figures.Add({"crash.twice", static_cast<double>(points->crashes_twice), "", "",
                   "of these, cut off again during the recovery"});
      figures.Add({"crash.lost", static_cast<double>(points->faults.size()), "", "0",
                   "something acknowledged was gone, or the job ended differently"});
    }
  }
  return kept;
}

bool MeasureKills(int kills, bench::Figures& figures) {
  setenv("VANTAGE_KILLS", absl::StrCat(kills).c_str(), 1);
  integration::Finished run;
  const double seconds = bench::WallSeconds([&] {
    run = integration::RunProgram({DURABILITY_TEST, "--gtest_filter=Durability.Killed*"});
  });
  figures.Add(
      {"kill.kills", static_cast<double>(kills), "", "300",
       absl::StrCat("kill -9 at random moments of uploads, merges, snapshots and plans, in ",
                    static_cast<int>(seconds), " s")});
  figures.Add({"kill.lost", run.exit_code == 0 ? 0.0 : 1.0, "", "0",
               "something acknowledged was gone, or a job ended differently"});
  if (run.exit_code != 0) std::cerr << run.out;
  return run.exit_code == 0;
}

}  // namespace vantage::faults
