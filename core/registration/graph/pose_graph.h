// The scans of a job and what ties their poses to each other: the graph that is adjusted when a
// loop closes or a control target comes in (algorithm.md section 9, 'The pose graph').
//
// A pose's error is [rotation about the axes of the frame that the pose leads to, rad; translation,
// m], about the scanner, as that of sensor::PosePrior is: the true pose is (exp(w) R, p + t).
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_POSE_GRAPH_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_POSE_GRAPH_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "core/registration/align/targets.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

// A pose that something else than scans says: a trusted pose, a total station, a control network.
struct AbsolutePose {
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  // Of the error of T_world_scan; 0 along directions of which it says nothing. Symmetric, positive
  // semidefinite.
  sensor::Matrix6d information = sensor::Matrix6d::Zero();
};

// What an inclinometer says.
struct InclinometerReading {
  Eigen::Vector3d up_in_scan = Eigen::Vector3d::UnitZ();  // unit, scanner frame
  double sigma = 0;                                       // rad, of either tilt, > 0
};

struct ScanNode {
  std::string id;  // of the scan; not empty, and no other node has it
  // As registered. Of a node that is neither fixed nor the one that its component is held by, it is
  // no evidence and does not enter the adjusted poses.
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  bool fixed = false;  // it stays where it is, to the bit
  std::vector<AbsolutePose> absolute;
  std::vector<TargetTie> targets;
  std::optional<InclinometerReading> inclinometer;

  // Whether anything but other scans says where it is.
  bool Tied() const { return fixed || !absolute.empty() || !targets.empty(); }
};

// Where a link comes from.
enum class LinkOrigin : uint8_t {
  kSurfaces,  // what both scans see, from poses that registration found (LinkScans())
  kStated,    // an odometer, a vendor's registration, a person
  kRival,     // another pose at which one of them fits
  kModel,     // registration of one of them to the model of all before it (WithModelLinks())
};

// What ties two scans. Canonical links have a < b.
struct ScanLink {
  std::string a;  // ids of nodes; not the same
  std::string b;
  Eigen::Isometry3d T_a_b = Eigen::Isometry3d::Identity();  // b's frame to a's, m
  // Of the error of T_a_b, in a's frame and about b's scanner; 0 along directions of which it says
  // nothing. Symmetric, positive semidefinite.
  sensor::Matrix6d information = sensor::Matrix6d::Zero();
  LinkOrigin origin = LinkOrigin::kSurfaces;
  // It counts only where consistency with others decides so (DecideLinks()).
  bool in_doubt = false;
};

// The same tie, seen from b.
ScanLink Reversed(const ScanLink& link);

// Scans that are adjusted together at most: sites of 20,000 m2 have some hundreds. It bounds memory
// and time.
inline constexpr size_t kMostAdjustedScans = 2000;

// A set of scans and links in an order of their own, which does not depend on the order in which
// they came. A value; immutable.
class PoseGraph {
 public:
  // INVALID_ARGUMENT names the first node or link (in canonical order) that is not valid: an id
  // that is empty, unknown or there twice; a pose that is not finite, not rigid or farther than
  // kFarthest from the origin; information that is not finite, symmetric and positive semidefinite
  // or larger than kMostInformation; a target or an inclinometer reading that is not valid. Two
  // links between the same scans are valid, and so is a graph in several pieces or without nodes.
  static absl::StatusOr<PoseGraph> Create(std::vector<ScanNode> nodes, std::vector<ScanLink> links);

  // m. Sites are told apart from typing errors: earth-centred coordinates have to be shifted before
  // they come here, since doubles would hold 1 nm of them and angles times metres would not.
  static constexpr double kFarthest = 1e6;
  // 1/m^2 and 1/rad^2: of a sigma of 1 nm.
  static constexpr double kMostInformation = 1e18;

  const std::vector<ScanNode>& nodes() const { return nodes_; }  // by id
  // By a, b, origin, doubt, pose and information; a < b in each.
  const std::vector<ScanLink>& links() const { return links_; }
  // The node of an id that is there; of another id, where it would be.
  size_t IndexOf(std::string_view id) const;
  // Of links()[i].
  size_t NodeA(size_t link) const { return ends_[link].a; }
  size_t NodeB(size_t link) const { return ends_[link].b; }

  // For each node the number of its component, from 0 in canonical order: nodes hang together by
  // links that are not in doubt and have any information.
  std::vector<size_t> Components() const;

  // The same graph with those links, by index, that `keep` marks (as many as there are links); none
  // of them is in doubt any more.
  PoseGraph WithLinks(const std::vector<bool>& keep) const;

 private:
  struct Ends {
    size_t a = 0;
    size_t b = 0;
  };
  void FindEnds();

  std::vector<ScanNode> nodes_;
  std::vector<ScanLink> links_;
  std::vector<Ends> ends_;
};

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_POSE_GRAPH_H_
