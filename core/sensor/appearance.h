// What a return looked like, for people and screens; planning uses none of it.
#ifndef VANTAGE_CORE_SENSOR_APPEARANCE_H_
#define VANTAGE_CORE_SENSOR_APPEARANCE_H_

#include <array>
#include <cstdint>
#include <vector>

namespace vantage::sensor {

// Which of it there is, or is wanted.
struct AppearanceKinds {
  bool intensity = false;
  bool colour = false;

  bool any() const { return intensity || colour; }
};

using Colour = std::array<uint8_t, 3>;  // red, green, blue

// Of many returns in an order of its own; empty of what there is not.
struct Appearance {
  // How bright the return was, from 0 to 65,535 of what the instrument, or its file, can tell.
  std::vector<uint16_t> intensity;
  std::vector<Colour> colour;

  AppearanceKinds kinds() const { return {!intensity.empty(), !colour.empty()}; }
};

// `share` of the whole, [0, 1]; what lies outside, and NaN, is clamped.
inline uint16_t IntensityOf(double share) {
  return share > 0 ? static_cast<uint16_t>(share < 1 ? share * 65535 + 0.5 : 65535) : 0;
}
inline uint8_t ColourOf(double share) {
  return share > 0 ? static_cast<uint8_t>(share < 1 ? share * 255 + 0.5 : 255) : 0;
}

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_APPEARANCE_H_
