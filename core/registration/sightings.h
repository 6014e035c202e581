// Matches the targets that a scan saw with their known places.
#ifndef VANTAGE_CORE_REGISTRATION_SIGHTINGS_H_
#define VANTAGE_CORE_REGISTRATION_SIGHTINGS_H_

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/registration/align/targets.h"

namespace vantage::registration {

// A target, as one scan saw it.
struct Sighting {
  std::string name;                                   // the same target has the same in every scan
  Eigen::Vector3d in_scan = Eigen::Vector3d::Zero();  // m, scanner frame
  std::optional<double> sigma;                        // m per axis; absent: that of TargetTie
  std::optional<Eigen::Vector3d> in_world;            // m, where a control network has it
};

// What a scan saw whose pose is known.
struct SightingsOfScan {
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  double error_bound = 0;  // m, that holds at 95 %; 0 of the scan that defines the world frame
  std::vector<Sighting> targets;
};

// A target whose place is known: from a control network, or since a scan saw it.
struct KnownTarget {
  std::string name;
  Eigen::Vector3d in_world = Eigen::Vector3d::Zero();  // m
  double sigma = 0.002;                                // m per axis, of that and of a sighting
};
// All that `before` saw, by name; of a target's places that from a control network, else that of
// the scan with the best known pose.
std::vector<KnownTarget> KnownTargetsOf(std::span<const SightingsOfScan> before);

// The sighted targets with places from a control network, and those that `before` saw, too; among
// these scans the one with the best known pose gives the place, the first of equals.
std::vector<TargetTie> TiesOf(std::span<const Sighting> sighted,
                              std::span<const SightingsOfScan> before);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_SIGHTINGS_H_
