#include "tests/support/closed_form_view.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <utility>

namespace vantage::test_support {
namespace {

enum class Matter : uint8_t { kUnknown, kEmpty, kSolid };

// Dense matter of the extent with a margin of one voxel.
class MatterGrid {
 public:
  explicit MatterGrid(const ClosedFormScene& scene) {
    min_ = (scene.extent.min() / scene.voxel).array().floor().cast<int>() - 1;
    max_ = (scene.extent.max() / scene.voxel).array().ceil().cast<int>() + 1;
    size_ = max_ - min_;
    matter_.assign(static_cast<size_t>(size_.prod()), Matter::kUnknown);
    for (int z = min_.z() + 1; z < max_.z() - 1; ++z) {
      for (int y = min_.y() + 1; y < max_.y() - 1; ++y) {
        for (int x = min_.x() + 1; x < max_.x() - 1; ++x) {
          const Eigen::Vector3d p = (Eigen::Vector3d(x, y, z).array() + 0.5) * scene.voxel;
          Matter& matter = matter_[Index({x, y, z})];
          if (scene.solid(p)) {
            matter = Matter::kSolid;
          } else if (scene.known(p)) {
            matter = Matter::kEmpty;
          }
        }
      }
    }
  }
  const model::VoxelIndex& min() const { return min_; }
  const model::VoxelIndex& max() const { return max_; }
  Matter At(const model::VoxelIndex& v) const {
    if ((v.array() < min_.array()).any() || (v.array() >= max_.array()).any()) {
      return Matter::kUnknown;
    }
    return matter_[Index(v)];
  }

 private:
  size_t Index(const model::VoxelIndex& v) const {
    const model::VoxelIndex d = v - min_;
    return static_cast<size_t>(d.x() + size_.x() * (d.y() + size_.y() * d.z()));
  }
  model::VoxelIndex min_, max_, size_;
  std::vector<Matter> matter_;
};

bool TouchesEmpty(const MatterGrid& grid, const model::VoxelIndex& v) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      model::VoxelIndex to = v;
      to[axis] += side;
      if (grid.At(to) == Matter::kEmpty) return true;
    }
  }
  return false;
}

Eigen::Vector3f NormalOf(const MatterGrid& grid, const model::VoxelIndex& v) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  Eigen::Vector3f any = Eigen::Vector3f::UnitZ();
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (grid.At(v + model::VoxelIndex(dx, dy, dz)) != Matter::kEmpty) continue;
        const Eigen::Vector3f d(static_cast<float>(dx), static_cast<float>(dy),
                                static_cast<float>(dz));
        sum += d;
        if (std::abs(dx) + std::abs(dy) + std::abs(dz) == 1) any = d;
      }
    }
  }
  return sum.norm() > 1e-3f ? Eigen::Vector3f(sum.normalized()) : any;
}

}  // namespace

model::Station MakeStation(const Eigen::Vector3d& position) {
  model::Station station;
  station.position = position;
  station.floor_height = 0;
  station.floor_found = true;
  station.clearance = 0.35;
  return station;
}

model::PlanningView BuildView(const ClosedFormScene& scene) {
  const MatterGrid grid(scene);
  const auto h = static_cast<float>(scene.voxel);
  std::vector<model::BrickAt> bricks;
  const model::VoxelIndex first = model::Brick::Of(grid.min());
  const model::VoxelIndex last = model::Brick::Of(grid.max());
  for (int bz = first.z(); bz <= last.z(); ++bz) {
    for (int by = first.y(); by <= last.y(); ++by) {
      for (int bx = first.x(); bx <= last.x(); ++bx) {
        auto brick = std::make_shared<model::Brick>();
        bool any = false;
        for (int local = 0; local < model::Brick::kVoxels; ++local) {
          const model::VoxelIndex v = model::PlanningView::Global({bx, by, bz}, local);
          const Matter matter = grid.At(v);
          auto& state = brick->state[static_cast<size_t>(local)];
          if (matter == Matter::kEmpty) {
            state = model::VoxelState::kEmpty;
            any = true;
            continue;
          }
          if (!TouchesEmpty(grid, v)) continue;
          const Eigen::Vector3d p = (v.cast<double>().array() + 0.5) * scene.voxel;
          state = matter == Matter::kSolid ? model::VoxelState::kTrueSurface : scene.false_kind(p);
          model::SurfaceVoxel surface;
          surface.centroid = p.cast<float>();
          surface.normal = NormalOf(grid, v);
          const Eigen::Array3f n = surface.normal.array().abs();
          if (matter == Matter::kSolid) {
            surface.area = h * h / n.sum();
            surface.density = static_cast<float>(scene.density(p));
            surface.samples = 10;
          } else {
            surface.area = h * h / n.maxCoeff();
          }
          brick->surface_mask[static_cast<size_t>(local / 64)] |= uint64_t{1} << (local % 64);
          brick->surface.push_back(surface);
          any = true;
        }
        if (any) bricks.push_back({{bx, by, bz}, std::move(brick)});
      }
    }
  }
  return model::PlanningView(scene.voxel, 1, std::move(bricks), scene.stations);
}

ClosedFormScene FurnishedRoom(uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1.0p-53;
  };
  const Eigen::AlignedBox3d room(Eigen::Vector3d::Zero(), Eigen::Vector3d(6, 5, 2.7));
  std::vector<Eigen::AlignedBox3d> boxes;
  while (boxes.size() < 6) {
    // Braces: drawn from left to right, so that every compiler builds the same room.
    const Eigen::Vector3d size{uniform(0.3, 0.9), uniform(0.3, 0.9), uniform(0.4, 2.0)};
    const Eigen::Vector3d low{uniform(0, 5), uniform(0, 4), 0};
    const Eigen::AlignedBox3d box(low, low + size);
    if (box.exteriorDistance(Eigen::Vector3d(1.5, 1.5, low.z())) > 0.8) boxes.push_back(box);
  }
  const Eigen::AlignedBox3d screen(Eigen::Vector3d(4.2, 0, 0), Eigen::Vector3d(4.3, 3.4, 2.7));
  ClosedFormScene scene;
  scene.extent = Eigen::AlignedBox3d(room.min().array() - 0.1, room.max().array() + 0.1);
  scene.solid = [=](const Eigen::Vector3d& p) {
    if (!room.contains(p) || screen.contains(p)) return true;
    return std::any_of(boxes.begin(), boxes.end(),
                       [&](const Eigen::AlignedBox3d& box) { return box.contains(p); });
  };
  // Behind the screen, what a line from the station past its edge does not reach.
  scene.known = [](const Eigen::Vector3d& p) {
    return p.x() < 4.3 || (p.y() - 1.5) * (4.3 - 1.5) > (3.4 - 1.5) * (p.x() - 1.5);
  };
  scene.density = [](const Eigen::Vector3d& p) {
    return 6000 / (Eigen::Vector3d(1.5, 1.5, 1.5) - p).squaredNorm();
  };
  scene.stations = {MakeStation(Eigen::Vector3d(1.5, 1.5, 1.5))};
  return scene;
}

}  // namespace vantage::test_support
