#include "client/cli/simulate_fleet.h"

#include <cstdio>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/cli/table.h"
#include "client/cli/terminal.h"
#include "client/simulated_job/fleet_picture.h"

namespace vantage::cli {
namespace {

struct FleetColumn {
  const char* name;
  size_t width;
  bool text;
};
constexpr FleetColumn kFleetColumns[] = {{"scan", 4, false},     {"scanner", 10, true},
                                         {"minute", 6, false},   {"walked", 7, false},
                                         {"waited", 6, false},   {"position, m", 20, true},
                                         {"aligned", 10, true},  {"expected", 8, false},
                                         {"attained", 8, false}, {"seen", 7, false}};

constexpr char kFleetLegend[] =
    "minute: simulated, when the scan is in; walked: m; waited: minutes, for scans that it would "
    "not "
    "register without\n"
    "expected: gain in m\u00b2 that the plan promised; attained: at the required density by the "
    "ground "
    "truth, "
    "of "
    "what some position measures so; seen: measured at all\n";

std::string FleetRow(const std::vector<std::string>& cells) {
  std::string line;
  for (size_t i = 0; i < cells.size(); ++i) {
    if (i > 0) line += "  ";
    line += kFleetColumns[i].text ? PadRight(cells[i], kFleetColumns[i].width)
                                  : PadLeft(cells[i], kFleetColumns[i].width);
  }
  line.erase(line.find_last_not_of(' ') + 1);
  return line + "\n";
}

std::string StopRow(const simulated_job::FleetStop& stop) {
  const simulated_job::MadeScan& made = stop.made;
  return FleetRow(
      {absl::StrCat(stop.order), simulated_job::SimulatedFleet::ScannerId(stop.scanner),
       absl::StrFormat("%.1f", stop.minutes), absl::StrFormat("%.1f", stop.walked),
       stop.waited > 0 ? absl::StrFormat("%.1f", stop.waited) : "",
       absl::StrFormat("%.2f, %.2f, %.2f", made.planned.x(), made.planned.y(), made.planned.z()),
       made.number == 1 ? "first"
       : !made.merged   ? "lost"
                        : Word(made.scan.registration().verdict().outcome()),
       stop.expected_gain ? absl::StrFormat("%.1f", *stop.expected_gain) : "",
       absl::StrFormat("%.1f %%", stop.truth.attained_share() * 100),
       absl::StrFormat("%.1f %%", stop.truth.seen_share() * 100)});
}

Json StopAsJson(const simulated_job::FleetStop& stop) {
  const simulated_job::MadeScan& made = stop.made;
  Json row = {{"scan", stop.order},
              {"scanner", simulated_job::SimulatedFleet::ScannerId(stop.scanner)},
              {"minutes", stop.minutes},
              {"walkedM", stop.walked},
              {"position", {made.planned.x(), made.planned.y(), made.planned.z()}},
              {"merged", made.merged},
              {"attainedShare", stop.truth.attained_share()},
              {"seenShare", stop.truth.seen_share()}};
  if (stop.expected_gain) row["expectedGainM2"] = *stop.expected_gain;
  return row;
}

std::vector<std::string> FleetSummary(const simulated_job::FleetOptions& options,
                                      const simulated_job::FleetResult& result) {
  const std::string target = absl::StrFormat("%.0f %%", options.target * 100);
  return {absl::StrFormat(
              "%s%s: %d scanners, %d scans, %d lost",
              result.target_minutes
                  ? absl::StrFormat("%s after %.1f minutes", target, *result.target_minutes)
                  : absl::StrFormat("%s not reached, %.1f %% after %.1f minutes", target,
                                    result.attained * 100, result.minutes),
              options.claims ? "" : ", without claims", options.scanners, result.made, result.lost),
          absl::StrFormat("Waste: %.1f %% of the surface scanned at density was so already; %d "
                          "claims refused",
                          result.waste * 100, result.claims_refused)};
}

}  // namespace

absl::StatusOr<simulated_job::FleetResult> SimulateFleet(client::Client& client,
                                                         const simulated_job::Site& site,
                                                         const simulated_job::FleetOptions& options,
                                                         const std::string& pictures, bool json,
                                                         parallel::Parallel& parallel) {
  WaitingLine line(30);
  line.Show("measuring what can be attained");
  simulated_job::SimulatedFleet fleet(client, site, options, parallel);
  fleet.OnActivity([&](const std::string& what) { line.Show(what); });
  line.Clear();
  std::vector<std::string> names;
  for (const FleetColumn& column : kFleetColumns) names.emplace_back(column.name);
  if (!json)
    std::printf("%s, seed %llu: %d scanners%s, %.1f m/s, %.0f s a scan\n%s\n%s", site.name.c_str(),
                static_cast<unsigned long long>(options.job.seed), options.scanners,
                options.claims ? "" : " without claims", options.speed, options.scan_seconds,
                kFleetLegend, FleetRow(names).c_str());
  std::fflush(stdout);

  std::vector<simulated_job::FleetStop> stops;
  auto result = fleet.Run([&](const simulated_job::FleetStop& stop) {
    line.Clear();
    stops.push_back(stop);
    if (json) {
      PrintJson(StopAsJson(stop), false);
      return absl::OkStatus();
    }
    std::fputs(StopRow(stop).c_str(), stdout);
    for (const std::string& note : stop.made.notes) std::printf("      %s\n", note.c_str());
    std::fflush(stdout);
    return absl::OkStatus();
  });
  line.Clear();
  if (!result.ok()) return result.status();
  const std::vector<std::string> summary = FleetSummary(options, *result);
  if (json) {
    Json end = {{"session", result->session},  {"why", result->why},
                {"scanCount", result->made},   {"lostCount", result->lost},
                {"minutes", result->minutes},  {"attainedShare", result->attained},
                {"wasteShare", result->waste}, {"claimsRefusedCount", result->claims_refused}};
    if (result->target_minutes) end["targetMinutes"] = *result->target_minutes;
    PrintJson(end, false);
  } else {
    std::printf("\n%s.\n", result->why.c_str());
    for (const std::string& figures : summary) std::printf("%s\n", figures.c_str());
  }
  if (!pictures.empty()) {
    const std::string path = pictures + "/tours.png";
    if (absl::Status drawn = simulated_job::WriteFleetPicture(client, site, *result, stops,
                                                              options.scanners, summary, path);
        !drawn.ok()) {
      return drawn;
    }
    if (!json) std::printf("Tours: %s\n", path.c_str());
  }
  return result;
}

}  // namespace vantage::cli
