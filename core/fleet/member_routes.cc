#include "core/fleet/member_routes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_format.h"

namespace vantage::fleet {
namespace {

std::string Place(const Eigen::Vector3d& p) {
  return absl::StrFormat("(%.2f, %.2f)", p.x(), p.y());
}

}  // namespace

MemberRoutes::MemberRoutes(const FleetMember& member, const model::PlanningView& model,
                           const planning::FeasibleViews& feasible, bool must_be_reachable,
                           const parallel::Budget& budget)
    : member_(member), start_(member.at) {
  if (!start_.has_value() && !model.stations().empty()) start_ = model.stations().back().position;
  if (start_.has_value()) {
    // A scanner that stands outside its reach has to get in first.
    const bool inside = Within(*start_);
    travel_ =
        TravelMap(WalkGridOf(feasible, inside ? std::span<const planning::Region>(member_.reach)
                                              : std::span<const planning::Region>()),
                  *start_, budget);
  }
  const size_t views = feasible.cells().size();
  can_.assign(views, false);
  minutes_.assign(views, std::numeric_limits<float>::quiet_NaN());
  for (size_t i = 0; i < views; ++i) {
    const Eigen::Vector3d view = feasible.Centre(i);
    if (!Within(view)) continue;
    ++within_;
    const std::optional<double> length = travel_.Length(view);
    if (length.has_value()) {
      ++reachable_;
      minutes_[i] = static_cast<float>((*length / member_.speed + member_.scan_seconds) / 60);
    }
    can_[i] = length.has_value() || !must_be_reachable;
  }
}

bool MemberRoutes::Within(const Eigen::Vector3d& p) const {
  return member_.reach.empty() ||
         std::any_of(member_.reach.begin(), member_.reach.end(),
                     [&](const planning::Region& box) { return box.contains(p); });
}

std::optional<double> MemberRoutes::Minutes(size_t view) const {
  if (std::isnan(minutes_[view])) return std::nullopt;
  return minutes_[view];
}

std::string MemberRoutes::WhyUnreachable(const Eigen::Vector3d& to) const {
  if (travel_.Length(to).has_value()) return "";
  if (!start_.has_value()) return "it is not known where the scanner stands";
  if (!travel_.known()) {
    return absl::StrFormat("the scanner stands at %s, which is outside of the model",
                           Place(*start_));
  }
  return absl::StrFormat("no passage is known that a scanner fits through from %s to %s%s",
                         Place(*start_), Place(to),
                         member_.reach.empty() ? "" : " within its reach");
}

std::string MemberRoutes::WhyNowhere() const {
  if (std::find(can_.begin(), can_.end(), true) != can_.end()) return "";
  if (can_.empty()) return "there is no place to stand in the model";
  if (within_ == 0) return "none of the places to stand lies within its reach";
  if (!travel_.known()) return WhyUnreachable(Eigen::Vector3d::Zero());
  return absl::StrFormat(
      "no passage is known that a scanner fits through from %s to any of the %d viewcells%s",
      Place(*start_), static_cast<int>(within_), member_.reach.empty() ? "" : " within its reach");
}

}  // namespace vantage::fleet
