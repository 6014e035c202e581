#include "client/study/study_job.h"

#include <chrono>
#include <functional>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/library/client.h"
#include "client/library/geometry.h"
#include "client/simulated_job/simulated_job.h"
#include "client/study/best_cover.h"
#include "client/study/job_diary.h"
#include "client/study/known_scene.h"
#include "client/study/octomap_rival.h"
#include "client/study/rival.h"
#include "client/study/rival_job.h"
#include "client/study/surveyor_rival.h"
#include "client/study/visibility_table.h"

namespace vantage::study {
namespace {

simulated_job::JobOptions OptionsFor(const StudyScene& scene, const StudyPlanner& planner,
                                     uint64_t seed) {
  const StudySettings& settings = scene.settings();
  simulated_job::JobOptions options;
  options.scanner = settings.scanner;
  options.faults = settings.faults;
  options.preview = settings.preview;
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

// Asks the planner about the truly best position: its answer shows whether it could not know it,
// could not go there, or did not value it.
absl::Status AskAboutBest(client::Client& client, const std::string& session,
                          const StudyScene& scene, const JobDiary& diary,
                          const simulated_job::Cycle& cycle, ScanMade& next) {
  v1::EvaluateViewRequest request;
  request.set_parent(session);
  *request.mutable_position() = client::ToProto(
      Eigen::Vector3d(cycle.T_scene_world.inverse() * scene.positions()[diary.BestNow().position]));
  const auto answer = client.Call(request);
  // Outside known space there is nothing to evaluate.
  if (absl::IsInvalidArgument(answer.status()) || absl::IsOutOfRange(answer.status())) {
    next.best_refused = std::string(answer.status().message());
    next.best_predicted = 0;
    return absl::OkStatus();
  }
  if (!answer.ok()) return answer.status();
  next.best_predicted = answer->feasible() ? answer->view().expected_gain_m2() : 0;
  next.best_refused =
      answer->feasible() ? answer->view().verdict().message() : answer->infeasible_message();
  return absl::OkStatus();
}

absl::Status RunOurs(const StudyScene& scene, const StudyPlanner& planner, uint64_t seed,
                     const std::string& server, parallel::Parallel& parallel, JobDiary& diary) {
  client::ClientOptions connection;
  connection.server = server;
  connection.give_up_after = 1200;
  client::Client client(connection);
  simulated_job::Site site = scene.site();
  site.start = scene.StartFor(seed);
  simulated_job::JobOptions options = OptionsFor(scene, planner, seed);
  options.site_prior = planner.site_prior;
  options.tour_seconds = planner.tour_seconds;
  simulated_job::SimulatedJob job(client, site, options, scene.scanner(), scene.truth(), parallel);
  ScanMade next;  // notes on the next scan, made when it is planned
  const auto result = job.Run([&](const simulated_job::Cycle& cycle) -> absl::Status {
    ScanMade made = next;
    made.position = cycle.planned_in_scene;
    made.at = cycle.at;
    made.merged = cycle.merged;
    made.second_prior = cycle.second_prior;
    made.promised = cycle.promised;
    if (cycle.promised) made.predicted = cycle.promised->expected_gain;
    if (cycle.merged && cycle.scan.merge().has_obtained_gain_m2()) {
      made.brought = cycle.scan.merge().obtained_gain_m2();
    }
    if (cycle.number > 1) made.overlap = cycle.scan.registration().verdict().overlap_share();
    made.off = cycle.number > 1 ? cycle.off_metres : 0;
    made.notes = cycle.notes;
    diary.Add(made);
    next = {};
    next.plan_seconds = cycle.plan_seconds;
    next.plan_budget = cycle.plan_budget;
    next.plan_attempts = cycle.plan_attempts;
    next.expected_places = cycle.tried;
    if (!planner.asked_about_best || diary.Over()) return absl::OkStatus();
    return AskAboutBest(client, job.session(), scene, diary, cycle, next);
  });
  if (!job.session().empty()) {
    v1::DeleteSessionRequest request;
    request.set_name(job.session());
    // A session that is not deleted costs only memory; the record, or the reason why there is none,
    // matters more.
    (void)client.Call(request);
  }
  if (!result.ok()) return result.status();
  if (result->planner_stopped) diary.record().set_stop_suggested(result->stop_suggested_after);
  diary.record().set_ended(result->why);
  return absl::OkStatus();
}

std::unique_ptr<Rival> MakeRival(const std::string& name, const StudyScene& scene) {
  if (name == "random") return RandomRival();
  if (name == "frontier") return FrontierRival();
  if (name == "octomap") return OctomapRival(scene.settings().scanner);
  if (name == "oracle-feasible") {
    return FeasibleOracleRival(scene, planning::StationBasis::kKnown);
  }
  if (name == "oracle-expected") {
    return FeasibleOracleRival(scene, planning::StationBasis::kExpected);
  }
  if (name == "surveyor") return SurveyorRival();
  if (name == "brute-force") return BruteForceRival();
  return nullptr;
}

absl::Status RunOptimal(const StudyScene& scene, uint64_t seed, JobDiary& diary) {
  const StudySettings& settings = scene.settings();
  const VisibilityTable table =
      MakeVisibilityTable(scene, settings.cover_lattice, scene.StartIndex(seed));
  const auto best =
      BestCover(table, {settings.goal, settings.cover_overlap, settings.cover_seconds});
  if (absl::IsFailedPrecondition(best.status())) {
    // Nothing covers so much: the job has no scans and counts in no row.
    diary.record().set_ended(std::string(best.status().message()));
    return absl::OkStatus();
  }
  if (!best.ok()) return best.status();
  std::vector<Eigen::Vector3d> route;
  for (size_t k = 1; k < best->route.size(); ++k) {
    route.push_back(table.candidates[best->route[k]]);
  }
  RunGivenJob(scene, seed, route, diary);
  diary.record().set_ended(absl::StrFormat("%s; %d stations cover %.1f %% (%s)",
                                           diary.record().ended(), best->route.size(),
                                           100 * best->covered, best->how));
  return absl::OkStatus();
}

absl::Status RunOther(const StudyScene& scene, const StudyPlanner& planner, uint64_t seed,
                      parallel::Parallel& parallel, JobDiary& diary) {
  if (planner.name == "oracle") {
    RunOracleJob(scene, seed, diary);
    return absl::OkStatus();
  }
  if (planner.name == "optimal") {
    return RunOptimal(scene, seed, diary);
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
  rival = MakeRival(planner.name, scene);
  if (rival == nullptr) {
    return absl::InternalError(absl::StrCat("nothing runs the planner ", planner.name));
  }
  return RunRivalJob(scene, seed, *rival, parallel, diary);
}

}  // namespace

absl::StatusOr<study_records::v1::JobRecord> RunStudyJob(const StudyScene& scene,
                                                         const StudyPlanner& planner, uint64_t seed,
                                                         const std::string& server,
                                                         parallel::Parallel& parallel) {
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

}  // namespace vantage::study
