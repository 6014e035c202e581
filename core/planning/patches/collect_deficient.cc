#include "core/planning/patches/collect_deficient.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>

#include "core/model/view/voxel.h"
#include "core/planning/patches/cell_table.h"
#include "core/planning/patches/skyline.h"
#include "core/planning/patches/space_behind.h"
#include "core/visibility/surface_walk.h"

namespace vantage::planning {
namespace {

// Turns deficient voxels into cells, with all that the model says of the space around them.
class CellMaker {
 public:
  CellMaker(const model::PlanningView& model, const PlanningConfig& config, const Region& told,
            Skyline skyline, std::vector<Eigen::Vector3f>& dropouts)
      : model_(model),
        config_(config),
        told_(told),
        skyline_(std::move(skyline)),
        dropouts_(dropouts) {}

  bool InSky(const model::VoxelIndex& v, model::VoxelState state,
             const model::SurfaceVoxel& surface) {
    return model::IsFalseSurface(state) && skyline_.InSky(v, surface.normal);
  }

  // A cell of the voxel, with this area (m2) and density (samples / m2).
  DeficientCell Make(const model::VoxelIndex& v, model::VoxelState state,
                     const model::SurfaceVoxel& surface, const Requirement& required, float area,
                     float density) {
    const std::span<const model::Dropout> dropouts = model_.Dropouts(v);
    const bool measured = state == model::VoxelState::kTrueSurface;
    DeficientCell cell{v,
                       model::KindOf(state),
                       surface.centroid,
                       surface.normal,
                       area,
                       density,
                       1 + static_cast<float>(surface.spread) / 256,
                       static_cast<float>(required.density),
                       Enough(v, state, surface, required.density),
                       static_cast<float>(SuccessProbability(surface.missed)),
                       static_cast<float>(required.worth),
                       measured ? SkylineSines() : skyline_.Around(v),
                       static_cast<uint32_t>(dropouts_.size()),
                       static_cast<uint32_t>(dropouts.size())};
    for (const model::Dropout& dropout : dropouts) dropouts_.push_back(dropout.from);
    return cell;
  }

 private:
  float Enough(const model::VoxelIndex& v, model::VoxelState state,
               const model::SurfaceVoxel& surface, double density) const {
    // Rays went into a hole and none came back, so no depth behind it counts.
    const bool opening =
        state == model::VoxelState::kFalseOcclusion || state == model::VoxelState::kFalseImage;
    if (config_.unknown_depth <= 0 || !opening || told_.contains(surface.centroid.cast<double>())) {
      return static_cast<float>(density);
    }
    const double depth = DepthBehind(model_, v, surface.normal, config_.unknown_depth);
    return static_cast<float>(DensityWorthHaving(density, depth));
  }

  const model::PlanningView& model_;
  const PlanningConfig& config_;
  const Region& told_;
  Skyline skyline_;
  std::vector<Eigen::Vector3f>& dropouts_;
};

float DensityOf(model::VoxelState state, const model::SurfaceVoxel& surface) {
  return model::IsFalseSurface(state) ? 0.0f : surface.density;
}

// Of the six axis directions, that which a normal is nearest to.
uint32_t WayOf(const Eigen::Vector3f& normal) {
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return 2 * static_cast<uint32_t>(axis) + (normal[axis] < 0 ? 1 : 0);
}

// The deficient voxels of a brick that stand for themselves or are told together.
class CoarseBrick {
 public:
  explicit CoarseBrick(int shift) : shift_(shift) {}

  void Add(const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface,
           const Requirement& required, bool alone) {
    uint32_t key =
        static_cast<uint32_t>(CoarseCellTable::CubeIn(v, shift_));  // the first to sort by
    key = key << 2 | static_cast<uint32_t>(model::KindOf(state));
    key = key << 3 | WayOf(surface.normal);
    const uint32_t region =
        required.region.has_value() ? static_cast<uint32_t>(*required.region) + 1 : 0;
    voxels_.push_back({{key, region, alone ? static_cast<uint32_t>(voxels_.size()) + 1 : 0},
                       v,
                       state,
                       surface,
                       required});
  }

  // Adds the cells to `deficient`, cube by cube, and is empty again.
  void Flush(CellMaker& maker, DeficientCells::Builder& deficient) {
    std::stable_sort(voxels_.begin(), voxels_.end(),
                     [](const Voxel& a, const Voxel& b) { return a.key < b.key; });
    for (auto begin = voxels_.begin(); begin != voxels_.end();) {
      const auto end = std::find_if(begin, voxels_.end(),
                                    [&](const Voxel& other) { return other.key != begin->key; });
      AddGroup({begin, end}, maker, deficient);
      begin = end;
    }
    voxels_.clear();
  }

