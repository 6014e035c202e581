#include "client/cli/tour_file.h"

#include "client/cli/file.h"
#include "client/cli/json.h"
#include "vantage/v1/tour.pb.h"

namespace vantage::cli {

absl::StatusOr<std::vector<v1::Vector3>> ReadTourStations(const std::string& path) {
  const auto text = ReadFile(path);
  if (!text.ok()) return text.status();
  v1::Tour tour;
  if (absl::Status read = FromJson(*text, path, tour); !read.ok()) return read;
  std::vector<v1::Vector3> stations;
  for (const v1::TourStop& stop : tour.stops()) stations.push_back(stop.position());
  return stations;
}

}  // namespace vantage::cli
