#include "client/picture/column_map.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vantage::picture {
namespace {

// A column with this much standing surface shows at full strength: 1.5 m of height.
constexpr double kFullHeight = 1.5;
// Standing surface below this height is clutter at the floor, not a wall.
constexpr double kLeastHeight = 0.15;
// Missing surface is shown over measured once it is this share of it.
constexpr double kMissingShare = 0.25;
constexpr float kUprightNormal = 0.7f;

struct Tally {
  float standing_measured = 0;
  float standing_under = 0;
  float flat_measured = 0;
  float flat_under = 0;
  std::array<float, model::kSurfaceKinds> area{};
};

Column Classify(const Tally& tally, double cell) {
  Column column;
  column.area = tally.area;
  const double full = cell * kFullHeight;
  const auto show = [&](ColumnClass shown, double area) {
    column.shown = shown;
    column.strength = static_cast<float>(std::clamp(area / full, 0.0, 1.0));
  };
  const float standing = tally.standing_measured + tally.standing_under;
  int largest = 1;
  float missing = 0;
  for (int kind = 1; kind < model::kSurfaceKinds; ++kind) {
    missing += tally.area[kind];
    if (tally.area[kind] > tally.area[largest]) largest = kind;
  }
  if (missing >= 0.5 * cell * cell && missing >= kMissingShare * standing) {
    show(static_cast<ColumnClass>(static_cast<int>(ColumnClass::kOcclusion) + largest - 1),
         missing);
  } else if (standing >= cell * kLeastHeight) {
    show(tally.standing_under > tally.standing_measured ? ColumnClass::kUnderSampled
                                                        : ColumnClass::kMeasured,
         standing);
  } else if (tally.flat_measured + tally.flat_under > 0) {
    show(tally.flat_under > tally.flat_measured ? ColumnClass::kUnderSampledFlat
                                                : ColumnClass::kMeasuredFlat,
         full);
  }
  return column;
}

// The interval that leaves (1 - share) / 2 of the weight out at each end.
std::pair<int, int> CentralInterval(std::vector<std::pair<int, float>> values, double share) {
  std::sort(values.begin(), values.end());
  double total = 0;
  for (const auto& [value, weight] : values) total += weight;
  const double cut = total * (1 - share) / 2;
  double below = 0;
  int low = values.front().first;
  int high = values.back().first;
  bool low_found = false;
  for (const auto& [value, weight] : values) {
    below += weight;
    if (!low_found && below > cut) {
      low = value;
      low_found = true;
    }
    if (below >= total - cut) {
      high = value;
      break;
    }
  }
  return {low, high};
}

}  // namespace

ColumnMap::ColumnMap(std::span<const SurfaceElement> surfaces, double cell, double required_density,
                     double share)
    : cell_(cell) {
  if (surfaces.empty()) return;
  const auto index_of = [&](const SurfaceElement& s) {
    return Eigen::Vector2i((s.position.head<2>() / cell_).array().floor().cast<int>());
  };
  std::vector<std::pair<int, float>> xs;
  std::vector<std::pair<int, float>> ys;
  xs.reserve(surfaces.size());
  ys.reserve(surfaces.size());
  for (const SurfaceElement& s : surfaces) {
    const Eigen::Vector2i at = index_of(s);
    xs.emplace_back(at.x(), s.area);
    ys.emplace_back(at.y(), s.area);
  }
  const auto [x_low, x_high] = CentralInterval(std::move(xs), share);
  const auto [y_low, y_high] = CentralInterval(std::move(ys), share);
  // A margin for walls that may have been cut off.
  const int margin = static_cast<int>(std::lround(0.2 / cell_));
  first_ = {x_low - margin, y_low - margin};
  size_ = Eigen::Vector2i(x_high + margin + 1, y_high + margin + 1) - first_;

  std::vector<Tally> tallies(static_cast<size_t>(size_.x()) * size_.y());
  for (const SurfaceElement& s : surfaces) {
    const Eigen::Vector2i at = index_of(s) - first_;
    if ((at.array() < 0).any() || (at.array() >= size_.array()).any()) continue;
    Tally& tally = tallies[static_cast<size_t>(at.y()) * size_.x() + at.x()];
    tally.area[static_cast<int>(s.kind)] += s.area;
    if (s.kind != model::SurfaceKind::kTrue) continue;
    const bool under = s.density < required_density;
    if (std::abs(s.normal.z()) > kUprightNormal) {
      (under ? tally.flat_under : tally.flat_measured) += s.area;
    } else {
      (under ? tally.standing_under : tally.standing_measured) += s.area;
    }
  }
  columns_.reserve(tallies.size());
  for (const Tally& tally : tallies) columns_.push_back(Classify(tally, cell_));
}

}  // namespace vantage::picture
