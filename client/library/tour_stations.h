// The stations of a tour that a plan follows.
#ifndef VANTAGE_CLIENT_LIBRARY_TOUR_STATIONS_H_
#define VANTAGE_CLIENT_LIBRARY_TOUR_STATIONS_H_

#include <cstddef>
#include <span>

#include "vantage/v1/geometry.pb.h"
#include "vantage/v1/plan.pb.h"

namespace vantage::client {

// As many as the contract has it for `Plan.tour_stations`: more than a few days' work.
inline constexpr size_t kMostTourStations = 256;

// The stations that come next, in their order, as many as a plan takes.
void SetTourStations(std::span<const v1::Vector3> stations, v1::Plan& plan);

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_TOUR_STATIONS_H_
