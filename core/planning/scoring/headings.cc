#include "core/planning/scoring/headings.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace vantage::planning {
namespace {

// rad: a person or a robot turns to a heading within a few degrees. Facing half a step past the
// best heading loses what a strip of that width gains.
constexpr double kWidestStep = sensor::Radians(5);
constexpr double kStepsOfSpan = 8;     // at least, so that the strip is a small part of the sector
constexpr size_t kMostHeadings = 360;  // a degree; sectors of a few degrees are no scanner
constexpr double kSameHeading = 1e-6;  // of a step
constexpr double kFloatSlack = 1e-5;   // rad: azimuths of cells are computed in floats
constexpr double kWholeNumber = 1e-9;  // a span this near to whole steps has that many

constexpr size_t kTurn = 4;           // a turn in diamond angles
constexpr size_t kPartsOfUnit = 256;  // so that hardly any part has two beginnings of bins

// Grows with the azimuth, from 0 on +x by 1 for each quarter of a turn: the azimuth as seen on the
// square |x| + |y| = 1.
float DiamondAngle(float x, float y) {
  const float sum = std::abs(x) + std::abs(y);
  if (!(sum > 0)) return 0;
  const float rise = y / sum;
  if (x < 0) return 2 - rise;
  return rise < 0 ? 4 + rise : rise;
}

}  // namespace

Headings::Headings(const sensor::ScannerModel& scanner, double first) : first_(first) {
  if (scanner.TurnsAllAround()) return;
  const double widest = std::min(kWidestStep, scanner.azimuth_span / kStepsOfSpan);
  const auto least = static_cast<size_t>(std::ceil(2 * sensor::kPi / widest - kWholeNumber));
  size_ = std::min(least, kMostHeadings);
  step_ = 2 * sensor::kPi / static_cast<double>(size_);
  half_span_ = 0.5 * scanner.azimuth_span;
  const double steps = scanner.azimuth_span / step_;
  whole_ = static_cast<size_t>(steps + kWholeNumber);
  part_ = std::max(0.0, steps - static_cast<double>(whole_));
  if (part_ < kWholeNumber) part_ = 0;
  OrderBins();
}

void Headings::OrderBins() {
  struct Begin {
    float at;
    uint16_t bin;
  };
  std::vector<Begin> order;
  for (size_t bin = 0; bin < 2 * size_; ++bin) {
    const size_t whole = bin / 2;
    const double steps = static_cast<double>(whole) + (bin % 2 == 0 ? 0 : part_);
    const double azimuth = first_ - half_span_ + steps * step_;
    order.push_back(
        {DiamondAngle(static_cast<float>(std::cos(azimuth)), static_cast<float>(std::sin(azimuth))),
         static_cast<uint16_t>(bin)});
  }
  // A bin that is empty begins where the next one does, and comes before it.
  std::stable_sort(order.begin(), order.end(),
                   [](const Begin& x, const Begin& y) { return x.at < y.at; });
  // The turn begins inside the last bin.
  begins_.push_back(0);
  bins_.push_back(order.back().bin);
  for (const Begin& begin : order) {
    begins_.push_back(begin.at);
    bins_.push_back(begin.bin);
  }
  size_t last = 0;
  for (size_t k = 0; k <= kTurn * kPartsOfUnit; ++k) {
    const float at = static_cast<float>(k) / kPartsOfUnit;
    while (last + 1 < begins_.size() && begins_[last + 1] <= at) ++last;
    near_.push_back(static_cast<uint16_t>(last));
  }
}

size_t Headings::BinOf(float x, float y) const {
  if (all_around()) return 0;
  const float at = DiamondAngle(x, y);
  size_t k = near_[static_cast<size_t>(at * kPartsOfUnit)];
  while (k + 1 < begins_.size() && begins_[k + 1] <= at) ++k;
  return bins_[k];
}

bool Headings::Sees(size_t heading, size_t bin) const {
  if (all_around()) return true;
  const size_t after = (bin / 2 + size_ - heading) % size_;
  return after < whole_ || (after == whole_ && bin % 2 == 0);
}