 private:
  struct Voxel {
    std::array<uint32_t, 3> key;  // cube, kind and way; region; where alone
    model::VoxelIndex at;
    model::VoxelState state;
    model::SurfaceVoxel surface;
    Requirement required;
  };

  static void AddGroup(std::span<const Voxel> group, CellMaker& maker,
                       DeficientCells::Builder& deficient) {
    float area = 0;
    float samples = 0;
    Eigen::Vector3f mean = Eigen::Vector3f::Zero();
    for (const Voxel& voxel : group) {
      area += voxel.surface.area;
      samples += voxel.surface.area * DensityOf(voxel.state, voxel.surface);
      mean += voxel.surface.area * voxel.surface.centroid;
    }
    mean /= area;
    const Voxel* middle = nullptr;
    float nearest = std::numeric_limits<float>::infinity();
    for (const Voxel& voxel : group) {
      const float distance = (voxel.surface.centroid - mean).squaredNorm();
      if (distance >= nearest) continue;
      nearest = distance;
      middle = &voxel;
    }
    deficient.Add(maker.Make(middle->at, middle->state, middle->surface, middle->required, area,
                             samples / area));
  }

  int shift_;
  std::vector<Voxel> voxels_;
};

}  // namespace

std::optional<Requirement> Lacking(const PlanningConfig& config, const model::PlanningView& model,
                                   const model::VoxelIndex& voxel,
                                   const model::SurfaceVoxel& surface) {
  if (surface.given_up || !(surface.area > 0)) return std::nullopt;
  const std::optional<Requirement> required = config.RequiredAt(model.Centre(voxel));
  if (!required.has_value() || surface.density >= static_cast<float>(required->density)) {
    return std::nullopt;
  }
  return required;
}

double SuccessProbability(int missed) { return 2.0 / (2 + missed); }

double CellsOfCubes(size_t deficient, int shift) {
  // A plane has a quarter of the cubes in edges twice as long, but a cube that several surfaces
  // pass has a cell of each. Measured: a half to two thirds less for each doubling; of a hall's 16
  // million 0.14 are left in edges of four voxels, and 0.058 in edges of eight.
  constexpr double kLeft = 0.38;
  return static_cast<double>(deficient) * std::pow(kLeft, shift);
}

int CubeShift(size_t deficient, size_t max_cells) {
  constexpr int kWholeBrick = 3;
  int shift = 0;
  while (shift < kWholeBrick && CellsOfCubes(deficient, shift) > static_cast<double>(max_cells)) {
    ++shift;
  }
  return shift;
}

std::optional<int> CubeShiftOf(const model::PlanningView& model, const PlanningConfig& config,
                               const parallel::Cancellation& cancelled) {
  if (model.SurfaceCount() <= config.max_cells) return 0;
  size_t deficient = 0;
  const auto count = [&](const model::VoxelIndex& v, model::VoxelState /*state*/,
                         const model::SurfaceVoxel& surface) {
    deficient += Lacking(config, model, v, surface).has_value() ? 1 : 0;
  };
  if (!visibility::WalkSurface(model, cancelled, count)) return std::nullopt;
  return CubeShift(deficient, config.max_cells);
}

std::optional<DeficientCells> CollectDeficient(const model::PlanningView& model,
                                               const PlanningConfig& config, int shift,
                                               const Region& told,
                                               std::vector<Eigen::Vector3f>& dropouts,
                                               const parallel::Cancellation& cancelled) {
  std::optional<Skyline> skyline = Skyline::Of(model, cancelled);
  if (!skyline) return std::nullopt;
  CellMaker maker(model, config, told, *std::move(skyline), dropouts);
  DeficientCells::Builder deficient(model.voxel_size());
  CoarseBrick coarse(shift);
  model::VoxelIndex brick = model::VoxelIndex::Zero();
  const auto collect = [&](const model::VoxelIndex& v, model::VoxelState state,
                           const model::SurfaceVoxel& surface) {
    const std::optional<Requirement> required = Lacking(config, model, v, surface);
    if (!required.has_value() || maker.InSky(v, state, surface)) return;
    if (shift == 0) {
      deficient.Add(
          maker.Make(v, state, surface, *required, surface.area, DensityOf(state, surface)));
      return;
    }
    if (model::Brick::Of(v) != brick) coarse.Flush(maker, deficient);
    brick = model::Brick::Of(v);
    coarse.Add(v, state, surface, *required, !model.Dropouts(v).empty());
  };
  if (!visibility::WalkSurface(model, cancelled, collect)) return std::nullopt;
  coarse.Flush(maker, deficient);
  return std::move(deficient).Build();
}

}  // namespace vantage::planning
