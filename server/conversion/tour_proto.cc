#include "server/conversion/tour_proto.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "server/conversion/to_proto.h"

namespace vantage::conversion {
namespace {

constexpr double kMinute = 60;  // s

google::protobuf::Duration WriteMinutes(double minutes) { return WriteDuration(kMinute * minutes); }

}  // namespace

tour::TourRequest ReadTourWish(const v1::TourWish& wish,
                               std::span<const planning::RequiredRegion> regions,
                               const Eigen::Vector3d& origin, contract::Violations& violations) {
  tour::TourRequest request;
  if (wish.has_goal()) request.goal = wish.goal();
  if (wish.has_available_duration()) {
    request.minutes = ReadDuration(wish.available_duration()) / kMinute;
  }
  if (wish.has_available_scan_count()) {
    request.scans = static_cast<size_t>(wish.available_scan_count());
  }
  if (wish.has_day_duration()) request.day = ReadDuration(wish.day_duration()) / kMinute;
  if (wish.has_max_candidate_count()) {
    request.most_candidates = static_cast<size_t>(wish.max_candidate_count());
  }
  for (const v1::Vector3& station : wish.previous_stations()) {
    request.previous.push_back(ReadOwnVector(station) - origin);
  }
  for (int i = 0; i < wish.hours_size(); ++i) {
    const v1::RoomHours& hours = wish.hours(i);
    const auto room = std::find_if(regions.begin(), regions.end(), [&](const auto& region) {
      return region.name == hours.region();
    });
    if (room == regions.end()) {
      violations.Add(
          absl::StrCat("wish.hours[", i, "].region"),
          absl::StrCat("'", hours.region(), "' is none of the session's site_rules.regions"));
      continue;
    }
    tour::OpenHours open;
    open.from = ReadDuration(hours.open_after()) / kMinute;
    if (hours.has_closed_after()) open.until = ReadDuration(hours.closed_after()) / kMinute;
    request.hours.push_back({*room, open});
  }
  return request;
}

v1::Tour WriteTour(const tour::Tour& tour, const std::vector<std::string>& scanners,
                   double required_density, const Eigen::Vector3d& origin) {
  v1::Tour out;
  for (const tour::TourStop& stop : tour.stops) {
    v1::TourStop& written = *out.add_stops();
    *written.mutable_position() = WriteVector(stop.position + origin);
    if (stop.heading.has_value()) written.set_heading_rad(*stop.heading);
    if (stop.scanner < scanners.size()) written.set_scanner(scanners[stop.scanner]);
    written.set_storey_number(stop.storey);
    written.set_expected(stop.expected);
    written.set_kept(stop.kept);
    for (const Eigen::Vector3d& corner : stop.way) {
      *written.add_way() = WriteVector(corner + origin);
    }
    written.set_way_length_m(stop.way_length);
    *written.mutable_wait_duration() = WriteMinutes(stop.wait);
    *written.mutable_start_offset() = WriteMinutes(stop.start);
    *written.mutable_end_offset() = WriteMinutes(stop.end);
    written.set_day_number(stop.day);
    written.set_area_m2(stop.area);
    written.set_coverage(stop.coverage);
    *written.mutable_verdict() = WriteVerdict(stop.verdict);
    for (const size_t before : stop.registers_with) {
      written.add_registers_with_indices(static_cast<int32_t>(before));
    }
  }
  *out.mutable_duration() = WriteMinutes(tour.minutes);
  for (const double minutes : tour.scanner_minutes) {
    *out.add_scanner_durations() = WriteMinutes(minutes);
  }
  out.set_walk_length_m(tour.walked);
  out.set_area_before_m2(tour.area_before);
  out.set_area_m2(tour.area);
  out.set_attainable_area_m2(tour.attainable);
  out.set_out_of_reach_area_m2(tour.out_of_reach);
  out.set_coverage_before(tour.coverage_before);
  out.set_coverage(tour.coverage);
  if (tour.fewest > 0) out.set_least_stop_count(static_cast<int32_t>(tour.fewest));
  out.set_reaches_goal(tour.reaches_goal);
  out.set_candidate_count(static_cast<int32_t>(tour.candidates));
  for (const tour::WorthPoint& point : tour.worth) {
    v1::TourWorth& written = *out.add_worth();
    written.set_scan_count(static_cast<int32_t>(point.scans));
    *written.mutable_duration() = WriteMinutes(point.minutes);
    written.set_area_m2(point.area);
    written.set_coverage(point.coverage);
  }
  for (const tour::OpenPlace& place : tour.open) {
    v1::OpenSurface& written = *out.add_open_surfaces();
    *written.mutable_position() = WriteVector(place.position + origin);
    written.set_area_m2(place.area);
  }
  out.set_unregistered_count(static_cast<int32_t>(tour.not_registering));
  out.set_kept_count(static_cast<int32_t>(tour.kept));
  out.set_ray_count(tour.rays);
  out.set_complete(tour.complete);
  out.set_message(tour.message);
  out.set_required_density_per_m2(required_density);
  return out;
}

}  // namespace vantage::conversion
