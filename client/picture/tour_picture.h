// The tours of several scanners over the floor plan that they measured: a colour for each scanner,
// its stations numbered in the order in which it made them.
#ifndef VANTAGE_CLIENT_PICTURE_TOUR_PICTURE_H_
#define VANTAGE_CLIENT_PICTURE_TOUR_PICTURE_H_

#include <Eigen/Core>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/picture/canvas.h"
#include "client/picture/column_map.h"

namespace vantage::picture {

struct TourPicture {
  std::string title;
  std::vector<std::string> figures;  // lines under the title

  double voxel_size = 0.05;        // m
  double required_density = 2500;  // D, samples / m^2
  std::vector<SurfaceElement> surfaces;

  struct Stop {
    Eigen::Vector2d position = Eigen::Vector2d::Zero();  // m, model frame
    std::vector<Eigen::Vector2d> way;                    // m, from the stop before; may be empty
    bool merged = true;  // false: the scan was made but could not be joined to the model
  };
  struct Tour {
    std::string label;
    std::vector<Stop> stops;  // in order
  };
  std::vector<Tour> tours;
};

// Never fails: what is not known is not drawn.
Canvas DrawTourPicture(const TourPicture& picture);

// Draws and writes. Errors as Canvas::WritePng.
absl::Status WriteTourPicture(const TourPicture& picture, const std::string& path);

}  // namespace vantage::picture

#endif  // VANTAGE_CLIENT_PICTURE_TOUR_PICTURE_H_
