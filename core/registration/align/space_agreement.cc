#include "core/registration/align/space_agreement.h"

#include <algorithm>
#include <cstdint>
#include <optional>

namespace vantage::registration {

std::optional<Eigen::Vector3f> SurfacePassed(const model::PlanningView& model,
                                             const Eigen::Vector3d& origin,
                                             const Eigen::Vector3d& point) {
  const double h = model.voxel_size();
  // A sample this far behind a surface has gone through it: more than twice the reach of a match
  // (kFineReach). Holds while the noise is below half a voxel.
  const double behind = 4 * h;
  constexpr double kFromScanner = 0.3;  // m: nearer there is only the tripod
  constexpr double kFacing = 0.3;       // cosine: flatter, and the voxel that is met is a guess
  constexpr double kThrough = 0.4;      // voxels from a ray to a centroid, that it met the voxel
  const Eigen::Vector3d ray = point - origin;
  const double length = ray.norm();
  const Eigen::Vector3d direction = ray / length;
  model::VoxelIndex last = model::VoxelIndex::Constant(INT32_MIN);
  for (double t = kFromScanner; t < length - behind; t += 0.5 * h) {
    const model::VoxelIndex v = model.At(origin + t * direction);
    if (v == last) continue;
    last = v;
    if (model.State(v) != model::VoxelState::kTrueSurface) continue;
    const std::optional<model::SurfaceVoxel> voxel = model.Surface(v);
    const Eigen::Vector3d n = voxel->normal.cast<double>();
    if (voxel->samples == 0 || n.dot(direction) > -kFacing) continue;
    const Eigen::Vector3d to = voxel->centroid.cast<double>() - origin;
    const double off = (to - to.dot(direction) * direction).norm();
    if (off < kThrough * h && n.dot(point - voxel->centroid.cast<double>()) < -0.5 * behind) {
      return voxel->normal;
    }
  }
  return std::nullopt;
}

double SpaceAgreement::ContradictionShare() const {
  const double met = fitting + contradicting;
  return met > 0 ? contradicting / met : 0;
}

double SpaceAgreement::Left() const {
  if (contradicting <= 0) return 1;
  return fitting > contradicting ? 1 - contradicting / fitting : 0;
}

std::vector<SampleAgreement> CompareSamples(const model::PlanningView& model,
                                            const VoxelSearch& search,
                                            std::span<const SurfaceSample> samples,
                                            const Eigen::Isometry3d& T_world_scan,
                                            parallel::Parallel& parallel) {
  const Eigen::Vector3d origin = T_world_scan.translation();
  // Voxels to all sides that have to be empty, too: a voxel more than a match reaches (kFineReach).
  // Surface nearby may be the sample's own, moved or blurred.
  constexpr int kFreeAround = 2;
  const auto compare = [&](const SurfaceSample& s) {
    const Eigen::Vector3d point = T_world_scan * s.point.cast<double>();
    const Eigen::Vector3d normal = T_world_scan.linear() * s.normal.cast<double>();
    if (search.Find(point, normal).voxel != nullptr) return SampleAgreement::kFits;
    const model::VoxelIndex at = model.At(point);
    bool free = model.Empty(at);
    for (int z = -kFreeAround; free && z <= kFreeAround; ++z) {
      for (int y = -kFreeAround; free && y <= kFreeAround; ++y) {
        for (int x = -kFreeAround; free && x <= kFreeAround; ++x) {
          free = model.Empty(at + model::VoxelIndex(x, y, z));
        }
      }
    }
    if (free || SurfacePassed(model, origin, point).has_value()) {
      return SampleAgreement::kContradicts;
    }
    const model::VoxelState state = model.State(at);
    const bool known =
        state == model::VoxelState::kEmpty || state == model::VoxelState::kTrueSurface;
    return known ? SampleAgreement::kMissed : SampleAgreement::kNothingKnown;
  };
  constexpr size_t kChunk = 1024;
  std::vector<SampleAgreement> agreements(samples.size());
  parallel.For((samples.size() + kChunk - 1) / kChunk, [&](size_t chunk) {
    const size_t end = std::min(samples.size(), (chunk + 1) * kChunk);
    for (size_t i = chunk * kChunk; i < end; ++i) agreements[i] = compare(samples[i]);
  });
  return agreements;
}

SpaceAgreement AgreementOf(std::span<const SurfaceSample> samples,
                           std::span<const SampleAgreement> agreements) {
  SpaceAgreement sum;
  for (size_t i = 0; i < samples.size(); ++i) {
    if (agreements[i] == SampleAgreement::kFits) sum.fitting += samples[i].cells;
    if (agreements[i] == SampleAgreement::kContradicts) sum.contradicting += samples[i].cells;
  }
  return sum;
}

}  // namespace vantage::registration
