#include "client/simulated_job/fleet_picture.h"

#include <Eigen/Geometry>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/picture/tour_picture.h"
#include "client/simulated_job/measured_surface.h"

namespace vantage::simulated_job {
namespace {

std::vector<picture::TourPicture::Tour> ToursOf(const std::vector<FleetStop>& stops, int scanners) {
  std::vector<picture::TourPicture::Tour> tours(static_cast<size_t>(scanners));
  std::vector<double> walked(tours.size(), 0);
  for (const FleetStop& stop : stops) {
    const auto scanner = static_cast<size_t>(stop.scanner);
    const Eigen::Isometry3d T_world_scene = stop.made.T_scene_world.inverse();
    const double floor = stop.made.at.z();
    picture::TourPicture::Stop drawn;
    drawn.position = (T_world_scene * stop.made.at).head<2>();
    drawn.merged = stop.made.merged;
    for (const Eigen::Vector2d& p : stop.way) {
      drawn.way.emplace_back((T_world_scene * Eigen::Vector3d(p.x(), p.y(), floor)).head<2>());
    }
    tours[scanner].stops.push_back(std::move(drawn));
    walked[scanner] += stop.walked;
  }
  for (size_t i = 0; i < tours.size(); ++i) {
    tours[i].label = absl::StrFormat("%s: %d scans, %.0f m walked",
                                     SimulatedFleet::ScannerId(static_cast<int>(i)),
                                     static_cast<int>(tours[i].stops.size()), walked[i]);
  }
  return tours;
}

}  // namespace

absl::Status WriteFleetPicture(client::Client& client, const Site& site, const FleetResult& result,
                               const std::vector<FleetStop>& stops, int scanners,
                               const std::vector<std::string>& summary, const std::string& path) {
  auto surfaces = MeasuredSurfaceOf(client, result.session);
  if (!surfaces.ok()) return surfaces.status();
  v1::GetSessionRequest get;
  get.set_name(result.session);
  const auto got = client.Call(get);
  if (!got.ok()) return got.status();

  picture::TourPicture picture;
  picture.title = absl::StrCat(site.name, ": tours of ", scanners, " scanners");
  picture.figures = summary;
  picture.voxel_size = got->session().model_config().voxel_size_m();
  picture.required_density = got->session().planning_config().required_density_per_m2();
  picture.surfaces = *std::move(surfaces);
  picture.tours = ToursOf(stops, scanners);
  return picture::WriteTourPicture(picture, path);
}

}  // namespace vantage::simulated_job
