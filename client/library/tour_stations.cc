#include "client/library/tour_stations.h"

#include <algorithm>

namespace vantage::client {

void SetTourStations(std::span<const v1::Vector3> stations, v1::Plan& plan) {
  plan.clear_tour_stations();
  for (const v1::Vector3& station : stations.first(std::min(kMostTourStations, stations.size()))) {
    *plan.add_tour_stations() = station;
  }
}

}  // namespace vantage::client
