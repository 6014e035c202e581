// Scans that were made and whose data have not come yet (algorithm.md section 11, 'Joint
// planning'): which of them a scan that comes is, and what one that has not come should bring.
#ifndef VANTAGE_CORE_FLEET_PENDING_STATIONS_H_
#define VANTAGE_CORE_FLEET_PENDING_STATIONS_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/fleet/fleet_request.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/planning/plan/planning_config.h"
#include "core/sensor/scanner_model.h"

namespace vantage::fleet {

struct PendingStation {
  std::string scanner;                                 // that made the scan; empty: not known
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m
  std::optional<double> heading = {};  // rad, of a scanner that sees a sector, where it is known
  double span = 0;                     // rad, of that sector; counts only with a heading
};

// The nearest of `pending`, the earliest if equal, that a scan of `scanner` from `position` (m) can
// be of: at most a metre away horizontally, since people point at a place on a picture, and within
// half a storey of its height; not another scanner's; and of a sector only when the scan, which has
// `heading` (rad, of the scanner's +x), shows three quarters of it: who turns on the spot makes
// several stations at one place. Nothing when there is none.
std::optional<size_t> StationOfScan(std::span<const PendingStation> pending,
                                    absl::string_view scanner, const Eigen::Vector3d& position,
                                    std::optional<double> heading = std::nullopt);

// How likely a scan is not to come into the model, by what is predicted of its registration.
inline constexpr double kLossWhereItRegisters = 0.05;  // the files are lost, the place was another
inline constexpr double kLossWhereItWaits = 0.2;       // that of each scan that it needs, too
inline constexpr double kLossOtherwise = 0.5;          // nobody can say

struct StationForecast {
  // m^2 that its scan should bring to the required density, beyond the views before it.
  double model_gain = 0;
  double loss_chance = kLossOtherwise;  // [0, 1]
  bool registers = false;               // on the model, or once scans of views before it are in
  bool waits = false;                   // not before these are in
  std::string why_not;                  // what the registration check has against it
};

// `before` are the views that count as scanned. The place need not be feasible: somebody has stood
// there. Of a scanner that sees a sector the gain is that of the sector which faces `heading`
// (rad); without one, of the heading that a plan would choose there, since no scan shows more than
// one. INVALID_ARGUMENT: configuration, scanner, position (m, model frame) or heading (rad).
// RESOURCE_EXHAUSTED: as planning::MakePlan().
absl::StatusOr<StationForecast> ForecastStation(
    const model::PlanningView& model, const sensor::ScannerModel& scanner,
    planning::PlanningConfig config, const Eigen::Vector3d& position, std::optional<double> heading,
    std::span<const PledgedView> before, parallel::Parallel& parallel);

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_PENDING_STATIONS_H_
