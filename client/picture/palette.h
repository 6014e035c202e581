// Colours that stay apart for colour-blind readers (Okabe and Ito's set; viridis for scores).
#ifndef VANTAGE_CLIENT_PICTURE_PALETTE_H_
#define VANTAGE_CLIENT_PICTURE_PALETTE_H_

namespace vantage::picture {

// Each channel in [0, 1].
struct Colour {
  double r = 0;
  double g = 0;
  double b = 0;
  double a = 1;

  Colour Alpha(double alpha) const { return {r, g, b, alpha}; }
  bool operator==(const Colour&) const = default;
};

constexpr Colour Rgb(unsigned hex) {
  return {((hex >> 16) & 255) / 255.0, ((hex >> 8) & 255) / 255.0, (hex & 255) / 255.0, 1.0};
}

namespace palette {
inline constexpr Colour kWhite = Rgb(0xffffff);
inline constexpr Colour kInk = Rgb(0x1a1a1a);
inline constexpr Colour kFaintInk = Rgb(0x6a6a6a);
inline constexpr Colour kGrid = Rgb(0xe4e4e4);
inline constexpr Colour kContext = Rgb(0x8c8c8c);       // walls behind a heat map
inline constexpr Colour kMeasured = Rgb(0x222222);      // true surface at density
inline constexpr Colour kMeasuredFlat = Rgb(0xe3e3e3);  // floors and ceilings at density
inline constexpr Colour kUnderSampled = Rgb(0xe69f00);  // true surface below density
inline constexpr Colour kUnderSampledFlat = Rgb(0xfaeccb);
inline constexpr Colour kOcclusion = Rgb(0xd0341c);
inline constexpr Colour kHole = Rgb(0xcc79a7);
inline constexpr Colour kImageBoundary = Rgb(0x0072b2);
inline constexpr Colour kNextPosition = Rgb(0xd0341c);

}  // namespace palette

// Colours that differ from white and from each other; they repeat after kDistinctColours.
inline constexpr int kDistinctColours = 8;
Colour Distinct(int i);

// Viridis at t in [0, 1]; values outside are clamped.
Colour Viridis(double t);

}  // namespace vantage::picture

#endif  // VANTAGE_CLIENT_PICTURE_PALETTE_H_
