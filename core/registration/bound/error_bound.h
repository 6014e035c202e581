// How far off a registration can be: from the geometry of an overlap to a bound in metres, for an
// alignment that was made and for one that is only planned (algorithm.md section 9, 'How far off it
// may be').
#ifndef VANTAGE_CORE_REGISTRATION_BOUND_ERROR_BOUND_H_
#define VANTAGE_CORE_REGISTRATION_BOUND_ERROR_BOUND_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <string>

#include "core/registration/align/registration_config.h"
#include "core/registration/align/targets.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

// One point-to-plane equation of the overlap.
struct Constraint {
  Eigen::Vector3d position;  // m, world
  Eigen::Vector3d normal;    // unit, world; an estimate
  double variance = 0;       // m^2, of the residual's independent part, > 0
  // How many equations like this one it stands for. 0: it holds nothing, but is part of the overlap
  // that the bound is for.
  double weight = 1;
  double residual = 0;  // m, as it was observed; 0 where nothing was observed yet
  // m^2, of the error that it shares with its block, in addition to config.correlated_sigma.
  double shared_variance = 0;
};

// Pose changes here are [rotation about world axes, rad; translation, m] about the overlap's
// centroid: a point x moves by G(x) xi = w x (x - centroid) + t.
struct ErrorBound {
  sensor::Matrix6d covariance = sensor::Matrix6d::Zero();
  double bound = 0;     // E: m, 95 % quantile of the largest displacement of the box's corners
  double rigorous = 0;  // m, sqrt(chi2_6 lambda_max)
  double strength = 0;  // standard deviation of the strongest over that of the weakest direction
  sensor::Vector6d weakest = sensor::Vector6d::Zero();  // of largest displacement, scaled to a mean
                                                        // corner displacement of 1 m
};

// Computes once what the bound depends on of an overlap. Bound() then adds what is known from
// elsewhere.
class OverlapGeometry {
 public:
  // Displacements are never believed to be larger than this (m): it stands for 'unconstrained'.
  static constexpr double kUnconstrained = 10.0;

  // `normal_sigma`: noise of each normal, rad. Needs at least one constraint.
  OverlapGeometry(std::span<const Constraint> constraints, double normal_sigma,
                  const RegistrationConfig& config);

  const Eigen::Vector3d& centroid() const { return centroid_; }
  const Eigen::AlignedBox3d& box() const { return box_; }
  // The information of the geometry alone, without what noise in the normals feigns.
  const sensor::Matrix6d& information() const { return information_; }
  // Information, about the centroid, that fixes the directions which the geometry leaves open and
  // no others. It is larger than the geometry's own in any direction.
  sensor::Matrix6d Open() const;
  // Directions (of six) that the geometry constrains.
  int constrained_directions() const { return constrained_; }

  // `known`: information (about the centroid) from elsewhere, added to the geometry's.
  ErrorBound Bound(const sensor::Matrix6d& known) const;

  // Information that a pose covariance [rotation; translation of the scanner] stands for, moved
  // from the scanner's position to the centroid.
  sensor::Matrix6d FromPoseCovariance(const sensor::Matrix6d& covariance,
                                      const Eigen::Vector3d& scanner_position) const;

  // Information that targets stand for, each known along all three axes.
  sensor::Matrix6d FromTargets(std::span<const TargetTie> targets) const;

 private:
  Eigen::Matrix<double, 3, 6> Displacement(const Eigen::Vector3d& point) const;

  Eigen::Vector3d centroid_;
  Eigen::AlignedBox3d box_;
  sensor::Matrix6d information_ = sensor::Matrix6d::Zero();
  sensor::Matrix6d correlated_ =
      sensor::Matrix6d::Zero();  // sum over blocks of what a shared error adds, squared
  int constrained_ = 0;
  int draws_;
  unsigned seed_;
};

// Information of an inclinometer: rotation about the two horizontal axes known to `sigma` rad.
sensor::Matrix6d LevelInformation(double sigma);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_BOUND_ERROR_BOUND_H_
