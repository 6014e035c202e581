// Sums over the surface points in a voxel, and lists of them as layers keep them.
#ifndef VANTAGE_CORE_MODEL_CARVE_SURFACE_SUMS_H_
#define VANTAGE_CORE_MODEL_CARVE_SURFACE_SUMS_H_

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

namespace vantage::model {

// Sums over the surface points in a voxel, in integers so that the order of adding never shows.
// Positions are offsets from the voxel's lowest corner in 1/1024 of its size.
struct SurfaceSums {
  static constexpr int kUnits = 1024;

  uint32_t samples = 0;  // measured points
  uint32_t points = 0;   // measured and interpolated ones
  std::array<uint64_t, 3> sample_sum{};
  std::array<uint64_t, 3> point_sum{};
  std::array<uint64_t, 6> product_sum{};  // of points: xx, xy, xz, yy, yz, zz

  void Add(const std::array<uint32_t, 3>& offset, bool measured) {
    ++points;
    for (size_t i = 0; i < 3; ++i) point_sum[i] += offset[i];
    if (measured) {
      ++samples;
      for (size_t i = 0; i < 3; ++i) sample_sum[i] += offset[i];
    }
    size_t k = 0;
    for (size_t i = 0; i < 3; ++i) {
      for (size_t j = i; j < 3; ++j) product_sum[k++] += uint64_t{offset[i]} * offset[j];
    }
  }
  void Add(const SurfaceSums& other) {
    samples += other.samples;
    points += other.points;
    for (size_t i = 0; i < 3; ++i) sample_sum[i] += other.sample_sum[i];
    for (size_t i = 0; i < 3; ++i) point_sum[i] += other.point_sum[i];
    for (size_t i = 0; i < 6; ++i) product_sum[i] += other.product_sum[i];
  }
};

// A list of sums, as they are, in as many bytes each as the largest of the list need: a voxel
// mostly holds a few dozen points, and its sums then take 38 bytes instead of 104.
class PackedSums {
 public:
  // Reads a list, which outlives it and does not change meanwhile.
  class View;

  PackedSums() = default;  // no sums
  explicit PackedSums(std::span<const SurfaceSums> sums);

  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  SurfaceSums operator[](size_t i) const;
  View view() const;
  std::vector<SurfaceSums> Unpacked() const;
  void push_back(const SurfaceSums& sums);

  size_t bytes() const { return bytes_.capacity(); }  // that it holds on the heap

 private:
  enum class Width : uint8_t { kSmall, kMedium, kWide };

  // Sums as they are stored: the first kBytes of such a struct.
  template <typename Count, typename Sum, typename Product>
  struct Stored {
    static constexpr size_t kBytes = 6 * sizeof(Product) + 6 * sizeof(Sum) + 2 * sizeof(Count);

    Stored() = default;
    explicit Stored(const SurfaceSums& sums);
    SurfaceSums Unpacked() const {
      SurfaceSums sums;
      sums.samples = samples;
      sums.points = points;
      for (size_t i = 0; i < 3; ++i) sums.sample_sum[i] = sample_sum[i];
      for (size_t i = 0; i < 3; ++i) sums.point_sum[i] = point_sum[i];
      for (size_t i = 0; i < 6; ++i) sums.product_sum[i] = product_sum[i];
      return sums;
    }

    // The widest first, so that there are no gaps.
    std::array<Product, 6> product_sum;
    std::array<Sum, 3> sample_sum;
    std::array<Sum, 3> point_sum;
    Count samples;
    Count points;
  };
  using Small = Stored<uint8_t, uint16_t, uint32_t>;    // of up to 64 points
  using Medium = Stored<uint16_t, uint32_t, uint32_t>;  // of up to 4,104
  using Wide = Stored<uint32_t, uint64_t, uint64_t>;

  static size_t BytesOf(Width width);
  static Width WidthOf(const SurfaceSums& sums);
  static void Store(const SurfaceSums& sums, Width width, std::byte* to);

  std::vector<std::byte> bytes_;
  size_t size_ = 0;
  Width width_ = Width::kSmall;
};

class PackedSums::View {
 public:
  View() = default;  // no sums

  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  SurfaceSums operator[](size_t i) const {
    switch (width_) {
      case Width::kSmall:
        return Load<Small>(i).Unpacked();
      case Width::kMedium:
        return Load<Medium>(i).Unpacked();
      case Width::kWide:
        break;
    }
    return Load<Wide>(i).Unpacked();
  }

 private:
  friend class PackedSums;
  View(const std::byte* bytes, size_t size, Width width)
      : bytes_(bytes), size_(size), width_(width) {}

  template <typename As>
  As Load(size_t i) const {
    As stored;
    std::memcpy(static_cast<void*>(&stored), bytes_ + i * As::kBytes, As::kBytes);
    return stored;
  }

  const std::byte* bytes_ = nullptr;
  size_t size_ = 0;
  Width width_ = Width::kSmall;
};

inline PackedSums::View PackedSums::view() const { return {bytes_.data(), size_, width_}; }
inline SurfaceSums PackedSums::operator[](size_t i) const { return view()[i]; }

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_CARVE_SURFACE_SUMS_H_
