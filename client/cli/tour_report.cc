#include "client/cli/tour_report.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/cli/report.h"
#include "client/cli/table.h"
#include "client/library/duration.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

constexpr int kOpenPlacesShown = 3;

// What is said beside a stop.
std::string Remarks(const v1::TourStop& stop) {
  std::vector<std::string> remarks;
  if (stop.expected()) remarks.push_back("expected");
  if (stop.kept()) remarks.push_back("kept");
  const double wait = client::SecondsOf(stop.wait_duration());
  if (wait > 30) remarks.push_back(absl::StrCat("waits ", HoursAndMinutes(wait)));
  if (stop.verdict().outcome() != v1::REGISTRATION_OUTCOME_REGISTERED) {
    remarks.push_back(absl::StrCat(Word(stop.verdict().outcome()), ": ", stop.verdict().message()));
  }
  if (stop.has_heading_rad()) {
    remarks.push_back(absl::StrFormat("facing %.0f\u00b0", stop.heading_rad() * 180 / M_PI));
  }
  return absl::StrJoin(remarks, "; ");
}

}  // namespace

std::string HoursAndMinutes(double seconds) {
  const auto minutes = static_cast<long>(std::lround(seconds / 60));
  if (minutes < 60) return absl::StrCat(minutes, " min");
  return absl::StrFormat("%d h %02d min", minutes / 60, minutes % 60);
}

std::string TourReport(const v1::Tour& tour) {
  std::set<int> storeys;
  std::set<int> days;
  std::set<std::string> scanners;
  for (const v1::TourStop& stop : tour.stops()) {
    storeys.insert(stop.storey_number());
    days.insert(stop.day_number());
    scanners.insert(stop.scanner());
  }
  std::vector<std::string> headers = {">"};
  if (scanners.size() > 1) headers.emplace_back("scanner");
  if (days.size() > 1) headers.emplace_back(">day");
  headers.insert(headers.end(), {">done", "position"});
  if (storeys.size() > 1) headers.emplace_back(">storey");
  headers.insert(headers.end(), {">way", ">m\u00b2", ">coverage", ">overlap", ">bound", "remarks"});
  Table table(headers);
  for (int i = 0; i < tour.stops_size(); ++i) {
    const v1::TourStop& stop = tour.stops(i);
    std::vector<std::string> cells = {absl::StrCat(i + 1)};
    if (scanners.size() > 1) cells.push_back(client::IdOf(stop.scanner()));
    if (days.size() > 1) cells.push_back(absl::StrCat(stop.day_number() + 1));
    cells.push_back(HoursAndMinutes(client::SecondsOf(stop.end_offset())));
    cells.push_back(Text(stop.position()));
    if (storeys.size() > 1) cells.push_back(absl::StrCat(stop.storey_number()));
    cells.push_back(stop.way_size() > 0 ? absl::StrFormat("%.1f m", stop.way_length_m()) : "");
    cells.push_back(absl::StrFormat("%.1f", stop.area_m2()));
    cells.push_back(Percent(stop.coverage()));
    const bool judged = stop.verdict().overlap_share() > 0;
    cells.push_back(judged ? Percent(stop.verdict().overlap_share()) : "");
    cells.push_back(judged ? Length(stop.verdict().error_bound_m()) : "");
    cells.push_back(Remarks(stop));
    table.Add(cells);
  }
  const bool expected = std::any_of(tour.stops().begin(), tour.stops().end(),
                                    [](const v1::TourStop& stop) { return stop.expected(); });
  std::string text = tour.stops_size() > 0 ? table.ToString() + "\n" : "";
  absl::StrAppend(&text, tour.message(), "\n");
  absl::StrAppendFormat(&text,
                        "  brings     %.1f m\u00b2 to %.0f samples/m\u00b2, from %s to %s of "
                        "what can be\n",
                        tour.area_m2(), tour.required_density_per_m2(),
                        Percent(tour.coverage_before()), Percent(tour.coverage()));
  absl::StrAppendFormat(&text, "  walking    %.0f m in all\n", tour.walk_length_m());
  if (tour.has_least_stop_count()) {
    absl::StrAppendFormat(&text,
                          "  stations   %d of %d places; no choice of these has fewer than "
                          "%d\n",
                          tour.stops_size(), tour.candidate_count(), tour.least_stop_count());
  }
  if (tour.scanner_durations_size() > 1) {
    std::vector<std::string> each;
    for (const auto& duration : tour.scanner_durations()) {
      each.push_back(HoursAndMinutes(client::SecondsOf(duration)));
    }
    absl::StrAppend(&text, "  scanners   ", absl::StrJoin(each, ", "), "\n");
  }
  if (expected) text += "  expected   that a scanner can stand there; it was not seen yet\n";
  if (!tour.reaches_goal()) absl::StrAppend(&text, "  goal       not reached by it\n");
  if (tour.unregistered_count() > 0) {
    absl::StrAppendFormat(&text, "  left out   %d that would not register\n",
                          tour.unregistered_count());
  }
  const int points = tour.worth_size();
  std::vector<std::string> fewer;
  for (int k = points - 2; k >= 0 && fewer.size() < 3; k -= std::max(1, points / 6)) {
    const v1::TourWorth& point = tour.worth(k);
    fewer.push_back(absl::StrFormat(
        "%d %s, %s: %.1f %%", point.scan_count(), point.scan_count() == 1 ? "scan" : "scans",
        HoursAndMinutes(client::SecondsOf(point.duration())), 100 * point.coverage()));
  }
  if (!fewer.empty()) absl::StrAppend(&text, "  with less  ", absl::StrJoin(fewer, "; "), "\n");
  for (int k = 0; k < std::min(tour.open_surfaces_size(), kOpenPlacesShown); ++k) {
    absl::StrAppendFormat(&text, "  %s %.1f m\u00b2 around %s\n",
                          k == 0 ? "open      " : "          ", tour.open_surfaces(k).area_m2(),
                          Text(tour.open_surfaces(k).position()));
  }
  return text;
}

}  // namespace vantage::cli
