// The picture of a job after a cycle: one map shows the measured and the missing surface, the other
// the score of the next scan at each place. Positions are numbered.
#ifndef VANTAGE_CLIENT_PICTURE_JOB_PICTURE_H_
#define VANTAGE_CLIENT_PICTURE_JOB_PICTURE_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/picture/canvas.h"
#include "client/picture/column_map.h"

namespace vantage::picture {

struct JobPicture {
  std::string title;
  std::vector<std::string> figures;  // lines under the title

  double voxel_size = 0.05;        // m
  double viewcell_size = 0.10;     // m
  double required_density = 2500;  // D, samples / m^2
  std::vector<SurfaceElement> surfaces;

  struct ScoredPlace {
    Eigen::Vector3f centre;  // m, model frame
    float score = 0;         // samples
  };
  std::vector<ScoredPlace> scores;

  struct Station {
    int number = 0;
    Eigen::Vector2d position = Eigen::Vector2d::Zero();  // m
    bool merged = true;  // false: the scan was made but could not be joined to the model
  };
  std::vector<Station> stations;

  // Ranked candidates, best first: the first is the next position.
  struct Candidate {
    Eigen::Vector2d position = Eigen::Vector2d::Zero();  // m
    std::optional<Eigen::AlignedBox2d> region;           // as good as the candidate
  };
  std::vector<Candidate> candidates;
  std::vector<Eigen::Vector2d> refused;  // candidates that would not register
  double separation = 0.6;               // m, of checked candidates
};

// Never fails: what is not known is not drawn (before the first plan there is no heat map).
Canvas DrawJobPicture(const JobPicture& plan);

// Draws and writes. Errors as Canvas::WritePng.
absl::Status WriteJobPicture(const JobPicture& plan, const std::string& path);

}  // namespace vantage::picture

#endif  // VANTAGE_CLIENT_PICTURE_JOB_PICTURE_H_
