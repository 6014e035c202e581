#include <algorithm>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/picture_storey.h"
#include "client/cli/picture_walls.h"
#include "client/cli/terminal.h"
#include "client/cli/tour_file.h"
#include "client/cli/tour_report.h"
#include "client/library/duration.h"
#include "client/library/geometry.h"
#include "client/library/resource_names.h"
#include "client/picture/tour_picture.h"

namespace vantage::cli {
namespace {

struct TourArguments {
  std::string session;
  std::optional<double> budget;
  std::optional<uint64_t> work;
  std::string scanner;
  std::vector<std::string> scanners;
  std::optional<double> goal;
  std::optional<double> minutes;
  std::optional<int> scans;
  std::optional<double> day;
  std::vector<std::string> hours;
  std::string previous;
  std::optional<int> candidates;
  std::vector<std::string> set;
  std::string picture;
  std::string storey;
  bool json = false;
};

constexpr double kMinute = 60;  // s

// ROOM=FROM-UNTIL, minutes; either may be left out.
absl::Status AddHours(const std::string& given, v1::TourWish& wish) {
  const size_t equals = given.rfind('=');
  const size_t dash = equals == std::string::npos ? equals : given.find('-', equals);
  absl::Status wrong = absl::InvalidArgumentError(
      absl::StrCat("--hours '", given,
                   "' is not of the form REGION=FROM-UNTIL, in minutes after the beginning"));
  if (dash == std::string::npos) return wrong;
  v1::RoomHours& hours = *wish.add_hours();
  hours.set_region(given.substr(0, equals));
  const std::string from = given.substr(equals + 1, dash - equals - 1);
  const std::string until = given.substr(dash + 1);
  double minutes = 0;
  if (!from.empty()) {
    if (!absl::SimpleAtod(from, &minutes)) return wrong;
    *hours.mutable_open_after() = client::DurationOf(kMinute * minutes);
  }
  if (!until.empty()) {
    if (!absl::SimpleAtod(until, &minutes)) return wrong;
    *hours.mutable_closed_after() = client::DurationOf(kMinute * minutes);
  }
  return absl::OkStatus();
}

absl::StatusOr<v1::CreateTourRequest> RequestFrom(const TourArguments& arguments) {
  v1::CreateTourRequest request;
  request.set_parent(client::SessionName(arguments.session));
  v1::TourWish& wish = *request.mutable_wish();
  if (arguments.budget) *wish.mutable_time_budget() = client::DurationOf(*arguments.budget);
  if (arguments.work) wish.set_work_limit_rays(*arguments.work);
  wish.set_scanner_model_id(arguments.scanner);
  for (const std::string& id : arguments.scanners) {
    wish.add_scanners(client::ScannerName(arguments.session, id));
  }
  if (arguments.goal) {
    if (!(*arguments.goal > 0 && *arguments.goal <= 1)) {
      return absl::InvalidArgumentError(
          "--goal: a share above 0 and at most 1 is needed, such as 0.97 for 97 %");
    }
    wish.set_goal(*arguments.goal);
  }
  if (arguments.minutes) {
    *wish.mutable_available_duration() = client::DurationOf(kMinute * *arguments.minutes);
  }
  if (arguments.scans) wish.set_available_scan_count(*arguments.scans);
  if (arguments.day) *wish.mutable_day_duration() = client::DurationOf(kMinute * *arguments.day);
  if (arguments.candidates) wish.set_max_candidate_count(*arguments.candidates);
  for (const std::string& hours : arguments.hours) {
    if (absl::Status read = AddHours(hours, wish); !read.ok()) return read;
  }
  if (!arguments.previous.empty()) {
    const auto stations = ReadTourStations(arguments.previous);
    if (!stations.ok()) return stations.status();
    for (const v1::Vector3& station : *stations) *wish.add_previous_stations() = station;
  }
  if (absl::Status set = SetFields(*wish.mutable_config_overrides(), arguments.set); !set.ok()) {
    return set;
  }
  return request;
}

// Over the walls of the storey on which most of the tour lies, or that was asked for.
absl::Status DrawTour(Environment& environment, const TourArguments& arguments,
                      const v1::Tour& tour) {
  client::Client& client = environment.client();
  const std::string session = client::SessionName(arguments.session);
  v1::GetSessionRequest get_session;
  get_session.set_name(session);
  const auto job = client.Call(get_session);
  if (!job.ok()) return job.status();
  v1::GetCoverageRequest get_coverage;
  get_coverage.set_name(session);
  const auto coverage = client.Call(get_coverage);
  if (!coverage.ok()) return coverage.status();
  std::optional<double> first_z;
  if (tour.stops_size() > 0) first_z = tour.stops(0).position().z();
  const auto storey = ChooseStorey(coverage->storeys(), arguments.storey, first_z);
  if (!storey.ok()) return storey.status();
  auto surfaces = WallsOfStorey(client, session, *storey);
  if (absl::IsFailedPrecondition(surfaces.status())) {  // before the first scan: no walls
    surfaces = std::vector<picture::SurfaceElement>();
  }
  if (!surfaces.ok()) return surfaces.status();
  const bool all = !storey->storey.has_value();
  picture::TourPicture picture;
  const std::string& name = job->session().display_name();
  picture.title = name.empty() ? client::IdOf(session) : name;
  picture.figures.push_back(tour.message());
  picture.figures.push_back(
      absl::StrFormat("%.1f m\u00b2 come to %.0f samples/m\u00b2; %.0f m of walking",
                      tour.area_m2(), tour.required_density_per_m2(), tour.walk_length_m()));
  picture.voxel_size = job->session().model_config().voxel_size_m();
  picture.required_density = tour.required_density_per_m2();
  picture.surfaces = *std::move(surfaces);
  const int scanners = std::max(1, static_cast<int>(arguments.scanners.size()));
  for (int s = 0; s < scanners; ++s) {
    const std::string scanner =
        arguments.scanners.empty()
            ? ""
            : client::ScannerName(arguments.session, arguments.scanners[static_cast<size_t>(s)]);
    picture::TourPicture::Tour& drawn = picture.tours.emplace_back();
    int scans = 0;
    for (const v1::TourStop& stop : tour.stops()) {
      if (stop.scanner() != scanner) continue;
      ++scans;
      if (!all && !storey->HasStation(stop.position().z())) continue;
      picture::TourPicture::Stop mark;
      mark.position = client::FromProto(stop.position()).head<2>();
      for (const v1::Vector3& corner : stop.way()) {
        mark.way.push_back(client::FromProto(corner).head<2>());
      }
      mark.merged = !stop.expected();
      drawn.stops.push_back(std::move(mark));
    }
    const double seconds =
        s < tour.scanner_durations_size() ? client::SecondsOf(tour.scanner_durations(s)) : 0;
    drawn.label = absl::StrCat(
        arguments.scanners.empty() ? "" : arguments.scanners[static_cast<size_t>(s)] + ": ", scans,
        scans == 1 ? " scan, " : " scans, ", HoursAndMinutes(seconds));
  }
  return picture::WriteTourPicture(picture, arguments.picture);
}

absl::StatusOr<ExitCode> RunTour(Environment& environment, const TourArguments& arguments) {
  const auto request = RequestFrom(arguments);
  if (!request.ok()) return request.status();
  WaitingLine line;
  line.Show("looking for the first tour");
  const auto tour = environment.client().CreateTour(*request, [&](const v1::Tour& so_far) {
    line.Show(absl::StrCat("so far ", so_far.message()));
  });
  line.Clear();
  if (!tour.ok()) return tour.status();
  if (!arguments.picture.empty()) {
    if (absl::Status drawn = DrawTour(environment, arguments, *tour); !drawn.ok()) return drawn;
  }
  std::fputs(arguments.json ? ToJson(*tour).c_str() : TourReport(*tour).c_str(), stdout);
  if (!arguments.json && !arguments.picture.empty()) {
    std::printf("  drawn      %s\n", arguments.picture.c_str());
  }
  return ExitCode::kOk;
}

}  // namespace

void AddTour(CLI::App& parent, Environment& environment) {
  AddCommand<TourArguments>(
      parent, environment, "tour",
      "The whole job ahead: how many stations, where, in which order, how long",
      "  vantage tour flat\n"
      "  vantage tour flat --scanners red,blue --picture flat-tour.png\n"
      "  vantage tour flat --minutes 45                  (the best that can be done in that time)\n"
      "  vantage tour flat --scans 3 --json\n"
      "  vantage tour flat --hours office=0-120 --day 480\n"
      "  vantage tour flat --json > tour.json; vantage tour flat --previous tour.json",
      [](CLI::App& command, TourArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        auto* model = command.add_option("--scanner", a.scanner,
                                         "Id of the scanner model [the session's first]");
        command
            .add_option("--scanners", a.scanners,
                        "ID,ID,...: these of the fleet work together, each in a zone of its own")
            ->delimiter(',')
            ->excludes(model);
        command.add_option(
            "--goal", a.goal,
            "Share of what can be brought to density that is wanted [what is worth a scan]");
        auto* minutes = command.add_option("--minutes", a.minutes,
                                           "What is left of the day or the battery, min");
        auto* scans =
            command.add_option("--scans", a.scans, "Scans that are left, of all scanners together");
        command.add_option("--day", a.day,
                           "A day's work, min; what is left is done on the next one");
        command
            .add_option("--hours", a.hours,
                        "REGION=FROM-UNTIL, repeatable: when one of the site's regions is open, "
                        "min after the beginning")
            ->allow_extra_args(false);
        command
            .add_option("--previous", a.previous,
                        "FILE: an earlier tour (--json), of which what still pays is kept")
            ->excludes(minutes)
            ->excludes(scans);
        auto* budget = command.add_option("--budget", a.budget, "Time the search may take, s [30]");
        command.add_option("--work", a.work, "Work it may take, rays, instead of time")
            ->excludes(budget);
        command.add_option("--candidates", a.candidates,
                           "Places that stations are chosen from, in each round [1000]");
        command
            .add_option("--set", a.set,
                        "PATH=VALUE, repeatable: planning configuration for this tour only")
            ->allow_extra_args(false);
        command.add_option("--picture", a.picture, "FILE.png: draw it over the walls");
        command.add_option("--storey", a.storey,
                           "In the picture: by number or by name [that of the first station]");
        command.add_flag("--json", a.json, "Print the tour as JSON");
      },
      RunTour);
}

}  // namespace vantage::cli
