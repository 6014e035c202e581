// The sensing constraints and the score of a view on a patch cell, without visibility (algorithm.md
// sections 3 and 5).
#ifndef VANTAGE_CORE_PLANNING_SCORING_CONSTRAINTS_H_
#define VANTAGE_CORE_PLANNING_SCORING_CONSTRAINTS_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/planning/patches/skyline.h"
#include "core/planning/plan/copy_on_write_vector.h"
#include "core/sensor/scanner_model.h"

namespace vantage::planning {

// Patch cells as the scorers read them: structure of arrays, padded to whole packets of 8 with
// cells that never gain anything. Copies share the arrays until they change them. What only some
// cells have takes no memory where none has it.
struct CellArrays {
  static constexpr size_t kPacket = 8;
  static constexpr float kAnyRay = 2;  // of `steepest`: no ray is too steep, not even by rounding

  CopyOnWriteVector<float> x, y, z;     // m, model frame
  CopyOnWriteVector<float> nx, ny, nz;  // unit normal
  CopyOnWriteVector<float> factor;      // score per sample/m^2: weight * success * area
  CopyOnWriteVector<float> q;           // samples / m^2
  CopyOnWriteVector<float> enough;      // samples / m^2, > q: density beyond this gains nothing
  CopyOnWriteVector<float> tx, ty, tz;  // target, scene coordinates
  CopyOnWriteVector<uint32_t> cell;     // index of the deficient cell
  // What passes over it passes into the sky, and the largest of these sines (kAnyRay where it is
  // covered). Empty where all cells are covered.
  CopyOnWriteVector<SkylineSines> skyline;
  CopyOnWriteVector<float> steepest;
  // Places from which rays to cells dropped out (m, model frame), by cell; which cell of its packet
  // that is; and by packet, where they begin.
  CopyOnWriteVector<Eigen::Vector3f> dropouts;
  CopyOnWriteVector<uint8_t> dropout_lane;
  CopyOnWriteVector<uint32_t> dropouts_begin;

  size_t size() const { return cell.size(); }
  size_t packets() const { return x.size() / kPacket; }
  void Reserve(size_t cells);
  // Appends a cell; Pad() when all are in.
  void Add(const Eigen::Vector3f& position, const Eigen::Vector3f& normal, float sample_factor,
           float density, float enough_density, const Eigen::Vector3f& target, uint32_t index,
           std::span<const Eigen::Vector3f> cell_dropouts = {}, const SkylineSines& around = {});
  void Pad();
  // True when a ray from a view (m) to the cell is expected to drop out, too: within ten degrees of
  // a ray that did, and not nearer to the cell than that place by more than half a metre, since
  // what absorbed the ray may be anywhere on the way.
  bool IsDropout(const Eigen::Vector3f& view, size_t i) const;
  // True when some rays to the cell pass into the sky.
  bool UnderSky(size_t i) const { return !steepest.empty() && steepest[i] < kAnyRay; }
  // True when a ray from a view (m) to the cell passes over all that is to be expected behind it.
  bool PassesIntoSky(const Eigen::Vector3f& view, size_t i) const {
    return UnderSky(i) && skyline[i].PassedBy(x[i] - view.x(), y[i] - view.y(), z[i] - view.z());
  }
  std::span<const Eigen::Vector3f> DropoutsOf(size_t i) const {
    const size_t packet = i / kPacket;
    const auto lane = static_cast<uint8_t>(i % kPacket);
    size_t begin = dropouts_begin[packet];
    const size_t limit =
        packet + 1 < dropouts_begin.size() ? dropouts_begin[packet + 1] : dropouts.size();
    while (begin < limit && dropout_lane[begin] < lane) ++begin;
    size_t end = begin;
    while (end < limit && dropout_lane[end] == lane) ++end;
    return std::span(dropouts).subspan(begin, end - begin);
  }
  // The cells at `indices`, with these factors.
  CellArrays Gather(const std::vector<uint32_t>& indices, const std::vector<float>& factors) const;
  // Leaves the cells at `indices`, in this order, padded: one array after the other.
  void Pick(const std::vector<uint32_t>& indices);
};

// The constraints of range, field of view and incidence, and the gain where they hold.
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
