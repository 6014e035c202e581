// How far off can a registration be? From the geometry of an overlap to a bound in metres, for an
// alignment that was made and for one that is only planned (algorithm.md section 9).
#ifndef VANTAGE_CORE_REGISTRATION_ERROR_BOUND_H_
#define VANTAGE_CORE_REGISTRATION_ERROR_BOUND_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <string>

#include "core/registration/targets.h"
#include "core/registration/verdict.h"
#include "core/sensor/scan.h"

namespace vantage {

// One point-to-plane equation of the overlap.
struct Constraint {
  Eigen::Vector3d position;  // m, world
  Eigen::Vector3d normal;    // unit, world; an estimate
  double variance = 0;       // m^2, of the residual's independent part, > 0
  double weight = 1;         // how many equations like this one it stands for, > 0
  double residual = 0;       // m, as it was observed; 0 where nothing was observed yet
};

// Pose changes here are [rotation about world axes, rad; translation, m] about the overlap's
// centroid: a point x moves by G(x) xi = w x (x - centroid) + t.
struct ErrorBound {
  Matrix6d covariance = Matrix6d::Zero();
  double bound = 0;     // E: m, 95 % quantile of the largest displacement of the box's corners
  double rigorous = 0;  // m, sqrt(chi2_6 lambda_max)
  double strength = 0;  // standard deviation of the strongest over that of the weakest direction
  Vector6d weakest = Vector6d::Zero();  // of largest displacement, scaled to a mean corner
                                        // displacement of 1 m
};

// Everything about an overlap that the bound depends on, once; then bounds with as many kinds of
// outside knowledge as wanted.
class OverlapGeometry {
 public:
  // Displacements are never believed to be larger than this (m): it stands for 'unconstrained'.
  static constexpr double kUnconstrained = 10.0;

  // `normal_sigma`: noise of each normal, rad. Needs at least one constraint.
  OverlapGeometry(std::span<const Constraint> constraints, double normal_sigma,
                  const RegistrationConfig& config);

  const Eigen::Vector3d& centroid() const { return centroid_; }
  const Eigen::AlignedBox3d& box() const { return box_; }
  // Of the geometry alone, after what noise in the normals feigns was taken out.
  const Matrix6d& information() const { return information_; }
  // Information about the centroid that closes what the geometry leaves open, and nothing else:
  // more than the geometry has of any direction.
  Matrix6d Open() const;
  // Directions (of six) that the geometry constrains.
  int constrained_directions() const { return constrained_; }

  // `known`: information (about the centroid) from elsewhere, added to the geometry's.
  ErrorBound Bound(const Matrix6d& known) const;

  // Information that a pose covariance [rotation; translation of the scanner] stands for, moved
  // from the scanner's position to the centroid.
  Matrix6d FromPoseCovariance(const Matrix6d& covariance,
                              const Eigen::Vector3d& scanner_position) const;

  // Information that targets stand for, each known along all three axes.
  Matrix6d FromTargets(std::span<const TargetTie> targets) const;

 private:
  Eigen::Matrix<double, 3, 6> Displacement(const Eigen::Vector3d& point) const;

  Eigen::Vector3d centroid_;
  Eigen::AlignedBox3d box_;
  Matrix6d information_ = Matrix6d::Zero();
  Matrix6d correlated_ = Matrix6d::Zero();  // sum over blocks of what each may push, squared
  int constrained_ = 0;
  int draws_;
  unsigned seed_;
};

// The block of correlated residuals that a constraint belongs to: a cell of one correlation length
// and similar normals.
uint64_t CorrelationBlock(const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                          double correlation_length);

// Information of an inclinometer: rotation about the two horizontal axes known to `sigma` rad.
Matrix6d LevelInformation(double sigma);

// The weakest direction as a surveyor would say it: 'sliding along x (east-west)', 'turning about
// the vertical'. `reach` (m) is half the overlap's diagonal: what a rotation displaces at its edge.
struct DirectionWords {
  std::string direction;
  std::string remedy;  // what would constrain it
};
DirectionWords DescribeDirection(const Vector6d& weakest, double reach);

}  // namespace vantage

#endif  // VANTAGE_CORE_REGISTRATION_ERROR_BOUND_H_
