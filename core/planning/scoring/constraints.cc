#include "core/planning/scoring/constraints.h"

#include <algorithm>
#include <cmath>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace vantage::planning {
namespace {

using Packet = Eigen::Array<float, 8, 1>;
using Load = Eigen::Map<const Packet>;

uint32_t PositiveBits(const float* values) {
#if defined(__SSE__)
  const __m128 zero = _mm_setzero_ps();
  const int low = _mm_movemask_ps(_mm_cmpgt_ps(_mm_loadu_ps(values), zero));
  const int high = _mm_movemask_ps(_mm_cmpgt_ps(_mm_loadu_ps(values + 4), zero));
  return static_cast<uint32_t>(low | high << 4);
#else
  uint32_t bits = 0;
  for (int i = 0; i < 8; ++i) bits |= static_cast<uint32_t>(values[i] > 0) << i;
  return bits;
#endif
}

}  // namespace

void CellArrays::Add(const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                     float sample_factor, float density, float enough_density,
                     const Eigen::Vector3f& target, uint32_t index,
                     std::span<const Eigen::Vector3f> cell_dropouts, const SkylineSines& around) {
  x.push_back(position.x());
  y.push_back(position.y());
  z.push_back(position.z());
  nx.push_back(normal.x());
  ny.push_back(normal.y());
  nz.push_back(normal.z());
  factor.push_back(sample_factor);
  q.push_back(density);
  enough.push_back(enough_density);
  tx.push_back(target.x());
  ty.push_back(target.y());
  tz.push_back(target.z());
  skyline.push_back(around);
  steepest.push_back(
      around.covered()
          ? kAnyRay
          : static_cast<float>(*std::max_element(around.sine.begin(), around.sine.end())) / 126);
  cell.push_back(index);
  dropouts_begin.push_back(static_cast<uint32_t>(dropouts.size()));
  dropouts.insert(dropouts.end(), cell_dropouts.begin(), cell_dropouts.end());
  dropouts_end.push_back(static_cast<uint32_t>(dropouts.size()));
}

bool CellArrays::IsDropout(const Eigen::Vector3f& view, size_t i) const {
  // Cosine. Whether glass answers changes within 5 degrees of head on; twice that, since mirrors
  // and what is black change more slowly. A property of materials, whatever the scanner and the
  // voxel.
  static const float kSameDirection = std::cos(static_cast<float>(sensor::Radians(10)));
  // m, a choice: a view nearer by less than this is most likely in front of the same pane.
  constexpr float kNearer = 0.5f;
  if (dropouts_begin[i] == dropouts_end[i]) return false;
  const Eigen::Vector3f at(x[i], y[i], z[i]);
  const Eigen::Vector3f to_view = view - at;
  const float distance = to_view.norm();
  const std::span<const Eigen::Vector3f> cell_dropouts = DropoutsOf(i);
  return std::any_of(cell_dropouts.begin(), cell_dropouts.end(), [&](const Eigen::Vector3f& from) {
    const Eigen::Vector3f dropped = from - at;
    const float range = dropped.norm();
    return distance >= range - kNearer && dropped.dot(to_view) >= kSameDirection * range * distance;
  });
}

void CellArrays::Reserve(size_t cells) {
  const size_t padded = (cells + kPacket - 1) / kPacket * kPacket;
  for (std::vector<float>* values :
       {&x, &y, &z, &nx, &ny, &nz, &factor, &q, &enough, &tx, &ty, &tz, &steepest}) {
    values->reserve(padded);
  }
  skyline.reserve(cells);
  for (std::vector<uint32_t>* values : {&cell, &dropouts_begin, &dropouts_end}) {
    values->reserve(cells);
  }
}

void CellArrays::Pad() {
  const size_t padded = (cell.size() + kPacket - 1) / kPacket * kPacket;
  // A cell that is far away in every coordinate and gains nothing.
  for (std::vector<float>* values : {&x, &y, &z}) values->resize(padded, 1e9f);
  for (std::vector<float>* values :
       {&nx, &ny, &nz, &factor, &q, &enough, &tx, &ty, &tz, &steepest}) {
    values->resize(padded, 0.0f);
  }
}

