// What steps A to C take after the tenth scan of a job, where a plan was prepared after the ninth:
// beside the same from nothing.
#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/model/partial_model.h"
#include "core/planning/problem/planning_problem.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/office_storey.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/scan_job.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {

namespace {

constexpr size_t kPreparedScans = 10;
constexpr size_t kPreparings = 5;

using Problem = std::shared_ptr<const planning::PlanningProblem>;

// Seconds of a preparation, all in all and by stage.
struct Preparing {
  std::vector<double> all;
  std::array<std::vector<double>, planning::kPlanStages> stages;

  Problem Prepare(const planning::PlanningQuestion& question, parallel::Parallel& parallel) {
    Problem problem;
    all.push_back(WallSeconds(
        [&] { problem = planning::PlanningProblem::Prepare(question, parallel).value(); }));
    for (size_t stage = 0; stage < stages.size(); ++stage) {
      stages[stage].push_back(problem->seconds()[stage]);
    }
    return problem;
  }
  std::string Stages() const {
    std::string words;
    for (size_t stage = 0; stage < stages.size(); ++stage) {
      const double seconds = Percentile(stages[stage], 0.5);
      if (seconds < 0.0005) continue;
      absl::StrAppendFormat(&words, "%s%s %.3f", words.empty() ? "" : ", ",
                            planning::kPlanStageNames[stage], seconds);
    }
    return words;
  }
};

void BenchScene(const std::string& name, const std::vector<ScanJob>& jobs,
                parallel::Parallel& parallel, Figures& figures) {
  Preparing anew;
  Preparing after;
  std::string sizes;
  const planning::PlanningConfig config;
  for (const ScanJob& job : jobs) {
    const sensor::ScannerModel& scanner = job.scans[0].scanner;
    const auto model = ModelOf(job, kPreparedScans - 1, parallel);
    const auto before = model->Publish();
    const Problem previous =
        planning::PlanningProblem::Prepare({*before, scanner, config}, parallel).value();
    model->Insert("last", job.scans[kPreparedScans - 1], job.poses[kPreparedScans - 1], parallel)
        .value();
    const auto view = model->Publish();
    for (size_t run = 0; run < kPreparings; ++run) {
      const Problem scratch = anew.Prepare({*view, scanner, config}, parallel);
      const Problem next = after.Prepare({*view, scanner, config, previous.get()}, parallel);
      if (run > 0) continue;
      absl::StrAppendFormat(&sizes, "; %d viewcells x %d cells, %d of %d pages changed",
                            next->feasible().cells().size(), next->patches().cells.size(),
                            view->copied_pages(), view->pages());
    }
  }
  figures.Add({absl::StrCat("prepare.", name, ".seconds"), Percentile(anew.all, 0.5), "s", "",
               absl::StrCat("from nothing: ", anew.Stages(), sizes)});
  figures.Add({absl::StrCat("prepare.", name, ".share"),
               Percentile(after.all, 0.5) / Percentile(anew.all, 0.5), "", "0.1",
               absl::StrFormat("%.3f s after the tenth scan: %s", Percentile(after.all, 0.5),
                               after.Stages())});
}

}  // namespace

void BenchPrepare(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("prepare.")) return;
  std::vector<ScanJob> flats;
  std::vector<ScanJob> offices;
  for (const uint64_t seed : SceneSeeds(options.use)) {
    if (flats.size() < 2) flats.push_back(MakeFlatJob(seed, kPreparedScans, parallel));
    if (offices.empty()) {
      offices.push_back(
          MakeScanJob(simulation::OfficeStorey(seed, 1000), seed, kPreparedScans, parallel));
    }
  }
  BenchScene("flat", flats, parallel, figures);
  BenchScene("1000m2", offices, parallel, figures);
}

}  // namespace vantage::bench
