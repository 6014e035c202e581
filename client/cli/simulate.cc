#include <algorithm>
#include <chrono>
#include <cmath>
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
#include "client/cli/completion_words.h"
#include "client/cli/file.h"
#include "client/cli/file_flags.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/cli/simulate_fleet.h"
#include "client/cli/table.h"
#include "client/cli/terminal.h"
#include "client/library/duration.h"
#include "client/library/error.h"
#include "client/library/resource_names.h"
#include "client/picture/palette.h"
#include "client/simulated_job/cycle_picture.h"
#include "client/simulated_job/oracle_route.h"
#include "client/simulated_job/simulated_fleet.h"
#include "client/simulated_job/simulated_job.h"
#include "client/simulated_job/walk_map.h"
#include "client/study/job_page.h"
#include "core/parallel/thread_pool.h"
#include "core/sensor/presets.h"

namespace vantage::cli {
namespace {

constexpr int kFleetScans = 200;  // of all scanners, at most

constexpr double kOfficeArea = 250;  // m^2

constexpr int kUntilDoneScans = 100;
constexpr uint64_t kLastPlanFactor = 10;        // of a plan's work, where that is limited
constexpr uint64_t kLastPlanWork = 80'000'000;  // rays: enough to look at a flat's views

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

std::vector<std::string> SceneNames() {
  std::vector<std::string> names;
  for (const auto& [name, kind] : Scenes()) names.push_back(name);
  return names;
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
  std::string prior;  // of the site
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
  bool json = false;
  bool oracle = false;
  bool until_done = false;
  std::optional<double> worth;  // m^2
  std::string compare;          // file that --oracle --json wrote
  std::string page_link;        // on the page
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

std::string Aligned(const simulated_job::Cycle& cycle) {
  if (cycle.number == 1) return "first";
  return cycle.merged ? Word(cycle.scan.registration().verdict().outcome()) : "lost";
}

std::string CycleRow(const simulated_job::Cycle& cycle) {
  const v1::PlanResult& plan = cycle.plan.result();
  const v1::Registration& registration = cycle.scan.registration();
  const bool first = cycle.number == 1;
  std::vector<std::string> cells = {
      absl::StrCat(cycle.number),
      absl::StrFormat("%.2f, %.2f, %.2f", cycle.planned.x(), cycle.planned.y(), cycle.planned.z()),
      Aligned(cycle),
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
  if (arguments.prior == "mesh") options.site_prior = simulated_job::ScenePriorKind::kTrue;
  if (arguments.prior == "plan") options.site_prior = simulated_job::ScenePriorKind::kPlan;
  if (arguments.prior == "wrong") options.site_prior = simulated_job::ScenePriorKind::kWrong;
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
  if (arguments.worth) options.plan_overrides.set_terminate_below_m2(*arguments.worth);
  if (arguments.until_done) {
    options.last_plan_work = arguments.work ? kLastPlanFactor * *arguments.work : kLastPlanWork;
    options.max_scans = arguments.scans.value_or(kUntilDoneScans);
  }
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
  if (arguments.no_hints || arguments.json) return;
  const std::string id = client::IdOf(session);
  const std::string server = environment.ServerFlags();
  std::printf(
      "Try next:\n"
      "  vantage %sscan list %s\n"
      "  vantage %splan %s --budget 5\n"
      "  vantage %sexport %s --format surface-ply -o %s.ply\n"
      "  vantage %ssimulate --scene flat --seed %llu --pictures another\n",
      server.c_str(), id.c_str(), server.c_str(), id.c_str(), server.c_str(), id.c_str(),
      id.c_str(), server.c_str(), static_cast<unsigned long long>(arguments.seed + 1));
}

// As in a study: what a scan costs a crew on site.
constexpr double kWalkingSpeed = 0.5;  // m/s, with the tripod
constexpr double kSetUpMinutes = 1;

double ScanMinutes(const simulated_job::JobOptions& options) {
  constexpr double kOfNoMake = 2;
  if (options.preset.empty()) return kOfNoMake;
  const auto preset = sensor::FindPreset(options.preset);
  if (!preset.ok()) return kOfNoMake;
  const auto setting = preset->Setting(options.setting);
  return setting.ok() ? setting->minutes : kOfNoMake;
}

// Tells a simulated job as it goes: a row for each scan, or a line of JSON, and what the page is
// made of.
class Telling {
 public:
  Telling(const simulated_job::Site& site, const simulated_job::JobOptions& options, bool json,
          const std::string& pictures)
      : tracer_(site.mesh),
        walks_(tracer_, site),
        scan_minutes_(ScanMinutes(options)),
        json_(json),
        pictures_(pictures) {}

  void Hear(const simulated_job::Cycle& cycle) {
    minutes_ += kSetUpMinutes + scan_minutes_;
    if (stood_) minutes_ += walks_.Distance(*stood_, cycle.at) / kWalkingSpeed / 60;
    stood_ = cycle.at;
    for (const simulated_job::TriedPlace& tried : cycle.tried) {
      if (!tried.free) minutes_ += simulated_job::kNoFreeSpotMinutes;
    }
    study::JobPage::Scan scan;
    scan.number = cycle.number;
    scan.position = absl::StrFormat("%.2f, %.2f, %.2f", cycle.planned.x(), cycle.planned.y(),
                                    cycle.planned.z());
    scan.aligned = Aligned(cycle);
    scan.minutes = minutes_;
    scan.attained = cycle.truth.attained_share();
    // No plan follows a scan that came late.
    if (cycle.plan.result().coverage().has_estimated_coverage()) {
      scan.estimated = cycle.plan.result().coverage().estimated_coverage();
    }
    if (!pictures_.empty()) scan.picture = PictureName(cycle.number);
    scans_.push_back(scan);
    if (json_) {
      PrintJson(AsJson(cycle), false);
      return;
    }
    std::fputs(CycleRow(cycle).c_str(), stdout);
    for (const std::string& note : cycle.notes) std::printf("      %s\n", note.c_str());
    std::fflush(stdout);
  }

  static std::string PictureName(int number) { return absl::StrFormat("cycle-%02d.png", number); }

  double minutes() const { return minutes_; }
  const std::vector<study::JobPage::Scan>& scans() const { return scans_; }

 private:
  Json AsJson(const simulated_job::Cycle& cycle) const {
    const v1::PlanResult& plan = cycle.plan.result();
    Json row = {{"scan", cycle.number},
                {"position", {cycle.planned.x(), cycle.planned.y(), cycle.planned.z()}},
                {"aligned", Aligned(cycle)},
                {"minutes", minutes_},
                {"attainedShare", cycle.truth.attained_share()},
                {"atDensityShare", cycle.truth.at_density_share()},
                {"seenShare", cycle.truth.seen_share()}};
    if (cycle.merged && cycle.number > 1) {
      row["errorBoundM"] = cycle.scan.registration().verdict().error_bound_m();
      row["offM"] = cycle.off_metres;
    }
    if (plan.coverage().has_estimated_coverage()) {
      row["estimatedCoverage"] = plan.coverage().estimated_coverage();
    }
    if (!plan.views().empty()) {
      const v1::RankedView& next = plan.views(0);
      row["next"] = {{"position", {next.position().x(), next.position().y(), next.position().z()}},
                     {"expectedGainM2", next.expected_gain_m2()},
                     {"scoreLower", next.score_lower()},
                     {"scoreUpper", next.score_upper()}};
    }
    row["notes"] = cycle.notes;
    return row;
  }

  simulation::SimulatedScanner tracer_;
  simulated_job::WalkMap walks_;
  const double scan_minutes_;
  const bool json_;
  const std::string pictures_;
  double minutes_ = 0;                    // on site
  std::optional<Eigen::Vector3d> stood_;  // m, scene frame
  std::vector<study::JobPage::Scan> scans_;
};

// What the job is of, so that an oracle's curve is only drawn beside a job that it is the oracle
// of.
Json Identity(const simulated_job::Site& site, const simulated_job::JobOptions& options) {
  return {{"site", site.name},
          {"start", {site.start.x(), site.start.y(), site.start.z()}},
          {"instrument", Instrument(options)},
          {"requiredDensityPerM2", options.required_density}};
}

// The share attained after each scan, in a file that `--oracle` wrote; nothing, which is said,
// where it is another job's.
absl::StatusOr<std::vector<double>> ReadOracle(const std::string& path, const Json& identity) {
  const auto text = ReadFile(path);
  if (!text.ok()) return text.status();
  const Json read = Json::parse(*text, nullptr, false);
  const auto refused = [&](const char* what) {
    return client::WithFix(absl::InvalidArgumentError(absl::StrCat(path, " ", what)),
                           "write it anew with 'vantage simulate --oracle --json'");
  };
  if (!read.is_object() || !read.contains("job") || !read.contains("attainedShares") ||
      !read["attainedShares"].is_array()) {
    return refused("is not what '--oracle --json' writes");
  }
  if (read["job"] != identity) {
    std::fprintf(stderr, "%s is the oracle of another job, and is not shown\n", path.c_str());
    return std::vector<double>();
  }
  std::vector<double> shares;
  for (const Json& share : read["attainedShares"]) {
    if (!share.is_number()) return refused("has a share that is no number");
    shares.push_back(share.get<double>());
  }
  return shares;
}

// Follows who knows the scene, without a server.
absl::StatusOr<ExitCode> RunOracle(const SimulateArguments& arguments,
                                   const simulated_job::Site& site,
                                   const simulated_job::JobOptions& options,
                                   parallel::Parallel& parallel) {
  WaitingLine line(30);
  line.Show("measuring what can be attained");
  Json shares = Json::array();
  const absl::Status followed = simulated_job::FollowOracle(
      site, options, parallel, [&](const simulated_job::OracleScan& scan) {
        shares.push_back(std::round(1e4 * scan.truth.attained_share()) / 1e4);
        line.Clear();
        if (!arguments.json) {
          std::printf(
              "%4d  %20s  attained %5.1f %%  brought %6.1f m\u00b2\n", scan.number,
              absl::StrFormat("%.2f, %.2f, %.2f", scan.at.x(), scan.at.y(), scan.at.z()).c_str(),
              100 * scan.truth.attained_share(), scan.gain);
          std::fflush(stdout);
        }
        line.Show(absl::StrFormat("looking for the truly best place for scan %d", scan.number + 1));
      });
  line.Clear();
  if (!followed.ok()) return followed;
  if (arguments.json) {
    PrintJson({{"job", Identity(site, options)}, {"attainedShares", std::move(shares)}});
  }
  return ExitCode::kOk;
}

// What was reached and in how long, a sentence each.
std::vector<std::string> Reached(const Telling& telling, const simulated_job::JobResult& result,
                                 double seconds) {
  std::vector<std::string> facts;
  if (!telling.scans().empty()) {
    const study::JobPage::Scan& last = telling.scans().back();
    facts.push_back(absl::StrFormat(
        "Reached: %.1f %% of the surface that can be measured at density is%s.",
        100 * last.attained,
        last.estimated
            ? absl::StrFormat("; the planner takes it for %.1f %%", 100 * *last.estimated)
            : ""));
  }
  facts.push_back(absl::StrFormat(
      "In: %d scans, %d lost; %.0f minutes on site (walking, setting up, scanning), simulated in "
      "%.0f s.",
      result.made, result.lost, telling.minutes(), seconds));
  return facts;
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
  if (!arguments.oracle) {
    if (const auto health = client.CheckHealth(""); !health.ok()) return health.status();
  }

  const auto began = std::chrono::steady_clock::now();
  const auto seconds = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  };
  WaitingLine line(30);
  line.Show("building the scene");
  const auto site = ChooseSite(arguments);
  if (!site.ok()) return site.status();
  const auto chosen = OptionsFrom(arguments);
  if (!chosen.ok()) return chosen.status();
  const simulated_job::JobOptions& options = *chosen;
  parallel::ThreadPool pool(static_cast<int>(std::max(1u, std::thread::hardware_concurrency())));
  if (arguments.oracle) {
    line.Clear();
    return RunOracle(arguments, *site, options, pool);
  }
  if (arguments.scanners) {
    line.Clear();
    simulated_job::FleetOptions fleet;
    fleet.job = options;
    fleet.scanners = *arguments.scanners;
    fleet.claims = !arguments.independent;
    fleet.speed = arguments.speed;
    fleet.scan_seconds = arguments.scan_seconds;
    const auto result =
        SimulateFleet(client, *site, fleet, arguments.pictures, arguments.json, pool);
    if (!result.ok()) return result.status();
    PrintHints(environment, arguments, result->session);
    return ExitCode::kOk;
  }
  line.Show("measuring what can be attained");
  simulated_job::SimulatedJob job(client, *site, options, pool);
  Telling telling(*site, options, arguments.json, arguments.pictures);
  std::vector<double> oracle;
  if (!arguments.compare.empty()) {
    auto read = ReadOracle(arguments.compare, Identity(*site, options));
    if (!read.ok()) return read.status();
    oracle = *std::move(read);
  }
  double begun = 0;  // s, with the first scan
  job.OnActivity([&](const std::string& what) {
    const size_t made = telling.scans().size();
    if (begun == 0) begun = seconds();
    if (made == 0) return line.Show(what);
    const double each = (seconds() - begun) / static_cast<double>(made);
    line.Show(absl::StrFormat(
        "%s; %.1f s a scan%s", what, each,
        // When the planner says that it is enough, nobody knows before.
        arguments.until_done
            ? ""
            : absl::StrCat(", at most ",
                           TimeLeft(each * (options.max_scans - static_cast<double>(made))))));
  });
  line.Clear();
  if (!arguments.json)
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
    telling.Hear(cycle);
    stations.push_back({cycle.number, cycle.planned.head<2>(), cycle.merged});
    if (arguments.pictures.empty()) return absl::OkStatus();
    return simulated_job::WriteCyclePicture(
        client, client::SessionOf(cycle.scan.name()), *site, cycle, stations,
        absl::StrCat(arguments.pictures, "/", Telling::PictureName(cycle.number)));
  });
  line.Clear();
  if (!result.ok()) return result.status();
  const std::vector<std::string> reached = Reached(telling, *result, seconds());
  if (!arguments.pictures.empty()) {
    study::JobPage page;
    page.title = absl::StrCat(site->name, " with ",
                              options.preset.empty() ? Instrument(options) : options.preset);
    page.facts = {absl::StrCat("Ended: ", result->why)};
    page.facts.insert(page.facts.end(), reached.begin(), reached.end());
    page.scans = telling.scans();
    page.oracle = oracle;
    page.oracle_words =
        "The oracle knows the scene: each of its scans is made at the place that truly brings "
        "most, "
        "and its poses are given. Nobody who has to find out can do better by more than chance.";
    page.link = arguments.page_link;
    AtomicFile file(absl::StrCat(arguments.pictures, "/index.html"));
    if (absl::Status s = file.Append(study::Html(page)); !s.ok()) return s;
    if (absl::Status s = file.Commit(); !s.ok()) return s;
  }
  if (arguments.json) {
    PrintJson({{"session", result->session},
               {"why", result->why},
               {"plannerStopped", result->planner_stopped},
               {"scanCount", result->made},
               {"lostCount", result->lost},
               {"minutes", telling.minutes()},
               {"seconds", seconds()},
               {"attainedShare", telling.scans().empty() ? 0 : telling.scans().back().attained}},
              false);
    return ExitCode::kOk;
  }
  std::printf("\n%s\n", result->why.c_str());
  for (const std::string& fact : reached) std::printf("%s\n", fact.c_str());
  if (!arguments.pictures.empty()) {
    std::printf("Page: %s/index.html, with a picture of each scan\n", arguments.pictures.c_str());
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
          ->check(OneOf(SceneNames()));
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
  auto* late = command
                   .add_option("--late", a.late,
                               "Scans that are made before the data of one reach the server; their "
                               "stations are told at once [0]")
                   ->check(CLI::Range(0, 100));
  command
      .add_option("--tour", a.job.tour_seconds,
                  "Before every plan a tour of what is left is made for so many seconds, and "
                  "followed")
      ->check(CLI::Range(0.1, 600.0))
      ->excludes(scanners)
      ->excludes(late);
  command
      .add_option("--prior", a.prior,
                  "A prior of the site, sent after the first scan: the scene's own mesh, its floor "
                  "plan as a picture, or its mesh turned by half a turn; all roughly placed")
      ->check(CLI::IsMember({"mesh", "plan", "wrong"}));
  command.add_option("--range", a.range, "Farthest range of the scanner, m [the preset's, 20]");
  command.add_option("--noise", a.noise, "Range noise, m, one sigma [the preset's, 0.003]");
  command.add_option("--positioning-error", a.job.scanner.positioning_error,
                     "By how much the tripod misses a position, m per axis [0.05]");
  command.add_option("--heading-error", a.heading_error,
                     "Of the pose prior, degrees, one sigma [5]");
  command
      .add_option("--prior-sigma", a.job.prior_sigma,
                  "The pose priors say that they know the position to this, m, one sigma, as a "
                  "robot's odometry does, and the heading to --heading-error [they are guesses]")
      ->check(CLI::Range(0.001, 1.0));
  command.add_option("--tilt", a.tilt, "Of the tripod, degrees, one sigma [0.5]");
  command.add_flag("--no-faults", a.no_noise, "No noise, no drop-outs");
  auto* budget = command.add_option("--budget", a.job.plan_seconds, "Time for each plan, s [1]")
                     ->check(CLI::PositiveNumber);
  command.add_option("--work", a.work, "Work for each plan instead, rays: repeatable")
      ->excludes(budget);
  command.add_option("--truth-samples", a.job.truth_samples,
                     "Points on the mesh that true coverage is measured on [40000]");
  command.add_option(
      "--pictures", a.pictures,
      "Folder for one picture per scan and a page of them; for the tours, with --scanners");
  command
      .add_flag("--until-done", a.until_done,
                "Go on until the planner says that another scan is not worth it: it is given the "
                "time to look at all places before a scan that does not seem to be; 100 scans at "
                "most")
      ->excludes(scanners);
  command
      .add_option("--worth", a.worth,
                  "A scan is worth it that brings so much to density, m^2 [0.5]")
      ->check(CLI::NonNegativeNumber);
  auto* oracle = command.add_flag(
      "--oracle", a.oracle,
      "Instead go each time where a scan truly brings most, as only the simulation knows");
  oracle->excludes(scanners);
  command.add_option(
      "--compare", a.compare,
      "What --oracle --json wrote of the same job: its curve stands beside this one's "
      "on the page");
  command.add_option("--page-link", a.page_link,
                     "Address of the server's page for tablets, to be named on the page");
  command.add_flag("--json", a.json, "A line of JSON for each scan, and one for the end");
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
