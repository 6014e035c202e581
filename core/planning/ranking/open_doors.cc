#include "core/planning/ranking/open_doors.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "core/planning/plan/opening.h"
#include "core/registration/bound/overlap_element.h"

namespace vantage::planning {
namespace {

// m: two leaves; what is wider is a passage, which nobody shuts.
constexpr double kWidestDoor = 2.0;
// Of what a view registers by: a door through which less is seen is not asked about. Most doors in
// sight show less than a twentieth.
constexpr double kLeastShare = 0.1;
constexpr size_t kMostViews = 3;  // the best first: each takes some 20 ms

bool CanBeShut(const Opening& opening) {
  return opening.doorway() && opening.lintel && opening.width <= kWidestDoor &&
         opening.head <= kHighestDoor;
}

// Whether the straight way between two points (m) leads through an opening.
bool LeadsThrough(const Opening& opening, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const double before = opening.direction.dot(from - opening.centre);
  const double behind = opening.direction.dot(to - opening.centre);
  if (before * behind >= 0) return false;
  const Eigen::Vector3d at = from + before / (before - behind) * (to - from) - opening.centre;
  return std::abs(opening.direction.cross(Eigen::Vector3d::UnitZ()).dot(at)) <=
             0.5 * opening.width &&
         at.z() >= opening.sill && at.z() <= opening.head;
}

}  // namespace

uint64_t NoteOpenDoors(const PlanningProblem& problem, const parallel::Budget& budget, Plan& plan) {
  uint64_t rays = 0;
  for (size_t i = 0; i < std::min(plan.views.size(), kMostViews) && !budget.Expired(); ++i) {
    plan.views[i].doors = FindOpenDoors(problem, plan.views[i], budget, rays);
  }
  return rays;
}

std::vector<OpenDoor> FindOpenDoors(const PlanningProblem& problem, const RankedView& view,
                                    const parallel::Budget& budget, uint64_t& rays) {
  std::vector<OpenDoor> doors;
  std::vector<const Opening*> near;
  for (const Opening& opening : problem.openings().openings) {
    if (CanBeShut(opening)) near.push_back(&opening);
  }
  if (near.empty() || !view.checked || !view.verdict.registered()) return doors;
  const registration::RegistrationConfig& config = problem.config().registration;
  const auto sight =
      problem.overlap().SightFrom(view.position, problem.scene(), budget, view.heading);
  if (!sight.has_value()) return doors;
  rays += sight->rays;
  double all = 0;
  for (const registration::OverlapElement& element : sight->elements) {
    all += static_cast<double>(element.samples);
  }
  for (const Opening* opening : near) {
    OverlapSurface::Sight shut;
    double through = 0;
    for (const registration::OverlapElement& element : sight->elements) {
      if (LeadsThrough(*opening, view.position, element.position.cast<double>())) {
        through += static_cast<double>(element.samples);
      } else {
        shut.elements.push_back(element);
      }
    }
    if (!(through >= kLeastShare * all) || budget.Expired()) continue;
    if (problem.overlap().JudgeSight(shut, view.position, config, {}).registered()) continue;
    doors.push_back({opening->centre, opening->width, through / all});
  }
  std::stable_sort(doors.begin(), doors.end(), [](const OpenDoor& a, const OpenDoor& b) {
    return a.overlap_share > b.overlap_share;
  });
  return doors;
}

}  // namespace vantage::planning