CellArrays CellArrays::Gather(const std::vector<uint32_t>& indices,
                              const std::vector<float>& factors) const {
  CellArrays out;
  out.Reserve(indices.size());
  for (size_t k = 0; k < indices.size(); ++k) {
    const size_t i = indices[k];
    out.Add({x[i], y[i], z[i]}, {nx[i], ny[i], nz[i]}, factors[k], q[i], enough[i],
            {tx[i], ty[i], tz[i]}, cell[i], DropoutsOf(i), skyline[i]);
  }
  out.Pad();
  return out;
}

SensingConstraints::SensingConstraints(const sensor::ScannerModel& scanner)
    : scanner_(scanner),
      per_steradian_(static_cast<float>(1 / (scanner.azimuth_step * scanner.elevation_step))),
      least_cos_(static_cast<float>(std::sin(scanner.elevation_step))),
      range2_min_(static_cast<float>(scanner.range_min * scanner.range_min)),
      range2_max_(static_cast<float>(scanner.range_max * scanner.range_max)),
      // A limit at the pole excludes nothing, not even by rounding.
      sin_min_(scanner.elevation_min <= -sensor::kPi / 2 + 1e-6
                   ? -2.0f
                   : static_cast<float>(std::sin(scanner.elevation_min))),
      sin_max_(scanner.elevation_max >= sensor::kPi / 2 - 1e-6
                   ? 2.0f
                   : static_cast<float>(std::sin(scanner.elevation_max))),
      cos_incidence_(static_cast<float>(std::cos(scanner.max_incidence))) {}

double SensingConstraints::AddedDensity(const Eigen::Vector3d& view,
                                        const Eigen::Vector3d& position,
                                        const Eigen::Vector3d& normal, double q,
                                        double enough) const {
  const Eigen::Vector3d d = position - view;
  const double range = d.norm();
  if (range < scanner_.range_min || range > scanner_.range_max) return 0;
  const double elevation = std::asin(std::clamp(d.z() / range, -1.0, 1.0));
  if (elevation < scanner_.elevation_min || elevation > scanner_.elevation_max) return 0;
  const double cos_incidence = -normal.dot(d) / range;
  if (cos_incidence < std::cos(scanner_.max_incidence)) return 0;
  const double s = scanner_.SamplingDensity(elevation, cos_incidence, range);
  return std::max(0.0, std::min(s, enough) - q);
}

uint32_t SensingConstraints::CellScores(const Eigen::Vector3f& view, const CellArrays& cells,
                                        size_t packet, float scores[8]) const {
  const size_t at = packet * CellArrays::kPacket;
  const Packet dx = Load(&cells.x[at]) - view.x();
  const Packet dy = Load(&cells.y[at]) - view.y();
  const Packet dz = Load(&cells.z[at]) - view.z();
  // n . (v - A)
  const Packet facing =
      -(Load(&cells.nx[at]) * dx + Load(&cells.ny[at]) * dy + Load(&cells.nz[at]) * dz);
  if (PositiveBits(facing.data()) == 0) return 0;
  const Packet horizontal2 = dx * dx + dy * dy;
  const Packet range2 = horizontal2 + dz * dz;
  const Packet range = range2.sqrt();
  const Packet cos_range = horizontal2.sqrt().max(least_cos_ * range);
  const Packet s = per_steradian_ * facing / (range2 * cos_range);
  const Packet t = (s.min(Load(&cells.enough[at])) - Load(&cells.q[at])).max(0.0f);
  const auto seen = facing >= cos_incidence_ * range && range2 >= range2_min_ &&
                    range2 <= range2_max_ && dz >= sin_min_ * range && dz <= sin_max_ * range &&
                    dz <= Load(&cells.steepest[at]) * range;
  Eigen::Map<Packet> out(scores);
  out = seen.select(Load(&cells.factor[at]) * t, 0.0f);
  return PositiveBits(scores);
}

}  // namespace vantage::planning
