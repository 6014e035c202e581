// The deficient voxels of a model, packed: a hall has millions.
#ifndef VANTAGE_CORE_PLANNING_PATCHES_DEFICIENT_CELLS_H_
#define VANTAGE_CORE_PLANNING_PATCHES_DEFICIENT_CELLS_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/container/flat_hash_set.h"
#include "core/model/view/planning_view.h"
#include "core/model/view/value_iterator.h"
#include "core/planning/patches/skyline.h"

namespace vantage::planning {

// A deficient voxel: false surface, or true surface below the density that is required there, that
// is not given up, lies where surface counts and not in the sky.
struct DeficientCell {
  model::VoxelIndex voxel = model::VoxelIndex::Zero();
  model::SurfaceKind kind = model::SurfaceKind::kTrue;
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  // m, the model's centroid of it
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();    // unit, towards the empty side
  float area = 0;                                      // m^2
  float density = 0;                                   // q, samples / m^2
  float spread = 1;      // density at the voxel's middle over q, in the scan that recorded q
  float required = 0;    // samples / m^2: D there
  float enough = 0;      // samples / m^2: D, or more where unknown space lies behind it
  float success = 1;     // probability that measuring it works, from earlier attempts
  float worth = 1;       // what a sample counts: Requirement::worth
  SkylineSines skyline;  // what is to be expected behind it, where it is under the open sky
  // Places from which rays to it dropped out: [dropouts, dropouts + dropout_count) of
  // PatchSet::dropouts.
  uint32_t dropouts = 0;
  uint32_t dropout_count = 0;
  bool expected = false;  // it is not known, but expected (algorithm.md section 7E)
};

// A list of cells, each as it was added, to the bit. A cell takes 12 bytes: its voxel, and a number
// for the rest, which false surface has in common with other false surface. Position, normal, area
// and density of a cell that does not lie at its voxel's centre take 36 more.
class DeficientCells {
 public:
  class Builder;

  DeficientCells() = default;  // no cells

  size_t size() const { return cells_.size(); }
  bool empty() const { return cells_.empty(); }
  DeficientCell operator[](size_t i) const;
  // Parts of it, for those who need no more.
  model::VoxelIndex Voxel(size_t i) const {
    return model::PlanningView::Global(bricks_[cells_[i].brick],
                                       static_cast<int>(cells_[i].place & kLocal));
  }
  model::SurfaceKind Kind(size_t i) const {
    return static_cast<model::SurfaceKind>(cells_[i].place >> kKindBit & kKind);
  }
  Eigen::Vector3f Position(size_t i) const {
    return OwnShape(i) ? own_[cells_[i].shape].position : Centre(Voxel(i), voxel_);
  }
  const Eigen::Vector3f& Normal(size_t i) const {
    return OwnShape(i) ? own_[cells_[i].shape].normal : shared_[cells_[i].shape].normal;
  }
  float Area(size_t i) const {
    return OwnShape(i) ? own_[cells_[i].shape].area : shared_[cells_[i].shape].area;
  }
  bool Expected(size_t i) const { return (cells_[i].place & kExpected) != 0; }

  // Puts the cells in an order: at `k` the one that was at order[k]. `order` is used up.
  void Reorder(std::vector<uint32_t>& order);
  // The cell is expected and not known.
  void SetExpected(size_t i);

  // That it holds on the heap.
  size_t bytes() const;

  using Iterator = model::ValueIterator<DeficientCells, DeficientCell>;
  Iterator begin() const { return {*this, 0}; }
  Iterator end() const { return {*this, size()}; }

 private:
  // Of `Packed::place`: the voxel's place in its brick, the kind, whether `shape` counts own_, and
  // whether it is expected.
  static constexpr uint32_t kLocal = model::Brick::kVoxels - 1;
  static constexpr int kKindBit = 9;
  static constexpr uint32_t kKind = 3;
  static constexpr uint32_t kOwn = 1 << 11;
  static constexpr uint32_t kExpected = 1 << 12;

  struct Packed {
    uint32_t brick = 0;  // bricks_
    uint32_t place = 0;
    uint32_t shape = 0;  // shared_ or own_
  };
  // What many cells have in common. No gaps between the members: it is compared byte by byte.
  struct Shared {
    Eigen::Vector3f normal;  // zero, like area and density, where cells have their own
    float area = 0;
    float density = 0;
    float spread = 0;
    float required = 0;
    float enough = 0;
    float success = 0;
    float worth = 0;
    SkylineSines skyline;
    uint32_t dropouts = 0;
    uint32_t dropout_count = 0;
  };
  static_assert(sizeof(Shared) == 10 * sizeof(float) + sizeof(SkylineSines) + 8);
  struct Own {
    Eigen::Vector3f position;
    Eigen::Vector3f normal;
    float area = 0;
    float density = 0;
    uint32_t shared = 0;
  };

  static Eigen::Vector3f Centre(const model::VoxelIndex& voxel, double size) {
    const Eigen::Vector3d centre = (voxel.cast<double>().array() + 0.5) * size;
    return centre.cast<float>();
  }
  bool OwnShape(size_t i) const { return (cells_[i].place & kOwn) != 0; }

  double voxel_ = 0;  // m
  std::vector<model::VoxelIndex> bricks_;
  std::vector<Packed> cells_;
  std::vector<Shared> shared_;
  std::vector<Own> own_;
};

// Makes a list, cell by cell; best those of a brick side by side.
class DeficientCells::Builder {
 public:
  explicit Builder(double voxel);  // m, the edge of a voxel
  Builder(const Builder&) = delete;
  Builder& operator=(const Builder&) = delete;

  void Add(const DeficientCell& cell);
  DeficientCells Build() &&;

 private:
  // Numbers of shared parts, by what they hold.
  struct Hash {
    using is_transparent = void;
    const std::vector<Shared>* all;
    size_t operator()(const Shared& shared) const;
    size_t operator()(uint32_t i) const { return (*this)((*all)[i]); }
  };
  struct Equal {
    using is_transparent = void;
    const std::vector<Shared>* all;
    bool operator()(uint32_t a, uint32_t b) const { return a == b; }
    bool operator()(uint32_t a, const Shared& b) const;
    bool operator()(const Shared& a, uint32_t b) const { return (*this)(b, a); }
  };
  uint32_t NumberOf(const Shared& shared);

  DeficientCells made_;
  absl::flat_hash_set<uint32_t, Hash, Equal> numbers_;
  uint32_t last_ = 0;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PATCHES_DEFICIENT_CELLS_H_
