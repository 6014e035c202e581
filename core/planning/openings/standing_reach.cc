#include "core/planning/openings/standing_reach.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/model/view/brick_key.h"
#include "core/model/view/target_distances.h"
#include "core/visibility/voxel_walk.h"

namespace vantage::planning {
namespace {

constexpr double kCell = 1.0;  // m, of the grid of places
// m: heights in a cell that are one floor, and between the heights of viewpoints that are tried, at
// most. So what heights are off by adds 3 % to what places in a cell are.
constexpr double kSameFloor = 0.05;
constexpr double kHeightStep = 0.25;
constexpr double kNearby = 2.0;  // m in plan, where places are sought first
// Normals are told apart by a grid of so many steps from 0 to 1 on each axis, and one answer stands
// for all in a bin. Half the diagonal of a bin is 0.217, so a unit normal is within 12.6 degrees of
// its bin's middle, whichever it is.
constexpr int kNormalSteps = 4;
constexpr double kNormalSlack = sensor::Radians(13);

Eigen::Vector3i BinOf(const Eigen::Vector3f& normal) {
  return (normal.array() * kNormalSteps).round().cast<int>();
}

int DirectionOf(const Eigen::Vector3i& bin) {
  constexpr int kSide = 2 * kNormalSteps + 1;
  return (bin.x() + kNormalSteps) +
         kSide * ((bin.y() + kNormalSteps) + kSide * (bin.z() + kNormalSteps));
}

Eigen::Vector3d CentreOfBrick(const model::VoxelIndex& brick, double voxel_size) {
  return (brick.cast<double>().array() + 0.5) * (model::Brick::kSide * voxel_size);
}

// Heights of viewpoints over the floor, m, such that none is farther than half a step from one.
std::vector<double> HeightsFrom(double lowest, double highest) {
  const int steps = std::max(1, static_cast<int>(std::ceil((highest - lowest) / kHeightStep)));
  std::vector<double> heights;
  for (int i = 0; i <= steps; ++i) heights.push_back(lowest + (highest - lowest) * i / steps);
  return heights;
}

}  // namespace

StandingReach::StandingReach(const model::PlanningView& model,
                             std::span<const sensor::ScannerModel> scanners,
                             const PlanningConfig& config)
    : model_(model),
      heights_(HeightsFrom(config.min_viewpoint_height, config.max_viewpoint_height)) {
  for (const sensor::ScannerModel& scanner : scanners) {
    instruments_.push_back({scanner, std::cos(scanner.max_incidence)});
  }
}

std::optional<StandingReach> StandingReach::Of(const model::PlanningView& model,
                                               const FloorMap& floor,
                                               std::span<const sensor::ScannerModel> scanners,
                                               const PlanningConfig& config,
                                               const parallel::Cancellation& cancelled) {
  StandingReach reach(model, scanners, config);
  reach.voxel_size_ = model.voxel_size();
  const FloorColumns& columns = floor.columns();
  if (scanners.empty() || !floor.found() || columns.columns() == 0) return reach;
  const double h = model.voxel_size();
  const auto cell_of = [&](int voxel) {
    return static_cast<int>(std::floor((voxel + 0.5) * h / kCell));
  };
  const Eigen::Vector2i low = columns.Voxel(0);
  const Eigen::Vector2i high = low + columns.size() - Eigen::Vector2i::Ones();
  reach.first_ = {cell_of(low.x()), cell_of(low.y())};
  reach.size_ = Eigen::Vector2i(cell_of(high.x()), cell_of(high.y())) - reach.first_ +
                Eigen::Vector2i::Ones();
  reach.floors_.resize(static_cast<size_t>(reach.size_.x()) * static_cast<size_t>(reach.size_.y()));
  for (uint32_t column = 0; column < columns.columns(); ++column) {
    if (column % 4096 == 0 && cancelled.Requested()) return std::nullopt;
    const std::span<const Floor> here = columns.In(column);
    if (here.empty()) continue;
    const Eigen::Vector2i voxel = columns.Voxel(column);
    const Eigen::Vector2i cell =
        Eigen::Vector2i(cell_of(voxel.x()), cell_of(voxel.y())) - reach.first_;
    Heights& heights = reach.floors_[reach.Index(cell)];
    for (const Floor& one : here) {
      const bool known = std::any_of(heights.begin(), heights.end(), [&](float height) {
        return std::abs(height - one.height) < kSameFloor;
      });
      if (!known) heights.push_back(one.height);
    }
  }
  return reach;
}

// How far a place within the cell, at any height over any of its floors, and a voxel within the
// brick may be from where they are taken to be: half a cell's diagonal in plan, what heights are
// off by, and half a brick's diagonal.
StandingReach::Slack StandingReach::OfBrick() const {
  const double in_plan = std::sqrt(0.5) * kCell;
  const double upright = kSameFloor + 0.5 * kHeightStep;
  return {std::hypot(in_plan, upright) + std::sqrt(0.75) * model::Brick::kSide * voxel_size_,
          std::sin(kNormalSlack), std::cos(kNormalSlack)};
}

bool StandingReach::MeasuredFrom(const Eigen::Vector3d& place, const Instrument& instrument,
                                 const Eigen::Vector3d& centre, const Eigen::Vector3d& normal,
                                 double density, const Slack& slack) {
  const sensor::ScannerModel& scanner = instrument.model;
  const Eigen::Vector3d to_place = place - centre;
  const double distance = to_place.norm();
  if (distance <= 2 * slack.distance) return true;
  const double nearest = distance - slack.distance;
  if (nearest > scanner.range_max) return false;
  // Of the angle by which the incidence may be less than it is taken to be, and of the incidence
  // less that, without an inverse function: this is asked of millions of places.
  const double off_sine = slack.distance / distance;
  const double off_cosine = std::sqrt(1 - off_sine * off_sine);
  const double slack_sine = off_sine * slack.cosine + off_cosine * slack.sine;
  const double slack_cosine = off_cosine * slack.cosine - off_sine * slack.sine;
  const double cosine = std::clamp(normal.dot(to_place) / distance, -1.0, 1.0);
  const double least = cosine >= slack_cosine
                           ? 1
                           : cosine * slack_cosine + std::sqrt(1 - cosine * cosine) * slack_sine;
  if (least < instrument.cos_max_incidence) return false;
  const double sine = std::min(1.0, (std::abs(to_place.z()) + slack.distance) / nearest);
  return scanner.SamplingDensityAtSine(sine, least, nearest) >= density;
}

template <typename Fn>
bool StandingReach::AnyPlace(const Eigen::Vector3d& centre, const Eigen::Vector3d& normal,
                             double density, std::span<const double> heights, double within,
                             Fn&& fn) const {
  const Slack slack = OfBrick();
  for (const Instrument& instrument : instruments_) {
    const sensor::ScannerModel& scanner = instrument.model;
    // A scanner samples most densely overhead, but no denser over any distance in plan than over
    // the same distance at its own height.
    const double farthest = std::min(
        scanner.range_max, std::sqrt(scanner.SamplesPerSteradian(0) / std::max(density, 1e-9)));
    const int cells =
        static_cast<int>(std::ceil(std::min(farthest + slack.distance, within) / kCell));
    const Eigen::Vector2i middle =
        Eigen::Vector2i(static_cast<int>(std::floor(centre.x() / kCell)),
                        static_cast<int>(std::floor(centre.y() / kCell))) -
        first_;
    const Eigen::Vector2i low = (middle.array() - cells).max(0).matrix();
    const Eigen::Vector2i high = (middle.array() + cells + 1).min(size_.array()).matrix();
    for (int y = low.y(); y < high.y(); ++y) {
      for (int x = low.x(); x < high.x(); ++x) {
        for (const float floor : At({x, y})) {
          for (const double height : heights) {
            const Eigen::Vector3d place((first_.x() + x + 0.5) * kCell,
                                        (first_.y() + y + 0.5) * kCell,
                                        static_cast<double>(floor) + height);
            if (!MeasuredFrom(place, instrument, centre, normal, density, slack)) continue;
            if (fn(place, instrument)) return true;
          }
        }
      }
    }
  }
  return false;
}

bool StandingReach::Has(const model::VoxelIndex& voxel, const model::SurfaceVoxel& surface,
                        double density) {
  if (floors_.empty()) return true;
  const model::VoxelIndex brick = model::Brick::Of(voxel);
  const Eigen::Vector3i bin = BinOf(surface.normal);
  const auto [it, fresh] =
      known_.try_emplace({model::KeyOf(brick), DirectionOf(bin), density}, false);
  if (fresh) {
    // Nearly all surface has a place nearby.
    const auto any = [&](double within) {
      return AnyPlace(CentreOfBrick(brick, voxel_size_), bin.cast<double>().normalized(), density,
                      heights_, within, [](const auto&, const auto&) { return true; });
    };
    it->second = any(kNearby) || any(std::numeric_limits<double>::infinity());
  }
  return it->second;
}

bool StandingReach::Sees(const model::VoxelIndex& voxel, const model::SurfaceVoxel& surface,
                         double density) {
  if (floors_.empty()) return true;
  const model::VoxelIndex brick = model::Brick::Of(voxel);
  const Eigen::Vector3i bin = BinOf(surface.normal);
  const model::VoxelIndex cube(voxel.x() >> 1, voxel.y() >> 1, voxel.z() >> 1);
  const auto [seen, unasked] =
      seen_.try_emplace({model::KeyOf(cube), DirectionOf(bin), density}, false);
  if (!unasked) return seen->second;
  const auto [it, fresh] = places_.try_emplace({model::KeyOf(brick), DirectionOf(bin), density});
  std::vector<Place>& places = it->second;
  if (fresh) {
    const std::array<double, 2> heights = {heights_.front(), heights_.back()};
    std::vector<Place> all;
    AnyPlace(CentreOfBrick(brick, voxel_size_), bin.cast<double>().normalized(), density, heights,
             std::numeric_limits<double>::infinity(),
             [&](const Eigen::Vector3d& at, const Instrument& instrument) {
               all.push_back({at, static_cast<size_t>(&instrument - instruments_.data())});
               return false;
             });
    const size_t count = std::min(all.size(), kMostPlaces);
    for (size_t i = 0; i < count; ++i) places.push_back(all[i * all.size() / count]);
  }
  const Eigen::Vector3d normal = surface.normal.cast<double>();
  const Eigen::Vector3d centroid = surface.centroid.cast<double>();
  // Where a ray to it would aim: else none does.
  const Eigen::Vector3d middle = voxel.cast<double>().array() + 0.5;
  const auto distance = std::find_if(
      model::kTargetDistances.begin(), model::kTargetDistances.end(),
      [&](double d) { return model_.Empty((middle + d * normal).array().floor().cast<int>()); });
  if (distance == model::kTargetDistances.end()) return false;
  const Eigen::Vector3d target = middle + *distance * normal;
  // Walks go through one brick after the other.
  const auto contents_of = [&](const model::VoxelIndex& of) -> const model::Brick* {
    const model::BrickPage* page = model_.Page(model::BrickPage::Of(of));
    return page == nullptr ? nullptr : page->Find(of);
  };
  model::VoxelIndex in = brick;
  const model::Brick* contents = contents_of(in);
  const auto free = [&](const model::VoxelIndex& v, double) {
    if (const model::VoxelIndex next = model::Brick::Of(v); next != in) {
      in = next;
      contents = contents_of(in);
    }
    if (contents == nullptr) return true;
    const model::VoxelState state = contents->state[model::Brick::LocalOf(v)];
    return state != model::VoxelState::kTrueSurface && state != model::VoxelState::kAbsorbed;
  };
  for (size_t i = 0; i < places.size(); ++i) {
    const Place place = places[i];
    if (!MeasuredFrom(place.at, instruments_[place.instrument], centroid, normal, density,
                      {0.5 * kCell, 0, 1})) {
      continue;
    }
    if (!visibility::WalkVoxels(target, place.at / voxel_size_, free)) continue;
    std::swap(places[i], places.front());
    return seen->second = true;
  }
  return false;
}

}  // namespace vantage::planning
