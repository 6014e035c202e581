#include "tests/support/phantom_oracle.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "core/simulation/random_sequence.h"

namespace vantage::test_support {
namespace {

constexpr double kNothingThere = 0.15;  // m: three voxels; a mixed pixel reaches two of them
constexpr float kSameRange = 0.05F;     // m: more than noise, less than a mirror is from anything
constexpr int kStride = 4;

bool HoldsSurface(const model::PlanningView& model, const Eigen::Vector3f& point) {
  const model::VoxelIndex middle = model.At(point.cast<double>());
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        const model::VoxelState state =
            model.State(model::VoxelIndex(middle + model::VoxelIndex(x, y, z)));
        if (state == model::VoxelState::kTrueSurface || state == model::VoxelState::kAbsorbed) {
          return true;
        }
      }
    }
  }
  return false;
}

}  // namespace

PhantomOracle::PosedScan PhantomOracle::Scan(const Eigen::Vector3d& position,
                                             const sensor::ScannerModel& scanner, uint64_t seed,
                                             parallel::Parallel& parallel) {
  simulation::RandomSequence random(seed);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(position);
  pose.rotate(Eigen::AngleAxisd(random.Between(0, 6), Eigen::Vector3d::UnitZ()));
  simulation::ScanFaults truth = simulation::ScanFaults::None();
  PosedScan made;
  made.scan.scanner = scanner;
  made.scan.image = simulated_.Scan(scanner, pose, simulation::ScanFaults{}, seed, parallel);
  const sensor::RangeImage met = simulated_.Scan(scanner, pose, truth, seed, parallel);
  made.T_model_scan = pose;
  for (int axis = 0; axis < 3; ++axis) {
    constexpr double kShift = 0.003;  // m
    constexpr double kTurn = 0.0004;  // rad
    made.T_model_scan.pretranslate(Eigen::Vector3d::Unit(axis) * random.Between(-kShift, kShift));
    made.T_model_scan.rotate(
        Eigen::AngleAxisd(random.Between(-kTurn, kTurn), Eigen::Vector3d::Unit(axis)));
  }
  const sensor::RangeImage& image = made.scan.image;
  for (int c = 0; c < image.columns(); ++c) {
    for (int r = 0; r < image.rows(); ++r) {
      const float range = image.at(c, r);
      if (!sensor::RangeImage::IsRange(range)) continue;
      const Eigen::Vector3d ray(std::cos(image.elevation[static_cast<size_t>(r)]) *
                                    std::cos(image.azimuth[static_cast<size_t>(c)]),
                                std::cos(image.elevation[static_cast<size_t>(r)]) *
                                    std::sin(image.azimuth[static_cast<size_t>(c)]),
                                std::sin(image.elevation[static_cast<size_t>(r)]));
      const Eigen::Vector3f at =
          (made.T_model_scan * (static_cast<double>(range) * ray)).cast<float>();
      if (met.at(c, r) > 0 && range > met.at(c, r) + static_cast<float>(kNothingThere)) {
        reflected_.push_back(at);
      } else if (c % kStride == 0 && r % kStride == 0 &&
                 std::abs(range - met.at(c, r)) < kSameRange) {
        real_.push_back({made.T_model_scan.translation().cast<float>(), at});
      }
    }
  }
  return made;
}

double PhantomOracle::PhantomArea(const model::PlanningView& model) const {
  double area = 0;
  model.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (state != model::VoxelState::kTrueSurface) return;
        const double clearance =
            simulated_.Clearance(surface.centroid.template cast<double>(), kNothingThere);
        if (clearance >= kNothingThere) area += static_cast<double>(surface.area);
      });
  return area;
}

double PhantomOracle::ReflectedArea(double voxel_size) const {
  std::set<std::tuple<int, int, int>> voxels;
  for (const Eigen::Vector3f& point : reflected_) {
    if (simulated_.Clearance(point.cast<double>(), kNothingThere) < kNothingThere) continue;
    const Eigen::Vector3i v =
        (point.cast<double>() / voxel_size).array().floor().cast<int>().matrix();
    voxels.emplace(v.x(), v.y(), v.z());
  }
  return static_cast<double>(voxels.size()) * voxel_size * voxel_size;
}

PhantomOracle::Lost PhantomOracle::LostReturns(const model::PlanningView& model) const {
  Lost lost;
  for (const Return& real : real_) {
    ++lost.returns;
    lost.lost += HoldsSurface(model, real.at) ? 0 : 1;
  }
  return lost;
}

PhantomOracle::Lost PhantomOracle::LostThrough(const Eigen::AlignedBox3d& opening,
                                               const model::PlanningView& model) const {
  // A wall is thinner than its opening is wide and high.
  Eigen::Index across = 0;
  opening.sizes().minCoeff(&across);
  const auto middle = static_cast<float>(opening.center()[across]);
  Lost lost;
  for (const Return& real : real_) {
    const float from = real.from[across] - middle;
    const float to = real.at[across] - middle;
    if (from * to >= 0) continue;
    const Eigen::Vector3d crossing =
        (real.from + (real.at - real.from) * (from / (from - to))).cast<double>();
    if (!opening.contains(crossing)) continue;
    ++lost.returns;
    lost.lost += HoldsSurface(model, real.at) ? 0 : 1;
  }
  return lost;
}

}  // namespace vantage::test_support
