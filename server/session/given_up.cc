#include "server/session/given_up.h"

#include <algorithm>
#include <array>
#include <map>
#include <vector>

#include "server/conversion/to_proto.h"

namespace vantage::session {
namespace {

constexpr size_t kMaxPlaces = 100;

struct Place {
  model::SurfaceKind kind;
  double area = 0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  // centroid * area
};

}  // namespace

void FindGivenUp(const model::PlanningView& model, const Eigen::Vector3d& origin,
                 v1::GetCoverageResponse& response) {
  using Key = std::array<int, 3>;
  struct Cell {
    model::SurfaceKind kind;
    double area;               // m2
    Eigen::Vector3d centroid;  // m, model frame
    bool visited;
  };
  std::map<Key, Cell> cells;
  model.ForEachSurface(
      [&](const model::VoxelIndex& v, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (!surface.given_up) return;
        cells[{v.x(), v.y(), v.z()}] = {model::KindOf(state), static_cast<double>(surface.area),
                                        surface.centroid.cast<double>(), false};
      });
  std::vector<Place> places;
  for (auto& [start, first] : cells) {
    if (first.visited) continue;
    first.visited = true;
    Place place{first.kind};
    std::vector<Key> frontier = {start};
    while (!frontier.empty()) {
      const Key at = frontier.back();
      frontier.pop_back();
      const Cell& cell = cells.at(at);
      place.area += cell.area;
      place.moment += cell.area * cell.centroid;
      for (int n = 0; n < 27; ++n) {
        const auto it = cells.find({at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1});
        if (it == cells.end() || it->second.visited || it->second.kind != place.kind) continue;
        it->second.visited = true;
        frontier.push_back(it->first);
      }
    }
    places.push_back(place);
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const Place& a, const Place& b) { return a.area > b.area; });
  for (size_t i = 0; i < std::min(places.size(), kMaxPlaces); ++i) {
    const Place& place = places[i];
    v1::GivenUpSurface& out = *response.add_given_up();
    *out.mutable_centre() =
        conversion::WriteVector(place.moment / std::max(place.area, 1e-12) + origin);
    out.set_area_m2(place.area);
    out.set_kind(conversion::WriteKind(place.kind));
    out.set_message(place.kind == model::SurfaceKind::kHole
                        ? "scans were expected to measure it and did not: probably glass, mirror "
                          "or black"
                        : "scans looked at it and measured only what is around it: probably a "
                          "crevice, or stray samples");
  }
}

}  // namespace vantage::session
