// How high a scanner stands, by the floors that scan and model show (algorithm.md section 9,
// 'Global registration').
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_SCANNER_HEIGHTS_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_SCANNER_HEIGHTS_H_

#include <Eigen/Core>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/registration/align/floor_plane.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {

// How far a tripod set up by eye leans at most, rad: the floor of a scan is sought within it.
inline constexpr double kMaxTilt = sensor::Radians(12);
// m, up and down, that tripods differ in height.
inline constexpr double kHeightOverStation = 0.3;

// A height at which a scanner may have stood, and where.
class ScannerHeight {
 public:
  // Anywhere.
  explicit ScannerHeight(double z) : z_(z) {}
  // Over a floor that is known in `columns` (of kColumn, from the world's origin).
  ScannerHeight(double z, const std::vector<Eigen::Vector2i>& columns);

  static constexpr double kColumn = 0.5;  // m
  static Eigen::Vector2i ColumnOf(const Eigen::Vector2d& place) {
    return (place / kColumn).array().floor().cast<int>();
  }

  double z() const { return z_; }  // m, world, of the scanner
  // Whether its floor is known within some metres (kFloorReach) of a place (m, world).
  bool FloorNear(const Eigen::Vector2d& place) const;

 private:
  double z_;
  Eigen::Array2i corner_ = Eigen::Array2i::Zero();
  Eigen::Array2i size_ = Eigen::Array2i::Zero();
  std::vector<char> near_;  // by column, x first; empty: no floor is known
};

// Over each floor of the model as high as over the scan's own, the largest floor first: level
// surface of two square metres and more that is no furniture on a larger floor. Without any, near
// the heights of the stations.
std::vector<ScannerHeight> ScannerHeights(const model::PlanningView& model,
                                          const FloorPlane* floor);

// Those of `heights` at which a scanner may have stood at `place`, by index: of floors less than a
// storey apart those that are known near it, if any is.
std::vector<size_t> HeightsAt(const std::vector<ScannerHeight>& heights,
                              const Eigen::Vector2d& place);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_SCANNER_HEIGHTS_H_
