#include "core/planning/patches/skyline.h"

#include <algorithm>
#include <cmath>

#include "core/sensor/scanner_model.h"
#include "core/visibility/surface_walk.h"

namespace vantage::planning {
namespace {

using model::Brick;
using model::VoxelState;

// Behind false surface is where its normal points away from, and to the sides, since a normal of
// false surface is good to some 45 degrees. Cosine, 60 degrees.
constexpr double kFan = 0.5;
// A normal as steep as this points nowhere in particular in the horizontal.
constexpr double kSteep = 0.3;
constexpr double kReach = 30;  // m that are looked at: across a street, a yard, a roof
// Steps grow with the distance, as a share of it: what is passed over seems narrower than 3
// degrees.
constexpr double kStepShare = 0.05;
constexpr double kNothing = -1.0;  // slope: down by 45 degrees
// m by which a viewpoint may be higher than those there were: tripods differ by no more.
constexpr double kHeadRoom = 1.0;

// The z of a brick's highest measured voxel, within the brick; -1 when there is none.
int HighestMeasured(const Brick& brick) {
  for (int local = Brick::kVoxels - 1; local >= 0; --local) {
    const VoxelState state = brick.state[static_cast<size_t>(local)];
    if (state == VoxelState::kTrueSurface || state == VoxelState::kAbsorbed) return local / 64;
  }
  return -1;
}

bool AnyEmpty(const Brick& brick) {
  return std::find(brick.state.begin(), brick.state.end(), VoxelState::kEmpty) != brick.state.end();
}

}  // namespace

std::optional<Skyline> Skyline::Of(const model::PlanningView& model,
                                   const parallel::Cancellation& cancelled) {
  Skyline line(model);
  for (const model::Station& station : model.stations()) {
    line.highest_view_ = std::max(line.highest_view_, station.position.z() + kHeadRoom);
  }
  if (model.bounds().empty()) return line;
  const model::VoxelIndex first = Brick::Of(model.bounds().min);
  const model::VoxelIndex last = Brick::Of(model.bounds().max - model::VoxelIndex::Ones());
  line.first_x_ = first.x();
  line.first_y_ = first.y();
  line.size_x_ = last.x() - first.x() + 1;
  line.size_y_ = last.y() - first.y() + 1;
  line.columns_.resize(static_cast<size_t>(line.size_x_) * static_cast<size_t>(line.size_y_));
  // The highest brick of each column that has empty voxels; bricks come by rising z.
  struct Highest {
    model::VoxelIndex at = model::VoxelIndex::Zero();
    const Brick* brick = nullptr;
  };
  std::vector<Highest> highest_empty(line.columns_.size());
  size_t until_poll = 0;
  for (const model::BrickAt& at : model.bricks()) {
    if (until_poll-- == 0) {
      if (cancelled.Requested()) return std::nullopt;
      until_poll = visibility::kBricksBetweenPolls;
    }
    const size_t column =
        static_cast<size_t>(at.brick.x() - first.x()) +
        static_cast<size_t>(line.size_x_) * static_cast<size_t>(at.brick.y() - first.y());
    if (const int z = HighestMeasured(*at.contents); z >= 0) {
      line.columns_[column].top = at.brick.z() * Brick::kSide + z;
    }
    if (AnyEmpty(*at.contents)) highest_empty[column] = {at.brick, at.contents.get()};
  }
  // An unknown voxel next to an empty one is false surface, unless a scan said that there is
  // nothing but the sky.
  for (size_t column = 0; column < line.columns_.size(); ++column) {
    if (highest_empty[column].brick == nullptr) continue;
    const Brick& brick = *highest_empty[column].brick;
    for (int local = 0; local < Brick::kVoxels && !line.columns_[column].open; ++local) {
      if (brick.state[static_cast<size_t>(local)] != VoxelState::kEmpty) continue;
      const model::VoxelIndex above =
          model::PlanningView::Global(highest_empty[column].at, local) + model::VoxelIndex::UnitZ();
      line.columns_[column].open = model.State(above) == VoxelState::kUnknown;
    }
    line.any_open_ |= line.columns_[column].open;
  }
  return line;
}

SkylineSines Skyline::LookAround(const model::VoxelIndex& brick, int z) const {
  const double side = Brick::kSide * model_.voxel_size();
  const Eigen::Vector2d from = (brick.head<2>().cast<double>().array() + 0.5) * side;
  SkylineSines around;
  for (size_t direction = 0; direction < SkylineSines::kDirections; ++direction) {
    double steepest = kNothing;
    // To either side of the middle of the sixteenth, so that all of it is looked at.
    for (const double aside : {-0.25, 0.25}) {
      const double azimuth =
          SkylineSines::AzimuthOf(direction) +
          aside * 2 * sensor::kPi / static_cast<double>(SkylineSines::kDirections);
      const Eigen::Vector2d ahead(std::cos(azimuth), std::sin(azimuth));
      for (double distance = side; distance <= kReach;
           distance += std::max(side, kStepShare * distance)) {
        const Eigen::Vector2d at = from + distance * ahead;
        const Column* column = At(static_cast<int>(std::floor(at.x() / side)),
                                  static_cast<int>(std::floor(at.y() / side)));
        if (column == nullptr) break;
        if (column->top == std::numeric_limits<int>::min()) continue;
        steepest = std::max(steepest, (column->top - z) * model_.voxel_size() / distance);
      }
    }
    const double sine = std::sin(std::atan(steepest));
    around.sine[direction] = static_cast<int8_t>(std::min(126.0, std::ceil(126 * sine)));
  }
  return around;
}

const SkylineSines& Skyline::Around(const model::VoxelIndex& voxel) {
  if (!any_open_) return covered_;
  const model::VoxelIndex brick = Brick::Of(voxel);
  const Column* own = At(brick.x(), brick.y());
  if (own == nullptr || !own->open || own->top >= voxel.z()) return covered_;
  const auto column = static_cast<uint64_t>(own - columns_.data());
  const uint64_t key = column << 32 | static_cast<uint32_t>(voxel.z());
  const auto [it, fresh] = known_.try_emplace(key);
  if (fresh) it->second = LookAround(brick, voxel.z());
  return it->second;
}

bool Skyline::InSky(const model::VoxelIndex& voxel, const Eigen::Vector3f& normal) {
  if (!any_open_ || model_.Centre(voxel).z() <= highest_view_) return false;
  const SkylineSines& around = Around(voxel);
  if (around.covered()) return false;
  const Eigen::Vector2d behind = -normal.head<2>().cast<double>();
  const bool level = behind.norm() >= kSteep;
  for (size_t i = 0; i < SkylineSines::kDirections; ++i) {
    const double azimuth = SkylineSines::AzimuthOf(i);
    const Eigen::Vector2d ahead(std::cos(azimuth), std::sin(azimuth));
    if (level && ahead.dot(behind) < kFan * behind.norm() - 1e-9) continue;
    if (around.sine[i] > 0) return false;
  }
  return true;
}

}  // namespace vantage::planning
