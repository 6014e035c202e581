// The attributes of a brick's voxels that have area, packed.
#ifndef VANTAGE_CORE_MODEL_VIEW_SURFACE_VOXELS_H_
#define VANTAGE_CORE_MODEL_VIEW_SURFACE_VOXELS_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/model/view/value_iterator.h"

namespace vantage::model {

// Attributes of a voxel that has area.
struct SurfaceVoxel {
  Eigen::Vector3f centroid;  // m, model frame: of the samples in it; else of the interpolated
                             // surface; false surface: the voxel's centre
  Eigen::Vector3f normal;    // unit, towards the empty side
  float area = 0;            // m^2: true h^2 / (|nx|+|ny|+|nz|), false h^2 / max |n_i|
  float density = 0;         // q, samples / m^2 of the best scan so far; 0 on false surface
  uint32_t samples = 0;      // measured samples in it; 0 where only interpolated, or false
  uint8_t missed = 0;        // scans that should have measured it and did not
  uint8_t spread = 0;        // by how much that scan sampled the centroid more densely than the
                             // worst corner, in 1/256 of `density`, which is the worst corner's
  bool ambiguous = false;    // one voxel thick with empty space on both sides: normal is a guess
  bool given_up = false;     // missed by two scans or more: no longer keeps a job open
};

// A list of them, each as it was added, to the bit. One takes 44 bytes, or 4 where all but the
// place follows from which of the 26 voxels around are empty, as it does of false surface: the
// normal is the sum of the offsets of these, normalised.
class SurfaceVoxels {
 public:
  SurfaceVoxels() = default;  // of a brick of which AddFalse() knows nothing
  // `brick`: coordinates, in bricks; `voxel` in m.
  SurfaceVoxels(const Eigen::Vector3i& brick, double voxel) : brick_(brick), voxel_(voxel) {}

  size_t size() const { return packed_.size(); }
  bool empty() const { return packed_.empty(); }
  SurfaceVoxel operator[](size_t i) const {
    const uint32_t packed = packed_[i];
    return (packed & kPacked) != 0 ? Unpacked(packed) : stored_[packed];
  }
  // Of one that was added by push_back(), as true surface is.
  const SurfaceVoxel& Stored(size_t i) const { return stored_[packed_[i]]; }

  void reserve(size_t size) { packed_.reserve(size); }
  void push_back(const SurfaceVoxel& voxel);
  // The same of false surface, at a place in the brick: x + 8 (y + 8 z).
  void AddFalse(const SurfaceVoxel& voxel, int local);
  void shrink_to_fit();
  void clear();

  // True when all bits are the same; -0 differs from 0.
  bool operator==(const SurfaceVoxels& other) const;

  size_t bytes() const {  // that it holds on the heap
    return packed_.capacity() * sizeof(uint32_t) + stored_.capacity() * sizeof(SurfaceVoxel);
  }

  using Iterator = ValueIterator<SurfaceVoxels, SurfaceVoxel>;
  Iterator begin() const { return {*this, 0}; }
  Iterator end() const { return {*this, size()}; }

 private:
  // Of a number in packed_: without the highest bit it is a place in stored_.
  static constexpr uint32_t kPacked = uint32_t{1} << 31;

  SurfaceVoxel Unpacked(uint32_t packed) const;

  Eigen::Vector3i brick_ = Eigen::Vector3i::Zero();
  double voxel_ = 0;
  std::vector<uint32_t> packed_;
  std::vector<SurfaceVoxel> stored_;
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_VIEW_SURFACE_VOXELS_H_
