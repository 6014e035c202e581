#include "core/model/carve/surface_sums.h"

#include <algorithm>
#include <limits>

namespace vantage::model {

template <typename Count, typename Sum, typename Product>
PackedSums::Stored<Count, Sum, Product>::Stored(const SurfaceSums& sums)
    : samples(static_cast<Count>(sums.samples)), points(static_cast<Count>(sums.points)) {
  for (size_t i = 0; i < 3; ++i) sample_sum[i] = static_cast<Sum>(sums.sample_sum[i]);
  for (size_t i = 0; i < 3; ++i) point_sum[i] = static_cast<Sum>(sums.point_sum[i]);
  for (size_t i = 0; i < 6; ++i) product_sum[i] = static_cast<Product>(sums.product_sum[i]);
}

PackedSums::PackedSums(std::span<const SurfaceSums> sums) : size_(sums.size()) {
  for (const SurfaceSums& each : sums) width_ = std::max(width_, WidthOf(each));
  const size_t bytes = BytesOf(width_);
  bytes_.resize(size_ * bytes);
  for (size_t i = 0; i < size_; ++i) Store(sums[i], width_, bytes_.data() + i * bytes);
}

std::vector<SurfaceSums> PackedSums::Unpacked() const {
  std::vector<SurfaceSums> sums;
  sums.reserve(size_);
  for (size_t i = 0; i < size_; ++i) sums.push_back((*this)[i]);
  return sums;
}

void PackedSums::push_back(const SurfaceSums& sums) {
  if (WidthOf(sums) > width_) {
    std::vector<SurfaceSums> all = Unpacked();
    all.push_back(sums);
    *this = PackedSums(all);
    return;
  }
  const size_t bytes = BytesOf(width_);
  bytes_.resize((size_ + 1) * bytes);
  Store(sums, width_, bytes_.data() + size_ * bytes);
  ++size_;
}

size_t PackedSums::BytesOf(Width width) {
  switch (width) {
    case Width::kSmall:
      return Small::kBytes;
    case Width::kMedium:
      return Medium::kBytes;
    case Width::kWide:
      break;
  }
  return Wide::kBytes;
}

PackedSums::Width PackedSums::WidthOf(const SurfaceSums& sums) {
  uint64_t sum = 0;
  uint64_t product = 0;
  for (size_t i = 0; i < 3; ++i) sum |= sums.sample_sum[i] | sums.point_sum[i];
  for (size_t i = 0; i < 6; ++i) product |= sums.product_sum[i];
  const uint32_t count = sums.samples | sums.points;
  if (product > std::numeric_limits<uint32_t>::max()) return Width::kWide;
  if (count <= std::numeric_limits<uint8_t>::max() && sum <= std::numeric_limits<uint16_t>::max()) {
    return Width::kSmall;
  }
  if (count <= std::numeric_limits<uint16_t>::max() &&
      sum <= std::numeric_limits<uint32_t>::max()) {
    return Width::kMedium;
  }
  return Width::kWide;
}

void PackedSums::Store(const SurfaceSums& sums, Width width, std::byte* to) {
  const auto store = [&](const auto& stored) {
    std::memcpy(to, static_cast<const void*>(&stored), stored.kBytes);
  };
  switch (width) {
    case Width::kSmall:
      return store(Small(sums));
    case Width::kMedium:
      return store(Medium(sums));
    case Width::kWide:
      break;
  }
  store(Wide(sums));
}

}  // namespace vantage::model
