#include "client/study/planner_list.h"

#include <utility>

namespace vantage::study {
namespace {

StudyPlanner Ours(std::string name, std::string words) {
  StudyPlanner planner;
  planner.name = std::move(name);
  planner.words = std::move(words);
  planner.kind = PlannerKind::kOurs;
  return planner;
}

StudyPlanner Other(std::string name, PlannerKind kind, std::string words) {
  StudyPlanner planner;
  planner.name = std::move(name);
  planner.words = std::move(words);
  planner.kind = kind;
  return planner;
}

std::vector<StudyPlanner> MakePlanners() {
  std::vector<StudyPlanner> all;
  all.push_back(Ours("ours", "the planner as it comes, 1 s a plan"));
  all.back().asked_about_best = true;
  const auto budget = [&](const char* name, double seconds, const char* words) {
    all.push_back(Ours(name, words));
    all.back().plan_seconds = seconds;
  };
  budget("ours-0.1s", 0.1, "the same with 0.1 s a plan");
  budget("ours-0.2s", 0.2, "the same with 0.2 s a plan");
  budget("ours-complete", 600, "the same with every view scored exactly");
  all.push_back(Ours("ours-known", "standing only where floor, way and clearance are known"));
  all.back().overrides.set_station_basis(v1::STATION_BASIS_KNOWN);
  const auto prior = [&](const char* name, simulated_job::ScenePriorKind kind, const char* words) {
    all.push_back(Ours(name, words));
    all.back().site_prior = kind;
  };
  prior("ours-prior", simulated_job::ScenePriorKind::kTrue,
        "with the scene's mesh as a prior, 1.5 % too large and roughly placed");
  prior("ours-prior-plan", simulated_job::ScenePriorKind::kPlan,
        "with its floor plan as a picture, roughly placed: walls without furniture");
  prior("ours-prior-wrong", simulated_job::ScenePriorKind::kWrong,
        "with its mesh turned by half a turn as a prior");
  constexpr double kTourSeconds = 3;
  all.push_back(Ours("ours-tour", "following a tour of what is left, made anew before every plan"));
  all.back().tour_seconds = kTourSeconds;
  prior("ours-prior-tour", simulated_job::ScenePriorKind::kTrue,
        "with the scene's mesh as a prior, following a tour as ours-tour does");
  all.back().tour_seconds = kTourSeconds;
  all.push_back(Ours("ours-overlap", "the best view with enough overlap, whatever its shape"));
  all.back().choice = simulated_job::ViewChoice::kOverlap;
  all.push_back(Ours("ours-unchecked", "the best view, whether it will register or not"));
  all.back().choice = simulated_job::ViewChoice::kBest;
  all.push_back(Ours("ours-paper", "by the paper's metric: samples and nothing else"));
  all.back().overrides.set_min_deficit_share(0);
  all.back().overrides.set_min_counted_density_share(0);
  all.back().overrides.set_unknown_depth_m(0);
  all.push_back(Ours("ours-samples", "true surface counts by samples, as in the paper"));
  all.back().overrides.set_min_deficit_share(0);
  all.back().overrides.set_min_counted_density_share(0);
  all.push_back(Ours("ours-sensitive", "counting only what every pose within the error sees"));
  all.back().overrides.set_pose_sensitivity(true);
  all.push_back(Ours("ours-seen", "false surface counts in full wherever it is seen"));
  all.back().overrides.set_density_on_false_surface(false);
  const auto behind = [&](const char* name, double depth, const char* words) {
    all.push_back(Ours(name, words));
    all.back().overrides.set_unknown_depth_m(depth);
  };
  behind("ours-behind0", 0, "counting on nothing behind false surface");
  behind("ours-behind1", 1, "counting on a metre of space behind false surface, not three");
  behind("ours-behind6", 6, "counting on six metres of space behind false surface, not three");
  const auto weights = [&](const char* name, double true_surface, double occlusion, double hole,
                           double image, const char* words) {
    all.push_back(Ours(name, words));
    v1::SurfaceWeights& set = *all.back().overrides.mutable_weights();
    set.set_true_surface(true_surface);
    set.set_occlusion(occlusion);
    set.set_hole_boundary(hole);
    set.set_image_boundary(image);
  };
  weights("ours-false2", 0.5, 1, 1, 1, "false surface weighs twice as much as true surface");
  weights("ours-true2", 1, 0.5, 0.5, 0.5, "true surface weighs twice as much as false surface");
  weights("ours-occlusion", 1, 1, 0.25, 0.25, "holes and image boundaries weigh a quarter");

  all.push_back(Other("oracle", PlannerKind::kKnowsTheScene,
                      "knows the scene and takes the truly best position each time"));
  all.push_back(
      Other("oracle-feasible", PlannerKind::kKnowsTheScene,
            "the truly best that registers, of every third place per axis where its model lets one "
            "stand"));
  all.push_back(Other("oracle-expected", PlannerKind::kKnowsTheScene,
                      "the same, and where its model lets one expect to stand and one can"));
  all.push_back(Other("optimal", PlannerKind::kKnowsTheScene,
                      "the fewest positions, by local search and, where cbc or glpsol is "
                      "there, integer programming"));
  all.push_back(
      Other("spacing", PlannerKind::kKnowsTheScene, "regular spacing, the best one in hindsight"));
  all.push_back(Other("random", PlannerKind::kRival, "any feasible place"));
  all.push_back(Other("frontier", PlannerKind::kRival, "the nearest place that sees frontier"));
  all.push_back(Other("octomap", PlannerKind::kRival,
                      "the largest unknown volume by ray casting over OctoMap"));
  all.push_back(
      Other("surveyor", PlannerKind::kRival,
            "two scans in every room it knows of and one in each doorway, nearest first"));
  all.push_back(Other("brute-force", PlannerKind::kRival,
                      "our plan run to its end whatever time it takes, without the service"));
  return all;
}

}  // namespace

const std::vector<StudyPlanner>& AllPlanners() {
  static const std::vector<StudyPlanner> planners = MakePlanners();
  return planners;
}

const StudyPlanner* FindPlanner(const std::string& name) {
  for (const StudyPlanner& planner : AllPlanners()) {
    if (planner.name == name) return &planner;
  }
  return nullptr;
}

std::vector<std::string> DefaultPlanners(bool small) {
  if (small) {
    return {"ours",    "ours-0.2s", "oracle",  "oracle-expected", "surveyor",
            "spacing", "frontier",  "octomap", "ours-overlap"};
  }
  std::vector<std::string> names;
  for (const StudyPlanner& planner : AllPlanners()) names.push_back(planner.name);
  return names;
}

}  // namespace vantage::study
