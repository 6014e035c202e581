// Which of its poses is right for a scan in doubt, by what was scanned since (algorithm.md
// section 9, 'Scans in doubt').
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_SETTLED_DOUBT_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_SETTLED_DOUBT_H_

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/registration/bound/registration_result.h"
#include "core/registration/graph/link.h"

namespace vantage::registration {

// What a scan in the model says of one pose of the scan in doubt.
struct PairAtPose {
  std::string scan;   // its name
  bool came_since{};  // it was not in the model when the scan was judged
  LinkOutcome outcome;
};

// A pose at which a scan in doubt may have been made.
struct DoubtfulPose {
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  std::vector<PairAtPose> pairs;  // of each pose with the same scans, in the same order
};

struct SettledDoubt {
  // Which of the poses is right; absent: none of those that were named, but the aligned one.
  std::optional<size_t> pose;
  std::vector<std::string> agreeing;       // scans that tie it to the model there
  std::vector<std::string> contradicting;  // scans that contradict one of the other poses or more
  Eigen::Vector3d first_pose = Eigen::Vector3d::Zero();  // m, world: where it was aligned at first
  std::string words;
};

// m and rad: poses nearer to each other than that are one. Alignments of one minimum end within a
// centimetre of each other, and rivals lie farther off than that.
inline constexpr double kSettledShift = 0.3;
inline constexpr double kSettledTurn = 0.1;

// `anew`: the scan aligned to the model as it is by now, targets that are known by now included;
// `at_last`: its links to scans in the model where that alignment ended, and `poses`: those that
// its last verdict left open, the aligned one first, with the same scans. Nothing where the doubt
// goes on, which is unless
// - the scan registers by now, by the rules for any other scan: no other pose is left;
// - it registers at one of the poses that were named, where several were: what is found at a third
//   place is a doubt more, not one less;
// - links agree: one at least ties it there (targets do as well), not more scans contradict it
//   there than tie it, and at no other pose these less those are more (targets tell poses apart at
//   which all surfaces are the same).
// Links that agree are no proof by themselves, since what repeats itself agrees with itself
// (consistency.h): they speak against it here, and say what decides.
std::optional<SettledDoubt> SettleDoubt(const RegistrationResult& anew,
                                        std::span<const PairAtPose> at_last,
                                        std::span<const DoubtfulPose> poses);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_SETTLED_DOUBT_H_
