#include "client/study/study_job.h"

#include <chrono>
#include <functional>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/library/client.h"
#include "client/library/geometry.h"
#include "client/simulation/simulated_job.h"
#include "client/study/job_diary.h"
#include "client/study/known_scene.h"
#include "client/study/rival.h"
#include "client/study/rival_job.h"

namespace vantage {
namespace {

JobOptions OptionsFor(const StudyScene& scene, const StudyPlanner& planner, uint64_t seed) {
  const StudySettings& settings = scene.settings();
  JobOptions options;
  options.scanner = settings.scanner;
  options.faults = settings.faults;
  options.required_density = settings.required_density;
  options.max_scans = scene.most_scans();
  options.seed = seed;
  options.plan_seconds = planner.plan_seconds;
  options.heading_error = settings.heading_error;
  options.tilt = settings.tilt;
  options.plan_overrides = planner.overrides;
  options.choice = planner.choice;
  options.heed_termination = false;
  options.enough = settings.enough;
  return options;
}

absl::Status RunOurs(const StudyScene& scene, const StudyPlanner& planner, uint64_t seed,
                     const std::string& server, Parallel& parallel, JobDiary& diary) {
  ClientOptions connection;
  connection.server = server;
  connection.give_up_after = 1200;
  Client client(connection);
  Site site = scene.site();
  site.start = scene.StartFor(seed);
  SimulatedJob job(client, site, OptionsFor(scene, planner, seed), scene.scanner(), scene.truth(),
                   parallel);
  std::string session;
  double plan_seconds = 0;
  const auto result = job.Run([&](const Cycle& cycle) {
    session = SessionOf(cycle.scan.name());
    diary.Add({cycle.planned_in_scene, cycle.at, cycle.merged, cycle.second_prior,
               cycle.predicted_area, cycle.merged && cycle.number > 1 ? cycle.off_metres : 0.0,
               plan_seconds, cycle.notes});
    plan_seconds = 0;
    for (const v1::StageSeconds& stage : cycle.plan.result().stages()) {
      plan_seconds += stage.seconds();
    }
    return absl::OkStatus();
  });
  if (!session.empty()) {
    v1::DeleteSessionRequest request;
    request.set_name(session);
    if (const auto deleted = client.Call(request); !deleted.ok()) return deleted.status();
  }
  if (!result.ok()) return result.status();
  if (result->planner_stopped) diary.record().set_stop_suggested(result->stop_suggested_after);
  diary.record().set_ended(result->why);
  return absl::OkStatus();
}

std::unique_ptr<Rival> MakeRival(const std::string& name, const StudySettings& settings) {
  if (name == "random") return RandomRival();
  if (name == "frontier") return FrontierRival();
  if (name == "octomap") return OctomapRival(settings.scanner);
  if (name == "brute-force") return BruteForceRival();
  return nullptr;
}

absl::Status RunOther(const StudyScene& scene, const StudyPlanner& planner, uint64_t seed,
                      Parallel& parallel, JobDiary& diary) {
  if (planner.name == "oracle") {
    RunOracleJob(scene, seed, diary);
    return absl::OkStatus();
  }
  std::unique_ptr<Rival> rival;
  if (planner.name == "spacing") {
    RegularSpacing spacing = BestSpacing(scene, seed);
    rival = RouteRival(std::move(spacing.route));
    absl::Status run = RunRivalJob(scene, seed, *rival, parallel, diary);
    diary.record().set_ended(
        absl::StrFormat("%s; %.2f m apart", diary.record().ended(), spacing.spacing));
    return run;
  }
  rival = MakeRival(planner.name, scene.settings());
  if (rival == nullptr) {
    return absl::InternalError(absl::StrCat("nothing runs the planner ", planner.name));
  }
  return RunRivalJob(scene, seed, *rival, parallel, diary);
}

}  // namespace

absl::StatusOr<study::v1::JobRecord> RunStudyJob(const StudyScene& scene,
                                                 const StudyPlanner& planner, uint64_t seed,
                                                 const std::string& server, Parallel& parallel) {
  const auto begun = std::chrono::steady_clock::now();
  JobDiary diary(scene, planner.name, seed, parallel);
  const absl::Status run = planner.kind == PlannerKind::kOurs
                               ? RunOurs(scene, planner, seed, server, parallel, diary)
                               : RunOther(scene, planner, seed, parallel, diary);
  if (!run.ok()) return run;
  diary.record().set_seconds(
      std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
  return std::move(diary.record());
}

}  // namespace vantage
