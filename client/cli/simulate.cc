#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/command.h"
#include "client/cli/file_flags.h"
#include "client/cli/report.h"
#include "client/cli/simulate_fleet.h"
#include "client/cli/table.h"
#include "client/cli/terminal.h"
#include "client/library/duration.h"
#include "client/library/error.h"
#include "client/library/resource_names.h"
#include "client/picture/palette.h"
#include "client/simulated_job/cycle_picture.h"
#include "client/simulated_job/simulated_fleet.h"
#include "client/simulated_job/simulated_job.h"
#include "core/parallel/thread_pool.h"
#include "core/sensor/presets.h"

namespace vantage::cli {
namespace {

constexpr int kFleetScans = 200;  // of all scanners, at most

constexpr double kOfficeArea = 250;  // m^2

constexpr double kPreview = 0.25;  // degrees between the rays of a preset's scans

const std::map<std::string, simulated_job::SceneKind>& Scenes() {
  static const auto* kScenes = new std::map<std::string, simulated_job::SceneKind>{
      {"flat", simulated_job::SceneKind::kFlat},
      {"two-rooms", simulated_job::SceneKind::kTwoRooms},
      {"hall", simulated_job::SceneKind::kHall},
      {"office", simulated_job::SceneKind::kOffice},
      {"house", simulated_job::SceneKind::kHouse},
      {"facade", simulated_job::SceneKind::kFacade},
      {"courtyard", simulated_job::SceneKind::kCourtyard},
      {"street", simulated_job::SceneKind::kStreet},
      {"slope", simulated_job::SceneKind::kSlope}};
  return *kScenes;
}

struct SimulateArguments {
  std::string scene = "flat";
  std::optional<double> area;
  std::string mesh;
  confinement::AllowanceSettings reader;  // of the mesh
  std::vector<double> start;
  uint64_t seed = 1;
  simulated_job::JobOptions job;
  std::optional<int> scans;
  std::optional<int> scanners;
  bool independent = false;
  double speed = simulated_job::FleetOptions().speed;
  double scan_seconds = simulated_job::FleetOptions().scan_seconds;
  // Of the scanner; absent: as of the preset, without one as of the default scanner.
  std::string preset;
  int late = 0;
  std::string setting;
  std::optional<double> step;     // degrees
  std::optional<double> preview;  // degrees
  std::optional<double> span;     // degrees
  std::optional<double> range;    // m
  std::optional<double> noise;    // m
  double heading_error = 5;       // degrees
  double tilt = 0.5;              // degrees
  std::string pictures;
  std::optional<uint64_t> work;
  bool no_noise = false;
  bool no_hints = false;
};

// The columns of the report; widths are fixed, since rows come one by one.
struct ReportColumn {
  const char* name;
  size_t width;
};
constexpr ReportColumn kColumns[] = {{"scan", 4},
                                     {"position, m", 20},
                                     {"aligned", 10},
                                     {"bound", 7},
                                     {"off", 7},
                                     {"covered", 7},
                                     {"true", 6},
                                     {"seen", 6},
                                     {"model gain", 10},
                                     {"score", 15},
                                     {"verdict", 10},
                                     {"send", 5},
                                     {"align", 5},
                                     {"carve", 5},
                                     {"merge", 5},
                                     {"A", 5},
                                     {"B", 5},
                                     {"C", 5},
                                     {"D", 5},
                                     {"E", 5},
                                     {"F", 5}};

constexpr char kLegend[] =
    "scan: made at position (m, world); aligned: its verdict; bound: its error bound at 95 %; off: "
    "how far from the truth it is\n"
    "covered: at the required density, the planner's estimate; true: the same by the ground truth; "
    "seen: measured at all, by the ground truth\n"
    "model gain: m\u00b2 that the next position promises to bring to density; score: its samples, "
    "with bounds; verdict: whether it will register\n"
    "seconds: send, align, carve, merge; A feasible views, B patches, C their ranks, D evaluate, E "
    "rank, F registration check\n";

std::string Row(const std::vector<std::string>& cells) {
  std::string line;
  for (size_t i = 0; i < std::size(kColumns); ++i) {
    const std::string& cell = i < cells.size() ? cells[i] : "";
    const bool text = i == 1 || i == 2 || i == 10;
    if (i > 0) line += "  ";
    line += text ? PadRight(cell, kColumns[i].width) : PadLeft(cell, kColumns[i].width);
  }
  line.erase(line.find_last_not_of(' ') + 1);
  return line + "\n";
}

std::string Header() {
  std::vector<std::string> names;
  for (const ReportColumn& column : kColumns) names.emplace_back(column.name);
  return Row(names);
}

std::string CycleRow(const simulated_job::Cycle& cycle) {
  const v1::PlanResult& plan = cycle.plan.result();
  const v1::Registration& registration = cycle.scan.registration();
  const bool first = cycle.number == 1;
  std::vector<std::string> cells = {
      absl::StrCat(cycle.number),
      absl::StrFormat("%.2f, %.2f, %.2f", cycle.planned.x(), cycle.planned.y(), cycle.planned.z()),
      first           ? "first"
      : !cycle.merged ? "lost"
                      : Word(registration.verdict().outcome()),
      first ? "" : Length(registration.verdict().error_bound_m()),
      cycle.merged && !first ? Length(cycle.off_metres) : "",
      plan.coverage().has_estimated_coverage()
          ? absl::StrFormat("%.1f %%", plan.coverage().estimated_coverage() * 100)
          : "",
      absl::StrFormat("%.1f %%", cycle.truth.at_density_share() * 100),
      absl::StrFormat("%.1f %%", cycle.truth.seen_share() * 100)};
  const v1::RankedView* next = !plan.views().empty()     ? &plan.views(0)
                               : !plan.refused().empty() ? &plan.refused(0)
                                                         : nullptr;
  if (next != nullptr) {
    const bool told = next->exact() && simulated_job::PromiseOf(*next).has_value();
    cells.push_back(told ? absl::StrFormat("%.1f", next->model_gain_m2()) : "");
    cells.push_back(absl::StrFormat("%.0f..%.0f", next->score_lower(), next->score_upper()));
    cells.push_back(next->has_verdict() ? Word(next->verdict().outcome()) : "not checked yet");
  } else {
    cells.insert(cells.end(), {"", "", "no view"});
  }
  for (const double seconds : {cycle.send_seconds, client::SecondsOf(registration.duration()),
                               client::SecondsOf(cycle.scan.merge().carve_duration()),
                               client::SecondsOf(cycle.scan.merge().merge_duration())}) {
    cells.push_back(absl::StrFormat("%.2f", seconds));
  }
  for (const v1::StageDuration& stage : plan.stage_durations()) {
    cells.push_back(absl::StrFormat("%.2f", client::SecondsOf(stage.duration())));
  }
  return Row(cells);
}

absl::StatusOr<simulated_job::Site> ChooseSite(const SimulateArguments& arguments) {
  std::optional<Eigen::Vector3d> start;
  if (arguments.start.size() == 3) {
    start.emplace(arguments.start[0], arguments.start[1], arguments.start[2]);
  }
  if (!arguments.mesh.empty()) {
    return simulated_job::MeshSite(arguments.mesh, start, arguments.reader);
  }
  const simulated_job::SceneKind kind = Scenes().at(arguments.scene);
  if (arguments.area && kind != simulated_job::SceneKind::kOffice) {
    return client::WithFix(
        absl::InvalidArgumentError("only an office storey has an area to choose"),
        "add --scene office, or leave --area out");
  }
  return simulated_job::GeneratedSite(kind, arguments.seed, arguments.area.value_or(kOfficeArea),
                                      start);
}

absl::StatusOr<simulated_job::JobOptions> OptionsFrom(const SimulateArguments& arguments) {
  simulated_job::JobOptions options = arguments.job;
  if (!arguments.preset.empty()) {
    const auto preset = sensor::FindPreset(arguments.preset);
    if (!preset.ok()) return preset.status();
    const auto setting = preset->Setting(arguments.setting);
    if (!setting.ok()) return setting.status();
    const double positioning_error = options.scanner.positioning_error;
    options.scanner = preset->At(*setting);
    options.scanner.positioning_error = positioning_error;
    options.preset = preset->name;
    options.setting = setting->name;
    options.preview = sensor::Radians(kPreview);
  }
  if (arguments.preview) options.preview = sensor::Radians(*arguments.preview);
  options.seed = arguments.seed;
  options.late = arguments.late;
  options.max_scans =
      arguments.scans.value_or(arguments.scanners ? kFleetScans : options.max_scans);
  options.scanner.name = "simulated";
  if (arguments.step) {
    options.scanner.azimuth_step = options.scanner.elevation_step =
        sensor::Radians(*arguments.step);
  }
  if (arguments.span) options.scanner.azimuth_span = sensor::Radians(*arguments.span);
  if (arguments.range) options.scanner.range_max = *arguments.range;
  if (arguments.noise) options.scanner.range_noise = *arguments.noise;
  options.heading_error = sensor::Radians(arguments.heading_error);
  options.tilt = sensor::Radians(arguments.tilt);
  options.plan_work = arguments.work;
  options.full_plans = !arguments.pictures.empty() && !arguments.scanners;
  if (arguments.no_noise) options.faults = simulation::ScanFaults::None();
  return options;
}

// The scanner and its steps, '... at 0.25 degrees'.
std::string Instrument(const simulated_job::JobOptions& options) {
  std::string words;
  if (!options.preset.empty()) words = absl::StrCat(options.preset, " at ", options.setting, ", ");
  absl::StrAppendFormat(&words, "%.3g\u00b0", sensor::Degrees(options.scanner.azimuth_step));
  if (options.preview > options.scanner.azimuth_step) {
    absl::StrAppendFormat(&words, " (by a ray each %.3g\u00b0)", sensor::Degrees(options.preview));
  }
  return words;
}

// Suggests the next commands to a new user.
void PrintHints(const Environment& environment, const SimulateArguments& arguments,
                const std::string& session) {
  if (arguments.no_hints) return;
  const std::string id = client::IdOf(session);
  const std::string server = environment.connection.server == client::ClientOptions().server
                                 ? ""
                                 : "--server " + environment.connection.server + " ";
  std::printf(
      "Try next:\n"
      "  vantage %sscan list %s\n"
      "  vantage %splan %s --budget 5\n"
      "  vantage %sexport %s --format surface-ply -o %s.ply\n"
      "  vantage %ssimulate --scene flat --seed %llu --pictures another\n",
      server.c_str(), id.c_str(), server.c_str(), id.c_str(), server.c_str(), id.c_str(),
      id.c_str(), server.c_str(), static_cast<unsigned long long>(arguments.seed + 1));
}

absl::StatusOr<ExitCode> RunSimulate(Environment& environment, const SimulateArguments& arguments) {
  if (!arguments.pictures.empty()) {
    std::error_code error;
    std::filesystem::create_directories(arguments.pictures, error);
    if (error) {
      return client::WithFix(
          absl::PermissionDeniedError(
              absl::StrCat("cannot make the folder ", arguments.pictures, ": ", error.message())),
          "name another one with --pictures");
    }
  }
  client::Client& client = environment.client();
  // Checks that there is a server before the scene is built.
  if (const auto health = client.CheckHealth(""); !health.ok()) return health.status();

  ProgressLine line(30);
  line.Show("building the scene");
  const auto site = ChooseSite(arguments);
  if (!site.ok()) return site.status();
  const auto chosen = OptionsFrom(arguments);
  if (!chosen.ok()) return chosen.status();
  const simulated_job::JobOptions& options = *chosen;
  parallel::ThreadPool pool(static_cast<int>(std::max(1u, std::thread::hardware_concurrency())));
  if (arguments.scanners) {
    line.Clear();
    simulated_job::FleetOptions fleet;
    fleet.job = options;
    fleet.scanners = *arguments.scanners;
    fleet.claims = !arguments.independent;
    fleet.speed = arguments.speed;
    fleet.scan_seconds = arguments.scan_seconds;
    const auto result = SimulateFleet(client, *site, fleet, arguments.pictures, pool);
    if (!result.ok()) return result.status();
    PrintHints(environment, arguments, result->session);
    return ExitCode::kOk;
  }
  line.Show("measuring what can be attained");
  simulated_job::SimulatedJob job(client, *site, options, pool);
  job.OnActivity([&](const std::string& what) { line.Show(what); });
  line.Clear();
  std::printf(
      "%s, seed %llu: %s steps over %.0f\u00b0, %.0f samples/m\u00b2 wanted, noise %s, "
      "positioning error %s, heading error %.0f\u00b0\n%s\n%s",
      site->name.c_str(), static_cast<unsigned long long>(arguments.seed),
      Instrument(options).c_str(), sensor::Degrees(options.scanner.azimuth_span),
      options.required_density, Length(options.scanner.range_noise).c_str(),
      Length(options.scanner.positioning_error).c_str(), arguments.heading_error, kLegend,
      Header().c_str());
  std::fflush(stdout);

  std::vector<picture::JobPicture::Station> stations;
  const auto result = job.Run([&](const simulated_job::Cycle& cycle) -> absl::Status {
    line.Clear();
    std::fputs(CycleRow(cycle).c_str(), stdout);
    for (const std::string& note : cycle.notes) std::printf("      %s\n", note.c_str());
    std::fflush(stdout);
    stations.push_back({cycle.number, cycle.planned.head<2>(), cycle.merged});
    if (arguments.pictures.empty()) return absl::OkStatus();
    return simulated_job::WriteCyclePicture(
        client, client::SessionOf(cycle.scan.name()), *site, cycle, stations,
        absl::StrFormat("%s/cycle-%02d.png", arguments.pictures, cycle.number));
  });
  line.Clear();
  if (!result.ok()) return result.status();
  std::printf("\n%s\n%d scans made, %d lost.\n", result->why.c_str(), result->made, result->lost);
  if (!arguments.pictures.empty()) {
    std::printf("Pictures, one per scan: %s/cycle-*.png\n", arguments.pictures.c_str());
  }
  PrintHints(environment, arguments, result->session);
  return ExitCode::kOk;
}

void DefineSimulate(CLI::App& command, SimulateArguments& a) {
  auto* scene =
      command
          .add_option(
              "--scene", a.scene,
              "Generated scene: flat, two-rooms, hall, office, house, facade, courtyard, street "
              "or slope [flat]")
          ->check(CLI::IsMember(Scenes()).description(""));
  command.add_option("--area", a.area, "Of --scene office, m^2 [250]")
      ->check(CLI::Range(100.0, 5000.0));
  command.add_option("--mesh", a.mesh, "Triangle mesh instead, PLY, m, z up")->excludes(scene);
  AddReaderFlags(command, a.reader);
  command.add_option("--start", a.start, "x,y,z of the first scan, m, in the scene's own frame")
      ->delimiter(',')
      ->expected(3)
      ->allow_extra_args(false);
  command.add_option("--seed", a.seed, "Of the generated scene and of all noise [1]");
  command.add_option("--scans", a.scans, "Scans at most [10; 200 with --scanners]")
      ->check(CLI::Range(1, 1000));
  auto* scanners =
      command
          .add_option("--scanners", a.scanners,
                      "So many scanners at once, until 95 % of what can be measured is at density")
          ->check(CLI::Range(1, picture::kDistinctColours));
  command.add_flag("--independent", a.independent, "They claim nothing: each plans for itself")
      ->needs(scanners);
  command.add_option("--speed", a.speed, "Of a scanner that is carried, m/s [1]")
      ->check(CLI::Range(0.01, 10.0))
      ->needs(scanners);
  command.add_option("--scan-seconds", a.scan_seconds, "To set up and scan, s [180]")
      ->check(CLI::Range(0.0, 86400.0))
      ->needs(scanners);
  command.add_option("--session", a.job.session_id, "Id of the session to create");
  auto* preset = command.add_option(
      "--preset", a.preset,
      "A real instrument, such as leica-rtc360; 'vantage scanner presets' lists them");
  preset->take_last();
  command.add_option("--setting", a.setting, "Of the preset [its usual one]")->needs(preset);
  command
      .add_option("--step", a.step, "Angular steps of the scanner, degrees [the preset's, 0.25]")
      ->check(CLI::Range(0.01, 5.0));
  command
      .add_option("--preview", a.preview,
                  "Degrees between the rays of scans, which stand for native ones; 0: all [0.25 "
                  "with a preset, else 0]")
      ->check(CLI::Range(0.0, 5.0));
  command
      .add_option(
          "--span", a.span,
          "Azimuth that the scanner sees, degrees: below 360, plans say where to face [360]")
      ->check(CLI::Range(10.0, 360.0))
      ->excludes(scanners);
  command.add_option("--density", a.job.required_density, "Required density, samples / m^2 [2500]");
  command
      .add_option("--late", a.late,
                  "Scans that are made before the data of one reach the server; their stations "
                  "are told at once [0]")
      ->check(CLI::Range(0, 100));
  command.add_option("--range", a.range, "Farthest range of the scanner, m [the preset's, 20]");
  command.add_option("--noise", a.noise, "Range noise, m, one sigma [the preset's, 0.003]");
  command.add_option("--positioning-error", a.job.scanner.positioning_error,
                     "By how much the tripod misses a position, m per axis [0.05]");
  command.add_option("--heading-error", a.heading_error,
                     "Of the pose prior, degrees, one sigma [5]");
  command
      .add_option("--prior-sigma", a.job.prior_sigma,
                  "The pose priors say that they know the position to this, m, one sigma, as a "
                  "robot's odometry does [they are guesses]")
      ->check(CLI::Range(0.001, 1.0));
  command.add_option("--tilt", a.tilt, "Of the tripod, degrees, one sigma [0.5]");
  command.add_flag("--no-faults", a.no_noise, "No noise, no drop-outs");
  auto* budget = command.add_option("--budget", a.job.plan_seconds, "Time for each plan, s [1]")
                     ->check(CLI::PositiveNumber);
  command.add_option("--work", a.work, "Work for each plan instead, rays: repeatable")
      ->excludes(budget);
  command.add_option("--truth-samples", a.job.truth_samples,
                     "Points on the mesh that true coverage is measured on [40000]");
  command.add_option("--pictures", a.pictures,
                     "Folder for one picture per scan; for the tours, with --scanners");
  command.add_flag("--no-hints", a.no_hints, "Don't say what to try next");
}

}  // namespace

void AddSimulate(CLI::App& parent, Environment& environment) {
  AddCommand<SimulateArguments>(
      parent, environment, "simulate",
      "Digitise a scene with a simulated scanner that goes where the planner says",
      "  vantage simulate --scene flat --seed 7 --pictures pictures\n"
      "  vantage simulate --preset leica-rtc360 --setting 3mm --scans 20\n"
      "  vantage simulate --mesh scene.ply --scans 5 --start 1,2,1.5\n"
      "  vantage simulate --scene office --area 500 --scanners 4 --pictures pictures\n"
      "  vantage simulate --step 1 --density 150 --scans 3      (coarse and quick)",
      DefineSimulate, RunSimulate);
}

}  // namespace vantage::cli