void Headings::Sum(std::span<const double> by_bin, std::span<double> by_heading) const {
  if (all_around()) {
    by_heading[0] = by_bin[0];
    return;
  }
  // Whole steps, twice around, so that no sum wraps; heading by heading in the inner loop, which
  // the compiler makes into vectors.
  std::array<double, 2 * kMostHeadings> steps;
  for (size_t i = 0; i < size_; ++i) steps[i] = by_bin[2 * i] + by_bin[2 * i + 1];
  std::copy_n(steps.begin(), size_, steps.begin() + static_cast<ptrdiff_t>(size_));
  for (size_t i = 0; i < size_; ++i) by_heading[i] = by_bin[2 * ((i + whole_) % size_)];
  for (size_t k = 0; k < whole_; ++k) {
    for (size_t i = 0; i < size_; ++i) by_heading[i] += steps[i + k];
  }
}

void Headings::AddWhereSeen(const Eigen::AlignedBox2d& offsets, double value,
                            std::span<double> by_heading) const {
  // As seen from outside, a box spans less than half a turn, between two of its corners.
  double reach = sensor::kPi;
  double middle = 0;
  if (!all_around() && !offsets.contains(Eigen::Vector2d::Zero())) {
    const Eigen::Vector2d centre = offsets.center();
    middle = std::atan2(centre.y(), centre.x());
    reach = half_span_ + kFloatSlack;
    double widest = 0;
    for (int corner = 0; corner < 4; ++corner) {
      const Eigen::Vector2d at =
          offsets.corner(static_cast<Eigen::AlignedBox2d::CornerType>(corner));
      const double away = std::remainder(std::atan2(at.y(), at.x()) - middle, 2 * sensor::kPi);
      widest = std::max(widest, std::abs(away));
    }
    reach += widest;
  }
  for (size_t i = 0; i < size_; ++i) {
    if (std::abs(std::remainder(Angle(i) - middle, 2 * sensor::kPi)) <= reach) {
      by_heading[i] += value;
    }
  }
}

BestHeading BestOf(std::span<const double> by_heading) {
  const auto best = std::max_element(by_heading.begin(), by_heading.end());
  return {static_cast<size_t>(best - by_heading.begin()), *best};
}

Sector::Sector(const sensor::ScannerModel& scanner, std::optional<double> heading)
    : headings_(scanner), everything_(headings_.all_around() || !heading.has_value()) {
  if (everything_) return;
  // One of the headings that views are scored for sees the same here, to the bit.
  const double steps = *heading / headings_.step();
  const double nearest = std::round(steps);
  if (std::abs(steps - nearest) < kSameHeading) {
    const auto turn = static_cast<double>(headings_.size());
    heading_ = static_cast<size_t>(nearest - turn * std::floor(nearest / turn)) % headings_.size();
  } else {
    headings_ = Headings(scanner, *heading);
  }
}

std::vector<double> SumByHeading(const Headings& headings, const Eigen::Vector3d& view,
                                 const CellArrays& cells, std::span<const float> cell_scores) {
  const Eigen::Vector3f at = view.cast<float>();
  std::vector<double> by_bin(headings.bins(), 0);
  for (size_t i = 0; i < cell_scores.size(); ++i) {
    if (cell_scores[i] <= 0) continue;
    by_bin[headings.BinOf(cells.x[i] - at.x(), cells.y[i] - at.y())] +=
        static_cast<double>(cell_scores[i]);
  }
  std::vector<double> by_heading(headings.size());
  headings.Sum(by_bin, by_heading);
  return by_heading;
}

double KeepSector(const Sector& sector, const Eigen::Vector3d& view, const CellArrays& cells,
                  std::span<float> cell_scores) {
  const Eigen::Vector3f at = view.cast<float>();
  double sum = 0;
  for (size_t i = 0; i < cell_scores.size(); ++i) {
    if (cell_scores[i] <= 0) continue;
    if (!sector.Sees(cells.x[i] - at.x(), cells.y[i] - at.y())) cell_scores[i] = 0;
    sum += static_cast<double>(cell_scores[i]);
  }
  return sum;
}

}  // namespace vantage::planning
