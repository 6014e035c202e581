#include "core/registration/bound/instrument_limit.h"

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/registration/bound/overlap_element.h"

namespace vantage::registration {
namespace {

// Of what can be required at most (RegistrationConfig::Validate()), m: beyond it no requirement
// helps.
constexpr double kMostAttainable = 1.0;

// Millimetres, rounded up to two figures.
double TwoFigures(double metres) {
  const double unit = std::pow(10.0, std::floor(std::log10(metres)) - 1);
  return std::ceil(metres / unit - 1e-9) * unit;
}

}  // namespace

std::optional<double> AttainableInstead(const ExpectedBounds& full,
                                        const sensor::ScannerModel& scanner,
                                        const RegistrationConfig& config) {
  const double most = config.required_accuracy / kBoundMargin;
  if (full.bound <= most || kBoundMargin * full.bound > kMostAttainable) return std::nullopt;
  if (full.by_sheet <= most || ClosedRoomBound(scanner, config) > most) return full.bound;
  return std::nullopt;
}

double ClosedRoomBound(const sensor::ScannerModel& scanner, const RegistrationConfig& config) {
  constexpr double kSpacing = 0.1;  // m; each element stands for four voxels of 5 cm
  constexpr double kWeight = 4;
  const Eigen::Vector3d half(2.5, 2.0, 1.25);
  // Of a sector that faces a corner.
  const double facing = std::atan2(half.y(), half.x());
  std::vector<OverlapElement> elements;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    for (const double side : {-1.0, 1.0}) {
      for (double a = -half[u] + kSpacing / 2; a < half[u]; a += kSpacing) {
        for (double b = -half[v] + kSpacing / 2; b < half[v]; b += kSpacing) {
          Eigen::Vector3d at;
          at[axis] = side * half[axis];
          at[u] = a;
          at[v] = b;
          const double elevation = std::asin(at.z() / at.norm());
          const double azimuth =
              std::remainder(std::atan2(at.y(), at.x()) - facing, 2 * sensor::kPi);
          if (elevation < scanner.elevation_min || elevation > scanner.elevation_max ||
              std::abs(azimuth) > scanner.azimuth_span / 2 || at.norm() < scanner.range_min ||
              at.norm() > scanner.range_max) {
            continue;
          }
          Eigen::Vector3f normal = Eigen::Vector3f::Zero();
          normal[axis] = static_cast<float>(-side);
          elements.push_back({at.cast<float>(), normal, 1, 1});
        }
      }
    }
  }
  return BoundsOf(elements, kWeight, Eigen::Vector3d::Zero(), scanner, config).by_sheet;
}

std::string InstrumentLimitReason(double attainable, const RegistrationConfig& config) {
  return absl::StrFormat(
      "the required accuracy of %.3g mm cannot be met with this instrument: about %.3g mm can",
      1000 * config.required_accuracy, 1000 * TwoFigures(attainable));
}

std::string InstrumentLimitRemedy(double attainable) {
  return absl::StrFormat("set required_accuracy to %.3g or more (m), or use targets",
                         TwoFigures(kBoundMargin * attainable));
}

void SayInstrumentLimit(const ScanSurface& surface, const RegistrationConfig& config,
                        RegistrationResult& result) {
  RegistrationVerdict& verdict = result.verdict;
  if (verdict.registered() || !result.residuals.has_value()) return;
  RegistrationConfig with_this = config;
  with_this.instrument.Add(*result.residuals);
  std::vector<OverlapElement> elements;
  elements.reserve(surface.samples.size());
  for (const SurfaceSample& s : surface.samples) {
    elements.push_back({(result.T_world_scan * s.point.cast<double>()).cast<float>(),
                        (result.T_world_scan.linear() * s.normal.cast<double>()).cast<float>(),
                        s.cells, 1});
  }
  verdict.attainable_accuracy = AttainableInstead(
      BoundsOf(elements, 1, result.T_world_scan.translation(), surface.scanner, with_this),
      surface.scanner, with_this);
  if (!verdict.attainable_accuracy.has_value()) return;
  verdict.reason = absl::StrCat(InstrumentLimitReason(*verdict.attainable_accuracy, config), " (",
                                verdict.reason, ")");
  verdict.remedy = InstrumentLimitRemedy(*verdict.attainable_accuracy);
}

}  // namespace vantage::registration
