#include "core/tour/ways.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "core/tour/assumed_floor.h"
#include "core/tour/ordering.h"

namespace vantage::tour {
namespace {

// Of the straight line, at least: where nobody has seen the floor something may stand on it.
constexpr double kDetour = 1.5;
constexpr double kFloorsApart = 0.5;  // m, of floors that are assumed
constexpr double kSameStorey = 1.0;   // m, of places: scanners stand higher or lower

int StoreyOf(double floor) { return static_cast<int>(std::lround(floor / kFloorsApart)); }

}  // namespace

Ways::Ways(const planning::PlanningProblem& problem)
    : problem_(problem), grid_(fleet::WalkGridOf(problem.feasible(), {})) {}

std::optional<double> Ways::FloorOf(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
  if (std::abs(from.z() - to.z()) > kSameStorey) return std::nullopt;
  const std::optional<double> floor = FloorBelow(problem_, from);
  return floor.has_value() ? floor : FloorBelow(problem_, to);
}

const fleet::WalkGrid* Ways::Assumed(std::optional<double> floor) const {
  if (!floor.has_value()) return nullptr;
  const auto it = assumed_.find(StoreyOf(*floor));
  return it == assumed_.end() ? nullptr : &it->second;
}

std::vector<std::vector<double>> Ways::Between(std::span<const Eigen::Vector3d> from,
                                               std::span<const Eigen::Vector3d> to,
                                               const parallel::Budget& budget,
                                               parallel::Parallel& parallel) {
  std::vector<std::vector<double>> lengths(from.size(), std::vector<double>(to.size(), kNoWay));
  std::vector<std::vector<uint32_t>> unknown(from.size());
  parallel.For(from.size(), [&](size_t i) {
    const auto row = known_.find(from[i]);
    bool all = row != known_.end();
    for (size_t j = 0; j < to.size() && all; ++j) {
      const auto length = row->second.find(to[j]);
      all = length != row->second.end();
      if (all) lengths[i][j] = length->second;
    }
    if (all || budget.Expired()) return;
    const fleet::TravelMap travel(grid_, from[i], budget);
    for (uint32_t j = 0; j < to.size(); ++j) {
      const std::optional<double> length = travel.Length(to[j]);
      lengths[i][j] = length.value_or(kDetour * (to[j] - from[i]).head<2>().norm());
      if (!length.has_value()) unknown[i].push_back(j);
    }
  });
  if (budget.Expired()) return lengths;  // some may be unknown for that alone
  for (size_t i = 0; i < from.size(); ++i) {
    for (const uint32_t j : unknown[i]) {
      const std::optional<double> floor = FloorOf(from[i], to[j]);
      if (floor.has_value() && Assumed(floor) == nullptr) {
        assumed_.emplace(StoreyOf(*floor), AssumedFloor(problem_, *floor));
      }
    }
  }
  // Between the same places a way is as long as the way back: those that most ways are unknown of
  // are looked for, and few have to be.
  const bool same = from.data() == to.data() && from.size() == to.size();
  std::vector<uint32_t> rows(from.size());
  std::iota(rows.begin(), rows.end(), 0);
  std::stable_sort(rows.begin(), rows.end(),
                   [&](uint32_t a, uint32_t b) { return unknown[a].size() > unknown[b].size(); });
  std::vector<std::pair<uint32_t, uint32_t>> back;
  if (same) {
    std::vector<uint8_t> looked(from.size(), 0);
    for (const uint32_t i : rows) {
      std::erase_if(unknown[i], [&](uint32_t j) {
        if (looked[j] != 0) back.emplace_back(i, j);
        return looked[j] != 0;
      });
      looked[i] = unknown[i].empty() ? 0 : 1;
    }
  }
  parallel.For(from.size(), [&](size_t i) {
    std::map<const fleet::WalkGrid*, fleet::TravelMap> travels;
    for (const uint32_t j : unknown[i]) {
      const fleet::WalkGrid* const floor = Assumed(FloorOf(from[i], to[j]));
      if (floor == nullptr || budget.Expired()) continue;
      auto travel = travels.find(floor);
      if (travel == travels.end()) {
        travel = travels.emplace(floor, fleet::TravelMap(*floor, from[i], budget)).first;
      }
      lengths[i][j] = std::max(lengths[i][j], travel->second.Length(to[j]).value_or(0));
    }
  });
  for (const auto& [i, j] : back) lengths[i][j] = lengths[j][i];
  if (budget.Expired()) return lengths;
  for (size_t i = 0; i < from.size(); ++i) {
    for (size_t j = 0; j < to.size(); ++j) known_[from[i]][to[j]] = lengths[i][j];
  }
  return lengths;
}

std::vector<Eigen::Vector3d> Ways::Way(const Eigen::Vector3d& from,
                                       const Eigen::Vector3d& to) const {
  std::vector<Eigen::Vector3d> way = fleet::TravelMap::To(grid_, from, to).Way(to);
  if (!way.empty()) return way;
  const fleet::WalkGrid* const floor = Assumed(FloorOf(from, to));
  if (floor == nullptr) return way;
  return fleet::TravelMap::To(*floor, from, to).Way(to);
}

}  // namespace vantage::tour
