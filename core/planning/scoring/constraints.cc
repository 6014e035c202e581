#include "core/planning/scoring/constraints.h"

#include <algorithm>
#include <cmath>
#include <utility>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace vantage::planning {
namespace {

using Packet = Eigen::Array<float, 8, 1>;
using Load = Eigen::Map<const Packet>;

// m, of cells that pad a packet: far away in every coordinate.
constexpr float kFarAway = 1e9f;

size_t PaddedSize(size_t cells) {
  return (cells + CellArrays::kPacket - 1) / CellArrays::kPacket * CellArrays::kPacket;
}

float SteepestOf(const SkylineSines& around) {
  if (around.covered()) return CellArrays::kAnyRay;
  return static_cast<float>(*std::max_element(around.sine.begin(), around.sine.end())) / 126;
}

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
  if (!around.covered() && skyline.empty()) {
    // Those before are covered.
    skyline.resize(cell.size());
    steepest.resize(cell.size(), kAnyRay);
  }
  if (!around.covered() || !skyline.empty()) {
    skyline.push_back(around);
    steepest.push_back(SteepestOf(around));
  }
  const size_t lane = cell.size() % kPacket;
  if (lane == 0) dropouts_begin.push_back(static_cast<uint32_t>(dropouts.size()));
  cell.push_back(index);
  for (const Eigen::Vector3f& from : cell_dropouts) {
    dropouts.push_back(from);
    dropout_lane.push_back(static_cast<uint8_t>(lane));
  }
}

bool CellArrays::IsDropout(const Eigen::Vector3f& view, size_t i) const {
  // Cosine. Whether glass answers changes within 5 degrees of head on; twice that, since mirrors
  // and what is black change more slowly. A property of materials, whatever the scanner and the
  // voxel.
  static const float kSameDirection = std::cos(static_cast<float>(sensor::Radians(10)));
  // m, a choice: a view nearer by less than this is most likely in front of the same pane.
  constexpr float kNearer = 0.5f;
  const std::span<const Eigen::Vector3f> cell_dropouts = DropoutsOf(i);
  if (cell_dropouts.empty()) return false;
  const Eigen::Vector3f at(x[i], y[i], z[i]);
  const Eigen::Vector3f to_view = view - at;
  const float distance = to_view.norm();
  return std::any_of(cell_dropouts.begin(), cell_dropouts.end(), [&](const Eigen::Vector3f& from) {
    const Eigen::Vector3f dropped = from - at;
    const float range = dropped.norm();
    return distance >= range - kNearer && dropped.dot(to_view) >= kSameDirection * range * distance;
  });
}

void CellArrays::Reserve(size_t cells) {
  const size_t padded = PaddedSize(cells);
  for (CopyOnWriteVector<float>* values :
       {&x, &y, &z, &nx, &ny, &nz, &factor, &q, &enough, &tx, &ty, &tz}) {
    values->reserve(padded);
  }
  cell.reserve(cells);
  dropouts_begin.reserve(padded / kPacket);
}

void CellArrays::Pad() {
  const size_t padded = PaddedSize(cell.size());
  for (CopyOnWriteVector<float>* values : {&x, &y, &z}) values->resize(padded, kFarAway);
  for (CopyOnWriteVector<float>* values : {&nx, &ny, &nz, &factor, &q, &enough, &tx, &ty, &tz}) {
    values->resize(padded, 0.0f);
  }
  if (!steepest.empty()) steepest.resize(padded, 0.0f);
}

void CellArrays::Pick(const std::vector<uint32_t>& indices) {
  const size_t padded = PaddedSize(indices.size());
  const auto pick = [&](auto& values, size_t size, auto with) {
    std::vector<decltype(with)> picked;
    picked.reserve(size);
    for (const uint32_t i : indices) picked.push_back(values[i]);
    picked.resize(size, with);
    values = std::move(picked);
  };
  if (!dropouts.empty()) {
    CellArrays reordered;  // these alone
    reordered.dropouts_begin.reserve(padded / kPacket);
    for (size_t k = 0; k < indices.size(); ++k) {
      if (k % kPacket == 0) {
        reordered.dropouts_begin.push_back(static_cast<uint32_t>(reordered.dropouts.size()));
      }
      for (const Eigen::Vector3f& from : DropoutsOf(indices[k])) {
        reordered.dropouts.push_back(from);
        reordered.dropout_lane.push_back(static_cast<uint8_t>(k % kPacket));
      }
    }
    dropouts = std::move(reordered.dropouts);
    dropout_lane = std::move(reordered.dropout_lane);
    dropouts_begin = std::move(reordered.dropouts_begin);
  } else {
    dropouts_begin = std::vector<uint32_t>(padded / kPacket, 0);
  }
  for (CopyOnWriteVector<float>* values : {&x, &y, &z}) pick(*values, padded, kFarAway);
  for (CopyOnWriteVector<float>* values : {&nx, &ny, &nz, &factor, &q, &enough, &tx, &ty, &tz}) {
    pick(*values, padded, 0.0f);
  }
  if (!skyline.empty()) {
    pick(skyline, indices.size(), SkylineSines());
    pick(steepest, padded, 0.0f);
  }
  pick(cell, indices.size(), uint32_t{0});
}

CellArrays CellArrays::Gather(const std::vector<uint32_t>& indices,
                              const std::vector<float>& factors) const {
  CellArrays out = *this;
  out.Pick(indices);
  std::vector<float> padded = factors;
  padded.resize(PaddedSize(indices.size()), 0.0f);
  out.factor = std::move(padded);
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
  Packet steepest;
  if (cells.steepest.empty()) {
    steepest.setConstant(CellArrays::kAnyRay);
  } else {
    steepest = Load(&cells.steepest[at]);
  }
  const auto seen = facing >= cos_incidence_ * range && range2 >= range2_min_ &&
                    range2 <= range2_max_ && dz >= sin_min_ * range && dz <= sin_max_ * range &&
                    dz <= steepest * range;
  Eigen::Map<Packet> out(scores);
  out = seen.select(Load(&cells.factor[at]) * t, 0.0f);
  return PositiveBits(scores);
}

}  // namespace vantage::planning
