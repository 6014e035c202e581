#include "client/study/study.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/library/error.h"
#include "client/study/own_server.h"
#include "client/study/planner_list.h"
#include "client/study/scene_list.h"
#include "client/study/study_job.h"
#include "core/parallel/thread_pool.h"

namespace vantage::study {
namespace {

using Clock = std::chrono::steady_clock;

struct Job {
  const StudyPlanner* planner = nullptr;
  uint64_t seed = 0;
};

class Study {
 public:
  Study(const StudyPlan& plan, const JobStore& store,
        const std::function<void(const StudyProgress&)>& progress)
      : plan_(plan), store_(store), tell_(progress) {
    const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    width_ = plan.jobs > 0 ? plan.jobs : cores;
    progress_.total =
        static_cast<int>(plan.scenes.size() * plan.planners.size()) * std::max(plan.seeds, 0);
  }

  absl::StatusOr<StudyOutcome> Run() {
    for (const std::string& name : plan_.planners) {
      if (FindPlanner(name) == nullptr) {
        return client::WithFix(
            absl::NotFoundError(absl::StrCat("there is no planner '", name, "'")),
            "'vantage study --list' names them all");
      }
    }
    // A missing mesh is reported now, not after hours.
    for (const std::string& scene : plan_.scenes) {
      if (absl::Status there = CheckScene(scene, plan_.data_folder); !there.ok()) return there;
    }
    for (const std::string& scene : plan_.scenes) {
      if (absl::Status run = RunScene(scene); !run.ok()) return run;
    }
    Collect();
    return std::move(outcome_);
  }

 private:
  absl::Status RunScene(const std::string& name) {
    const std::string settings = plan_.settings.For(name).Describe();
    std::vector<Job> jobs;
    for (int seed = 1; seed <= plan_.seeds; ++seed) {
      for (const std::string& planner : plan_.planners) {
        std::string why;
        if (store_.Read(name, planner, static_cast<uint64_t>(seed), settings, why)) {
          ++progress_.done;
          continue;
        }
        if (why != "not done") Tell(absl::StrCat(name, " ", planner, " ", seed, " is ", why));
        jobs.push_back({FindPlanner(planner), static_cast<uint64_t>(seed)});
      }
    }
    auto site = BuildScene(name, plan_.data_folder);
    if (!site.ok()) return site.status();
    if (jobs.empty() || TooLate()) return absl::OkStatus();
    Tell(absl::StrCat(name, ": measuring what can be attained"));
    parallel::ThreadPool pool(width_);
    const auto scene = StudyScene::Make(*std::move(site), plan_.settings, pool);
    if (!scene.ok()) return scene.status();
    const bool asks_server = std::any_of(jobs.begin(), jobs.end(), [](const Job& job) {
      return job.planner->kind == PlannerKind::kOurs;
    });
    if (asks_server) {
      if (absl::Status started = StartServers(); !started.ok()) return started;
    }
    std::atomic<size_t> next{0};
    std::vector<std::thread> workers;
    workers.reserve(static_cast<size_t>(width_));
    for (int worker = 0; worker < width_; ++worker) {
      workers.emplace_back([&, worker] {
        for (size_t i = next++; i < jobs.size() && !TooLate(); i = next++) {
          if (!RunJob(**scene, jobs[i], worker)) return;
        }
      });
    }
    for (std::thread& worker : workers) worker.join();
    return absl::OkStatus();
  }

  // The servers start on the thread that runs the study and end with it.
  absl::Status StartServers() {
    while (plan_.settings.server.empty() && servers_.size() < static_cast<size_t>(width_)) {
      auto server = OwnServer::Start(plan_.server_program);
      if (!server.ok()) return server.status();
      servers_.push_back(*std::move(server));
    }
    return absl::OkStatus();
  }

  // False when no further job of this worker can succeed, since no server answers.
  bool RunJob(const StudyScene& scene, const Job& job, int worker) {
    const std::string title =
        absl::StrCat(scene.name(), " ", job.planner->name, " seed ", job.seed);
    Tell(title);
    parallel::Serial serial;
    const std::string server = !plan_.settings.server.empty() ? plan_.settings.server
                               : servers_.empty()
                                   ? ""
                                   : servers_[static_cast<size_t>(worker)]->address();
    auto record = RunStudyJob(scene, *job.planner, job.seed, server, serial);
    const absl::Status kept = record.ok() ? store_.Write(*std::move(record)) : record.status();
    std::lock_guard<std::mutex> lock(mutex_);
    if (kept.ok()) {
      ++progress_.done;
      return true;
    }
    outcome_.faults.push_back(absl::StrCat(title, ": ", kept.ToString()));
    return !absl::IsUnavailable(kept);
  }

  void Collect() {
    for (const std::string& scene : plan_.scenes) {
      const std::string settings = plan_.settings.For(scene).Describe();
      for (const std::string& planner : plan_.planners) {
        for (int seed = 1; seed <= plan_.seeds; ++seed) {
          std::string why;
          auto record = store_.Read(scene, planner, static_cast<uint64_t>(seed), settings, why);
          if (record && record->scans().empty()) continue;
          if (record) {
            outcome_.records.push_back(*std::move(record));
          } else {
            ++outcome_.missing;
          }
        }
      }
    }
  }

  bool TooLate() const {
    return plan_.no_job_after > 0 &&
           std::chrono::duration<double>(Clock::now() - begun_).count() > plan_.no_job_after;
  }

  void Tell(const std::string& doing) {
    std::lock_guard<std::mutex> lock(mutex_);
    progress_.doing = doing;
    tell_(progress_);
  }

  const StudyPlan& plan_;
  const JobStore& store_;
  const std::function<void(const StudyProgress&)>& tell_;
  const Clock::time_point begun_ = Clock::now();
  int width_ = 1;
  std::vector<std::unique_ptr<OwnServer>> servers_;
  std::mutex mutex_;
  StudyProgress progress_;
  StudyOutcome outcome_;
};

}  // namespace

absl::StatusOr<StudyOutcome> RunStudy(const StudyPlan& plan, const JobStore& store,
                                      const std::function<void(const StudyProgress&)>& progress) {
  return Study(plan, store, progress).Run();
}

}  // namespace vantage::study
