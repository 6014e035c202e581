#include "server/report/plan_sheet.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace vantage::report {
namespace {

constexpr int kScales[] = {20,  25,  50,   75,   100,  125,  150,  200,    250,    300,    400,
                           500, 750, 1000, 1500, 2000, 2500, 5000, 10'000, 20'000, 50'000, 100'000};
constexpr double kMargin = 0.4;  // m around what is shown
// Of what is shown, so much lies outside on each side at most.
constexpr double kStrays = 0.002;
// Walls that run so nearly along the axes are left as they are, rad.
constexpr double kUpright = 0.02;

// Of the values, that which `share` of them is below.
double Quantile(std::vector<double>& values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<size_t>(at)];
}

}  // namespace

PlanSheet::PlanSheet(const model::FloorPlan& plan, const std::vector<Eigen::Vector2d>& stations,
                     const Eigen::Vector2d& most) {
  constexpr double kQuarter = std::numbers::pi / 2;
  turn_ = plan.direction > kQuarter / 2 ? kQuarter - plan.direction : -plan.direction;
  if (std::abs(turn_) < kUpright) turn_ = 0;
  rotation_ = Eigen::Rotation2Dd(turn_).toRotationMatrix();
  std::vector<double> along[2];
  for (int y = 0; y < plan.rows; ++y) {
    for (int x = 0; x < plan.columns; ++x) {
      if (plan.cells[plan.At(x, y)] == model::PlanCell::kNothing) continue;
      const Eigen::Vector2d at =
          rotation_ * (plan.corner + plan.edge * Eigen::Vector2d(x + 0.5, y + 0.5));
      along[0].push_back(at.x());
      along[1].push_back(at.y());
    }
  }
  if (!along[0].empty()) {
    for (int axis = 0; axis < 2; ++axis) {
      const auto [least, largest] = std::minmax_element(along[axis].begin(), along[axis].end());
      const double all = *largest - *least;
      const double low = *least;
      box_.min()[axis] = Quantile(along[axis], kStrays);
      box_.max()[axis] = Quantile(along[axis], 1 - kStrays);
      // Little that is left out is not worth a word.
      if (all - box_.sizes()[axis] < 1) {
        box_.min()[axis] = low;
        box_.max()[axis] = low + all;
      } else {
        cut_ = true;
      }
    }
  }
  for (const Eigen::Vector2d& station : stations) box_.extend(rotation_ * station);
  if (box_.isEmpty()) box_.extend(Eigen::Vector2d::Zero());
  box_.min().array() -= kMargin;
  box_.max().array() += kMargin;
  for (const int scale : kScales) {
    scale_ = scale;
    size_ = box_.sizes() * (1000.0 / scale);
    if ((size_.array() <= most.array()).all()) break;
  }
}

Eigen::Vector2d PlanSheet::ToSheet(const Eigen::Vector2d& at) const {
  const Eigen::Vector2d turned = rotation_ * at;
  return {(turned.x() - box_.min().x()) * millimetres_per_metre(),
          (box_.max().y() - turned.y()) * millimetres_per_metre()};
}

Eigen::Vector2d PlanSheet::Turned(const Eigen::Vector2d& direction) const {
  const Eigen::Vector2d turned = rotation_ * direction * millimetres_per_metre();
  return {turned.x(), -turned.y()};
}

}  // namespace vantage::report
