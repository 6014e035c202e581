#include "client/picture/palette.h"

#include <algorithm>
#include <array>

namespace vantage::picture {

Colour Distinct(int i) {
  static constexpr std::array<unsigned, kDistinctColours> kColours = {
      0xd62728, 0x1f77b4, 0x2ca02c, 0x9467bd, 0xff7f0e, 0x17a2b8, 0x8c564b, 0xe377c2};
  return Rgb(kColours[static_cast<size_t>(i) % kColours.size()]);
}

Colour Viridis(double t) {
  // The map sampled at ninths; linear between.
  static constexpr std::array<unsigned, 10> kStops = {0x440154, 0x482878, 0x3e4989, 0x31688e,
                                                      0x26828e, 0x1f9e89, 0x35b779, 0x6ece58,
                                                      0xb5de2b, 0xfde725};
  const double at = std::clamp(t, 0.0, 1.0) * (kStops.size() - 1);
  const size_t low = std::min(static_cast<size_t>(at), kStops.size() - 2);
  const double f = at - static_cast<double>(low);
  const Colour a = Rgb(kStops[low]);
  const Colour b = Rgb(kStops[low + 1]);
  return {a.r + f * (b.r - a.r), a.g + f * (b.g - a.g), a.b + f * (b.b - a.b), 1.0};
}

}  // namespace vantage::picture
