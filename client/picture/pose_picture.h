// A scan at each pose at which it may have been made, over the surface that is known: a plan and a
// vertical section of each, for who has to decide between them.
#ifndef VANTAGE_CLIENT_PICTURE_POSE_PICTURE_H_
#define VANTAGE_CLIENT_PICTURE_POSE_PICTURE_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/picture/canvas.h"

namespace vantage::picture {

struct PosePicture {
  std::string title;
  std::vector<std::string> figures;  // lines under the title

  struct Surface {
    Eigen::Vector3d at;      // m
    Eigen::Vector3f normal;  // unit
  };
  std::vector<Surface> surface;  // what is known
  double surface_spacing = 0.1;  // m, of its pieces

  enum class Mark : uint8_t {
    kFits,
    kNothingKnown,
    kFitsNothing,
    kInEmptySpace,
    kBehindSurface,
  };
  struct Sample {
    Eigen::Vector3d at;      // m, at the pose
    Eigen::Vector3f normal;  // unit, at the pose
    double residual = 0;     // m, of those that fit; its sign is not shown
    Mark mark = Mark::kFits;
  };
  // Where a pose contradicts what is known.
  struct Place {
    Eigen::Vector3d centre;   // m
    Eigen::AlignedBox3d box;  // m
    std::string words;
  };
  struct Pose {
    std::string title;
    std::vector<std::string> figures;                   // lines under its title
    Eigen::Vector3d station = Eigen::Vector3d::Zero();  // m
    Eigen::Vector2d ahead = Eigen::Vector2d::UnitX();   // where the scanner's +x points
    std::vector<Sample> samples;
    std::vector<size_t> seen_through;  // pieces of the surface that the scan saw through
    std::vector<Place> places;         // lettered in this order
  };
  std::vector<Pose> poses;

  // Residuals are coloured up to this, and what is larger as this, m.
  double largest_residual = 0.02;
};

// Never fails: what is not there is not drawn.
Canvas DrawPosePicture(const PosePicture& picture);

// Draws and writes. Errors as Canvas::WritePng.
absl::Status WritePosePicture(const PosePicture& picture, const std::string& path);

}  // namespace vantage::picture

#endif  // VANTAGE_CLIENT_PICTURE_POSE_PICTURE_H_
