#include "client/cli/tour_file.h"

#include "absl/strings/str_cat.h"
#include "client/cli/file.h"
#include "client/cli/json.h"
#include "vantage/v1/tour.pb.h"

namespace vantage::cli {

namespace {

absl::StatusOr<v1::Tour> ReadTour(const std::string& path) {
  const auto text = ReadFile(path);
  if (!text.ok()) return text.status();
  v1::Tour tour;
  if (absl::Status read = FromJson(*text, path, tour); !read.ok()) return read;
  return tour;
}

std::vector<v1::Vector3> StationsOf(const v1::Tour& tour) {
  std::vector<v1::Vector3> stations;
  for (const v1::TourStop& stop : tour.stops()) stations.push_back(stop.position());
  return stations;
}

}  // namespace

absl::StatusOr<std::vector<v1::Vector3>> ReadTourStations(const std::string& path) {
  const auto tour = ReadTour(path);
  if (!tour.ok()) return tour.status();
  return StationsOf(*tour);
}

absl::StatusOr<std::vector<v1::Vector3>> ReadTourOfOne(const std::string& path) {
  const auto tour = ReadTour(path);
  if (!tour.ok()) return tour.status();
  for (const v1::TourStop& stop : tour->stops()) {
    if (stop.scanner() == tour->stops(0).scanner()) continue;
    return absl::InvalidArgumentError(absl::StrCat(
        path,
        ": several scanners make this tour, each in a zone of its own; a plan follows the "
        "tour of one: make one with --scanner, or plan for all of them with --scanners"));
  }
  return StationsOf(*tour);
}

}  // namespace vantage::cli
