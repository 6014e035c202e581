// What is not worth going for: what a tour reaches with fewer of its stations (algorithm.md
// section 12, 'What is worth going for').
#ifndef VANTAGE_CORE_TOUR_WORTH_CURVE_H_
#define VANTAGE_CORE_TOUR_WORTH_CURVE_H_

#include <span>
#include <vector>

#include "core/cover/element_set.h"
#include "core/parallel/budget.h"
#include "core/tour/ordering.h"

namespace vantage::tour {

struct WorthStep {
  size_t scans = 0;
  double minutes = 0;
  double area = 0;  // m^2
};

// `covers` has what each station of the order's problem brings, `weights` those of its elements.
// Stations are left out one at a time, each time the one whose loss costs least among those without
// which the others still register in the order that they have. From one scan to all; fewer of the
// first where the budget expires.
std::vector<WorthStep> WorthCurve(const OrderProblem& problem, Routes routes,
                                  std::span<const cover::ElementSet> covers,
                                  std::span<const double> weights,
                                  const parallel::Budget& budget = {});

}  // namespace vantage::tour

#endif  // VANTAGE_CORE_TOUR_WORTH_CURVE_H_
