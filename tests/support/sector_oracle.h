// What a scan that sees a sector gains, told ray by ray.
#ifndef VANTAGE_TESTS_SUPPORT_SECTOR_ORACLE_H_
#define VANTAGE_TESTS_SUPPORT_SECTOR_ORACLE_H_

#include <Eigen/Core>
#include <cmath>
#include <span>
#include <vector>

#include "core/parallel/budget.h"
#include "core/planning/scoring/brute_force.h"
#include "core/planning/scoring/constraints.h"
#include "core/planning/scoring/headings.h"

namespace vantage::test_support {

struct SectorScore {
  double least = 0;  // samples, of the cells that are certainly in the sector
  double most = 0;   // and of those on its border, which rounding may put on either side
};

// Every cell by itself: what it gains from `view`, and whether its azimuth is within half the span
// of each of the headings (rad).
inline std::vector<SectorScore> ScoreInSectors(const planning::BruteForceScorer& scorer,
                                               const planning::CellArrays& cells,
                                               const Eigen::Vector3d& view,
                                               std::span<const double> headings) {
  constexpr double kBorder = 1e-5;   // rad
  constexpr double kUpright = 1e-3;  // m: cells above or below the view have no azimuth
  const double half = scorer.constraints().scanner().azimuth_span / 2;
  std::vector<float> cell_scores(cells.size());
  scorer.ScoreCells(view, cells, parallel::Budget::Unlimited(), cell_scores);
  std::vector<SectorScore> scores(headings.size());
  for (size_t i = 0; i < cells.size(); ++i) {
    if (cell_scores[i] <= 0) continue;
    const Eigen::Vector2d offset(static_cast<double>(cells.x[i]) - view.x(),
                                 static_cast<double>(cells.y[i]) - view.y());
    const double azimuth = std::atan2(offset.y(), offset.x());
    const double border = offset.norm() < kUpright ? sensor::kPi : kBorder;
    for (size_t k = 0; k < headings.size(); ++k) {
      const double off = std::abs(std::remainder(azimuth - headings[k], 2 * sensor::kPi));
      if (off < half - border) scores[k].least += static_cast<double>(cell_scores[i]);
      if (off < half + border) scores[k].most += static_cast<double>(cell_scores[i]);
    }
  }
  return scores;
}

inline std::vector<double> AnglesOf(const planning::Headings& headings) {
  std::vector<double> angles;
  for (size_t i = 0; i < headings.size(); ++i) angles.push_back(headings.Angle(i));
  return angles;
}

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_SECTOR_ORACLE_H_
