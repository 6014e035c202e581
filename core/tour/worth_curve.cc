#include "core/tour/worth_curve.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace vantage::tour {
namespace {

Routes Without(const Routes& routes, uint32_t station) {
  Routes fewer = routes;
  for (std::vector<uint32_t>& route : fewer) std::erase(route, station);
  return fewer;
}

// m^2 that a station alone brings of what is left.
double Loss(const cover::ElementSet& covers, std::span<const uint16_t> times,
            std::span<const double> weights) {
  double loss = 0;
  cover::ForEach(covers, [&](size_t i) { loss += times[i] == 1 ? weights[i] : 0; });
  return loss;
}

}  // namespace

std::vector<WorthStep> WorthCurve(const OrderProblem& problem, Routes routes,
                                  std::span<const cover::ElementSet> covers,
                                  std::span<const double> weights, const parallel::Budget& budget) {
  std::vector<uint32_t> left;
  for (const std::vector<uint32_t>& route : routes) {
    left.insert(left.end(), route.begin(), route.end());
  }
  std::sort(left.begin(), left.end());
  std::vector<uint16_t> times(weights.size(), 0);
  const auto count = [&](uint32_t station, int by) {
    cover::ForEach(covers[station],
                   [&](size_t i) { times[i] = static_cast<uint16_t>(times[i] + by); });
  };
  for (const uint32_t station : left) count(station, 1);
  double area = 0;
  for (size_t i = 0; i < times.size(); ++i) area += times[i] > 0 ? weights[i] : 0;
  std::vector<WorthStep> steps;
  while (!left.empty() && !budget.Expired()) {
    steps.push_back({left.size(), TimetableOf(problem, routes).minutes, area});
    struct Leave {
      double loss = 0;
      uint32_t station = 0;
    };
    std::vector<Leave> order;
    order.reserve(left.size());
    for (const uint32_t station : left) {
      order.push_back({Loss(covers[station], times, weights), station});
    }
    std::stable_sort(order.begin(), order.end(),
                     [](const Leave& a, const Leave& b) { return a.loss < b.loss; });
    const Leave* leaves = nullptr;
    for (const Leave& candidate : order) {
      if (left.size() > 1 && !TimetableOf(problem, Without(routes, candidate.station)).possible) {
        continue;
      }
      leaves = &candidate;
      break;
    }
    if (leaves == nullptr) break;
    area -= leaves->loss;
    count(leaves->station, -1);
    routes = Without(routes, leaves->station);
    std::erase(left, leaves->station);
  }
  std::reverse(steps.begin(), steps.end());
  return steps;
}

}  // namespace vantage::tour
