// The places that a fleet member can get to, and how long that takes (algorithm.md section 11,
// 'Travel').
#ifndef VANTAGE_CORE_FLEET_MEMBER_ROUTES_H_
#define VANTAGE_CORE_FLEET_MEMBER_ROUTES_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/fleet/fleet_member.h"
#include "core/fleet/travel.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/budget.h"
#include "core/planning/feasibility/feasible_views.h"

namespace vantage::fleet {

// One member's ways to a set of views.
class MemberRoutes {
 public:
  // `feasible` are the views of the member's own scanner model. With `must_be_reachable`, the
  // member cannot be sent to views without a way.
  MemberRoutes(const FleetMember& member, const model::PlanningView& model,
               const planning::FeasibleViews& feasible, bool must_be_reachable,
               const parallel::Budget& budget);

  // True when the member can be sent there.
  bool Can(size_t view) const { return can_[view]; }
  // Time for walking, setting up and scanning, minutes; absent when no way is known.
  std::optional<double> Minutes(size_t view) const;
  // m.
  std::optional<double> Length(const Eigen::Vector3d& to) const { return travel_.Length(to); }
  // Why Length() is absent, in words; empty where it is not.
  std::string WhyUnreachable(const Eigen::Vector3d& to) const;
  const TravelMap& travel() const { return travel_; }
  const FleetMember& member() const { return member_; }

  size_t within_reach() const { return within_; }  // views
  size_t reachable() const { return reachable_; }  // of those, with a way
  // Why it cannot be sent anywhere; empty when it can.
  std::string WhyNowhere() const;

 private:
  bool Within(const Eigen::Vector3d& p) const;

  FleetMember member_;
  std::optional<Eigen::Vector3d> start_;
  TravelMap travel_;
  std::vector<bool> can_;
  std::vector<float> minutes_;  // by view; NaN
  size_t within_ = 0;
  size_t reachable_ = 0;
};

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_MEMBER_ROUTES_H_
