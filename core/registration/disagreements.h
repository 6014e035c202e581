// Where a scan at a pose disagrees with the model, as a few places with sizes and words.
#ifndef VANTAGE_CORE_REGISTRATION_DISAGREEMENTS_H_
#define VANTAGE_CORE_REGISTRATION_DISAGREEMENTS_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace vantage::registration {

enum class DisagreementKind : uint8_t { kInEmptySpace, kBehindSurface, kSeenThrough };

// A piece of surface that disagrees.
struct DisagreeingPiece {
  DisagreementKind kind = DisagreementKind::kInEmptySpace;
  Eigen::Vector3d at;                                 // m, world
  Eigen::Vector3f through = Eigen::Vector3f::Zero();  // normal of the known surface that was seen
                                                      // through; in empty space 0
  double area = 0;                                    // m2
};

// A sample of which nothing is known, beside others that are known to lie behind surface: of rays
// through a wall only every other one meets a voxel of it squarely (SurfacePassed()).
struct UnknownPiece {
  Eigen::Vector3d at;  // m, world
  double area = 0;     // m2
};

// Neighbouring pieces that disagree in the same way.
struct Disagreement {
  DisagreementKind kind = DisagreementKind::kInEmptySpace;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // m, world, by area
  Eigen::AlignedBox3d box;                           // m, world
  double area = 0;                                   // m2
  size_t pieces = 0;
  std::string words;  // 'sees through a wall'
};

// The largest groups of neighbouring pieces, at most `most`, by area; those of fewer than three
// pieces or a twentieth of a square metre are left out, which edges leave at any pose. Pieces of a
// kind whose cubes of edge `apart` (m) touch are neighbours. An unknown piece counts with pieces
// behind surface in its cube.
std::vector<Disagreement> GroupDisagreements(std::span<const DisagreeingPiece> pieces,
                                             std::span<const UnknownPiece> unknown, double apart,
                                             size_t most);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_DISAGREEMENTS_H_
