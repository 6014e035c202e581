// The sensing constraints and the score of a view on a patch cell, visibility apart (algorithm.md
// sections 3 and 5).
#ifndef VANTAGE_CORE_PLANNING_SCORING_CONSTRAINTS_H_
#define VANTAGE_CORE_PLANNING_SCORING_CONSTRAINTS_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/sensor/scanner_model.h"

namespace vantage::planning {

// Patch cells as the scorers read them: structure of arrays, padded to whole packets of 8 with
// cells that never gain anything.
struct CellArrays {
  static constexpr size_t kPacket = 8;

  std::vector<float> x, y, z;     // m, model frame
  std::vector<float> nx, ny, nz;  // unit normal
  std::vector<float> factor;      // score per sample/m^2: weight * success * area
  std::vector<float> q;           // samples / m^2
  std::vector<float> enough;      // samples / m^2: more than this gains nothing more, > q
  std::vector<float> tx, ty, tz;  // target, scene coordinates
  std::vector<uint32_t> cell;     // which deficient cell it is
  // From where rays to it dropped out (m, model frame): [dropouts_begin, dropouts_end) of
  // `dropouts`.
  std::vector<uint32_t> dropouts_begin, dropouts_end;
  std::vector<Eigen::Vector3f> dropouts;

  size_t size() const { return cell.size(); }
  size_t packets() const { return x.size() / kPacket; }
  // Appends a cell; Pad() when all are in.
  void Add(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, float sample_factor,
           float density, float enough_density, const Eigen::Vector3f& target, uint32_t index,
           std::span<const Eigen::Vector3f> cell_dropouts = {});
  void Pad();
  // Would a ray from a view (m) drop out, too? It does past a place from which one did: within ten
  // degrees, and not nearer to it by more than half a metre: what is in between may be anywhere on
  // the way.
  bool IsDropout(const Eigen::Vector3f& view, size_t i) const;
  std::span<const Eigen::Vector3f> DropoutsOf(size_t i) const {
    return std::span(dropouts).subspan(dropouts_begin[i], dropouts_end[i] - dropouts_begin[i]);
  }
  // Those at `indices`, with their factors replaced.
  CellArrays Gather(const std::vector<uint32_t>& indices, const std::vector<float>& factors) const;
};

// Range interval, field of view, incidence, and what is gained where they hold.
class SensingConstraints {
 public:
  explicit SensingConstraints(const sensor::ScannerModel& scanner);

  // Scalar, in double: t(v, A) = max(0, min(s, enough) - q), or 0 where a constraint is violated.
  double AddedDensity(const Eigen::Vector3d& view, const Eigen::Vector3d& position,
                      const Eigen::Vector3d& normal, double q, double enough) const;

  // Scores (factor * t, samples) of the 8 cells from 8 * packet on. Returns the bits of those above
  // 0.
  uint32_t CellScores(const Eigen::Vector3f& view, const CellArrays& cells, size_t packet,
                      float scores[8]) const;

  const sensor::ScannerModel& scanner() const { return scanner_; }

 private:
  sensor::ScannerModel scanner_;
  // The same in float, as the packets use them.
  float per_steradian_;  // 1 / (da de)
  float least_cos_;      // of the elevation, for density
  float range2_min_, range2_max_;
  float sin_min_, sin_max_;  // of the elevation
  float cos_incidence_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_SCORING_CONSTRAINTS_H_
