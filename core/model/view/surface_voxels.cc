#include "core/model/view/surface_voxels.h"

#include <array>
#include <cstring>
#include <memory>
#include <optional>

namespace vantage::model {
namespace {

// Fields of a packed voxel, from the lowest bit on: its place in the brick (9 bits), the sum of the
// offsets of the empty voxels around it (13), how often it was missed (7), and two flags.
constexpr int kSumBit = 9;
constexpr int kMissedBit = 22;
constexpr int kAmbiguousBit = 29;
constexpr int kGivenUpBit = 30;
constexpr uint32_t kLocalMask = 511;
constexpr uint32_t kSumMask = 8191;
constexpr uint32_t kMissedMask = 127;

// Nine of the 26 lie on each side.
constexpr int kMost = 9;
constexpr int kSide = 2 * kMost + 1;

constexpr uint32_t NumberOf(int x, int y, int z) {
  return static_cast<uint32_t>(x + kMost + kSide * (y + kMost + kSide * (z + kMost)));
}
static_assert(NumberOf(kMost, kMost, kMost) <= kSumMask);

using Normals = std::array<Eigen::Vector3f, NumberOf(kMost, kMost, kMost) + 1>;

// The normal of each sum, as a merge computes it.
const Normals& NormalsOfSums() {
  static const Normals* const all = [] {
    auto normals = std::make_unique<Normals>();
    for (int z = -kMost; z <= kMost; ++z) {
      for (int y = -kMost; y <= kMost; ++y) {
        for (int x = -kMost; x <= kMost; ++x) {
          const Eigen::Vector3f sum(static_cast<float>(x), static_cast<float>(y),
                                    static_cast<float>(z));
          (*normals)[NumberOf(x, y, z)] = sum.normalized();
        }
      }
    }
    return normals.release();
  }();
  return *all;
}

template <typename T>
bool SameBits(const T& a, const T& b) {
  return std::memcmp(static_cast<const void*>(&a), static_cast<const void*>(&b), sizeof(T)) == 0;
}

// The smallest sum of which it is the normal.
std::optional<uint32_t> SumOf(const Eigen::Vector3f& normal) {
  if (!normal.allFinite()) return std::nullopt;
  const Normals& normals = NormalsOfSums();
  const float largest = normal.lpNorm<Eigen::Infinity>();
  // Of a unit vector it is 0.57 at least. What a damaged file has may be as small as there is.
  if (largest < 0.5f) return std::nullopt;
  for (int most = 1; most <= kMost; ++most) {
    // To the nearest whole number: shifted, so that none is negative where it is cut.
    const Eigen::Array3f shifted =
        normal.array() * (static_cast<float>(most) / largest) + (kMost + 0.5f);
    const Eigen::Array3i sum = shifted.cast<int>() - kMost;
    const uint32_t number = NumberOf(sum.x(), sum.y(), sum.z());
    if (SameBits(normals[number], normal)) return number;
  }
  return std::nullopt;
}

}  // namespace

SurfaceVoxel SurfaceVoxels::Unpacked(uint32_t packed) const {
  const auto local = static_cast<int>(packed & kLocalMask);
  const Eigen::Vector3i place(local & 7, local >> 3 & 7, local >> 6);
  const Eigen::Vector3d centre = ((brick_ * 8 + place).cast<double>().array() + 0.5) * voxel_;
  SurfaceVoxel voxel;
  voxel.centroid = centre.cast<float>();
  voxel.normal = NormalsOfSums()[packed >> kSumBit & kSumMask];
  voxel.area = static_cast<float>(voxel_ * voxel_) / voxel.normal.lpNorm<Eigen::Infinity>();
  voxel.missed = static_cast<uint8_t>(packed >> kMissedBit & kMissedMask);
  voxel.ambiguous = (packed >> kAmbiguousBit & 1) != 0;
  voxel.given_up = (packed >> kGivenUpBit & 1) != 0;
  return voxel;
}

void SurfaceVoxels::push_back(const SurfaceVoxel& voxel) {
  packed_.push_back(static_cast<uint32_t>(stored_.size()));
  stored_.push_back(voxel);
}

void SurfaceVoxels::AddFalse(const SurfaceVoxel& voxel, int local) {
  const std::optional<uint32_t> sum = SumOf(voxel.normal);
  if (sum.has_value() && voxel.missed <= kMissedMask) {
    const uint32_t packed = kPacked | static_cast<uint32_t>(local) | *sum << kSumBit |
                            static_cast<uint32_t>(voxel.missed) << kMissedBit |
                            static_cast<uint32_t>(voxel.ambiguous) << kAmbiguousBit |
                            static_cast<uint32_t>(voxel.given_up) << kGivenUpBit;
    if (SameBits(Unpacked(packed), voxel)) {
      packed_.push_back(packed);
      return;
    }
  }
  push_back(voxel);
}

void SurfaceVoxels::shrink_to_fit() {
  packed_.shrink_to_fit();
  stored_.shrink_to_fit();
}

void SurfaceVoxels::clear() {
  packed_.clear();
  stored_.clear();
}

bool SurfaceVoxels::operator==(const SurfaceVoxels& other) const {
  // The members have no gaps between them, so comparing the bytes compares all of them.
  static_assert(sizeof(SurfaceVoxel) == 2 * sizeof(Eigen::Vector3f) + 2 * sizeof(float) + 8);
  if (size() != other.size()) return false;
  if (brick_ == other.brick_ && voxel_ == other.voxel_ && packed_ == other.packed_) {
    return stored_.empty() || std::memcmp(static_cast<const void*>(stored_.data()),
                                          static_cast<const void*>(other.stored_.data()),
                                          stored_.size() * sizeof(SurfaceVoxel)) == 0;
  }
  for (size_t i = 0; i < size(); ++i) {
    if (!SameBits((*this)[i], other[i])) return false;
  }
  return true;
}

}  // namespace vantage::model
