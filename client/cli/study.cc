#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/cli/command.h"
#include "client/cli/cover_report.h"
#include "client/cli/json.h"
#include "client/cli/terminal.h"
#include "client/library/error.h"
#include "client/simulated_job/placement.h"
#include "client/study/own_server.h"
#include "client/study/page.h"
#include "client/study/planner_list.h"
#include "client/study/scene_list.h"
#include "client/study/study.h"
#include "client/study/table.h"
#include "core/sensor/presets.h"

namespace vantage::cli {
namespace {

struct StudyArguments {
  std::string output = "study";
  std::vector<std::string> scenes;
  std::vector<std::string> planners;
  bool small = false;
  bool tuning = false;
  bool list = false;
  bool json = false;
  std::string preset;  // empty: kPreset, unless a step is given
  std::string setting;
  std::optional<double> step;     // degrees
  std::optional<double> preview;  // degrees
  std::vector<double> start;
  std::optional<double> range;      // m
  std::optional<double> incidence;  // degrees
  CoverArguments cover;
  study::StudyPlan plan;
  CLI::Option* server = nullptr;  // an option of the whole program; it may be given or not
};

constexpr char kPreset[] = "leica-rtc360";
constexpr double kPreviewOfPresets = 0.25;  // degrees

// The scanner that the arguments ask for: a real instrument or, with nothing but a step, one whose
// steps are so coarse that what is under-sampled decides.
absl::Status ChooseScanner(const StudyArguments& arguments, study::StudySettings& settings) {
  const bool real = !arguments.preset.empty() || !arguments.step.has_value();
  if (real) {
    const auto preset = sensor::FindPreset(arguments.preset.empty() ? kPreset : arguments.preset);
    if (!preset.ok()) return preset.status();
    const auto setting = preset->Setting(arguments.setting);
    if (!setting.ok()) return setting.status();
    settings.scanner = preset->At(*setting);
    settings.instrument = absl::StrCat(preset->title, " at ", setting->name);
    settings.scan_minutes = setting->minutes;
  }
  if (arguments.step.has_value()) {
    settings.scanner.azimuth_step = settings.scanner.elevation_step =
        sensor::Radians(*arguments.step);
  }
  if (arguments.range) {
    if (*arguments.range <= settings.scanner.range_min) {
      return client::WithFix(absl::InvalidArgumentError(absl::StrFormat(
                                 "--range: %.2f m is within the scanner's nearest, %.2f m",
                                 *arguments.range, settings.scanner.range_min)),
                             "name the farthest that counts, in m");
    }
    settings.scanner.range_max = *arguments.range;
  }
  if (arguments.incidence) settings.scanner.max_incidence = sensor::Radians(*arguments.incidence);
  settings.preview = sensor::Radians(arguments.preview.value_or(real ? kPreviewOfPresets : 0));
  return absl::OkStatus();
}

// What a choice of stations is made of.
absl::Status CheckCover(const StudyArguments& arguments, study::StudySettings& settings) {
  const double steps = settings.cover_lattice / simulated_job::kLatticeOfTruth;
  if (std::abs(steps - std::round(steps)) > 1e-6 || steps < 0.5) {
    return client::WithFix(absl::InvalidArgumentError(absl::StrFormat(
                               "--lattice: %.2f m is no multiple of %.1f m, the distance between "
                               "allowed places",
                               settings.cover_lattice, simulated_job::kLatticeOfTruth)),
                           "name 0.3, 0.6, 0.9 and so on");
  }
  if (!arguments.cover.stations.empty() && !arguments.cover.asked()) {
    return client::WithFix(
        absl::InvalidArgumentError("--stations: stations are scored where covers are"),
        "add --cover");
  }
  if (!arguments.cover.table.empty() && !arguments.scenes.empty()) {
    return client::WithFix(
        absl::InvalidArgumentError("--table: a table is searched instead of scenes"),
        "leave out --scene");
  }
  if (arguments.start.size() == 3) {
    settings.start.emplace(arguments.start[0], arguments.start[1], arguments.start[2]);
  }
  settings.enough = std::max(settings.enough, settings.goal);
  return absl::OkStatus();
}

absl::StatusOr<study::StudyPlan> PlanFrom(const Environment& environment,
                                          const StudyArguments& arguments) {
  study::StudyPlan plan = arguments.plan;
  if (absl::Status chosen = ChooseScanner(arguments, plan.settings); !chosen.ok()) return chosen;
  if (absl::Status checked = CheckCover(arguments, plan.settings); !checked.ok()) return checked;
  plan.scenes = arguments.scenes;
  plan.planners = arguments.planners;
  if (plan.scenes.empty()) {
    plan.scenes = study::DefaultScenes(
        arguments.tuning ? study::SceneUse::kTuning : study::SceneUse::kReporting, arguments.small);
  }
  if (plan.planners.empty()) {
    plan.planners = study::DefaultPlanners(arguments.small);
  }
  if (plan.data_folder.empty()) {
    const char* folder = std::getenv("VANTAGE_SHARED_DATA");
    plan.data_folder = folder == nullptr ? "" : folder;
  }
  if (arguments.server != nullptr && arguments.server->count() > 0) {
    plan.settings.server = environment.connection.server;
  } else if (plan.server_program.empty()) {
    plan.server_program = study::FindServerProgram();
  }
  return plan;
}

void PrintList(bool json) {
  if (json) {
    Json planners = Json::array();
    for (const study::StudyPlanner& planner : study::AllPlanners()) {
      planners.push_back({{"name", planner.name}, {"words", planner.words}});
    }
    PrintJson({{"planners", std::move(planners)},
               {"reporting", study::DefaultScenes(study::SceneUse::kReporting, false)},
               {"tuning", study::DefaultScenes(study::SceneUse::kTuning, false)}});
    return;
  }
  std::printf("Planners:\n");
  for (const study::StudyPlanner& planner : study::AllPlanners()) {
    std::printf("  %-16s %s\n", planner.name.c_str(), planner.words.c_str());
  }
  std::printf(
      "Scenes: flat-N, two-rooms-N, hall-N, office-N (N below %d for tuning, from there on for "
      "reporting), small-house (for tuning), bookstore\n  reporting: %s\n  tuning: %s\n",
      static_cast<int>(simulation::kFirstReportingSeed),
      absl::StrJoin(study::DefaultScenes(study::SceneUse::kReporting, false), ", ").c_str(),
      absl::StrJoin(study::DefaultScenes(study::SceneUse::kTuning, false), ", ").c_str());
}

// Writes the table and the page of the jobs that are done.
absl::Status WriteResults(const study::StudyPlan& plan, const std::string& folder,
                          const study::StudyOutcome& outcome, study_records::v1::Table& table) {
  std::vector<int> most_scans;
  for (const study_records::v1::JobRecord& record : outcome.records) {
    most_scans.push_back(plan.settings.For(record.scene()).most_scans);
  }
  table =
      study::MakeTable(outcome.records, plan.settings.goal, most_scans, plan.settings.Describe());
  std::vector<study::FloorPlanDrawing> drawings;
  for (const std::string& name : plan.scenes) {
    const auto site = study::BuildScene(name, plan.data_folder);
    if (!site.ok()) return site.status();
    drawings.push_back(study::DrawFloorPlan(*site, plan.settings.For(name).most_scans));
  }
  if (absl::Status s = study::WriteWhole(absl::StrCat(folder, "/table.json"), ToJson(table));
      !s.ok()) {
    return s;
  }
  return study::WriteWhole(absl::StrCat(folder, "/study.html"),
                           study::StudyPage(table, outcome.records, drawings, plan.settings.goal));
}

void PrintTable(const study_records::v1::Table& table) {
  std::printf("%-14s %-15s %5s %8s %10s %8s %7s %9s %7s %7s %11s\n", "scene", "planner", "jobs",
              "reached", "scans 95 %", "min 95 %", "auc", "lost", "of best", "s/plan",
              "over budget");
  for (const study_records::v1::Row& row : table.rows()) {
    std::printf(
        "%-14s %-15s %5d %8d %10s %8s %7.3f %9s %7.2f %7.2f %11s\n", row.scene().c_str(),
        row.planner().c_str(), row.jobs(), row.reached(),
        row.has_scans95() ? absl::StrFormat("%g%s", row.scans95(), row.winner() ? "*" : "").c_str()
                          : absl::StrFormat("> %d", row.most_scans()).c_str(),
        row.has_minutes95() ? absl::StrFormat("%.1f", row.minutes95()).c_str() : "-",
        row.area_under_curve(), absl::StrFormat("%d/%d", row.lost(), row.scans()).c_str(),
        row.share_of_best(), row.plan_seconds(),
        row.budgeted() == 0 ? "-"
                            : absl::StrFormat("%d/%d", row.over_budget(), row.budgeted()).c_str());
  }
  for (const study_records::v1::Figure& figure : table.figures()) {
    std::printf("%-28s %8s   (%s)  %s\n", figure.name().c_str(), figure.stated().c_str(),
                figure.target().c_str(), figure.detail().c_str());
  }
}

absl::StatusOr<ExitCode> RunStudyCommand(Environment& environment,
                                         const StudyArguments& arguments) {
  if (arguments.list) {
    PrintList(arguments.json);
    return ExitCode::kOk;
  }
  const auto chosen = PlanFrom(environment, arguments);
  if (!chosen.ok()) return chosen.status();
  const study::StudyPlan& plan = *chosen;
  if (arguments.cover.asked()) {
    return ReportCovers(plan, arguments.cover, arguments.output, arguments.json);
  }
  const auto store = study::JobStore::Open(arguments.output);
  if (!store.ok()) return store.status();
  ProgressLine line(30);
  const auto began = std::chrono::steady_clock::now();
  std::optional<int> found;  // jobs that were done before
  const auto outcome = study::RunStudy(plan, *store, [&](const study::StudyProgress& progress) {
    if (!found) found = progress.done;
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    const int done = progress.done - *found;
    line.Show(absl::StrFormat(
        "%d of %d jobs done%s; %s", progress.done, progress.total,
        done == 0 ? ""
                  : absl::StrFormat(", %.1f a minute, %s", 60 * done / seconds,
                                    TimeLeft(seconds / done * (progress.total - progress.done))),
        progress.doing));
  });
  line.Clear();
  if (!outcome.ok()) return outcome.status();
  study_records::v1::Table table;
  if (absl::Status s = WriteResults(plan, arguments.output, *outcome, table); !s.ok()) return s;
  if (arguments.json) {
    std::fputs(ToJson(table).c_str(), stdout);
  } else {
    PrintTable(table);
    std::printf("%s/table.json, %s/study.html\n", arguments.output.c_str(),
                arguments.output.c_str());
  }
  for (const std::string& fault : outcome->faults) {
    std::fprintf(stderr, "failed: %s\n", fault.c_str());
  }
  if (outcome->missing > 0) {
    std::fprintf(stderr, "%d jobs are not done yet; the same command goes on with them.\n",
                 outcome->missing);
    return outcome->faults.empty() ? ExitCode::kTryAgain : ExitCode::kInternal;
  }
  return ExitCode::kOk;
}

void DefineStudy(CLI::App& command, StudyArguments& a) {
  command.add_option(
      "-o,--output", a.output,
      "Folder of the records, the table and the page; what is done there is not done "
      "again [study]");
  command.add_flag("--small", a.small, "Three scenes and the rivals that the figures need");
  command
      .add_option("--scene", a.scenes,
                  "Scenes, by name, or paths of meshes (.ply, in metres, z up)")
      ->delimiter(',');
  command.add_option("--planner", a.planners, "Planners, by name")->delimiter(',');
  command.add_flag("--tuning", a.tuning, "The scenes for tuning instead of those for reporting");
  command.add_flag("--json", a.json, "Print the table, or the list, as JSON");
  command.add_flag("--list", a.list, "Name scenes and planners and do nothing");
  command.add_option("--seeds", a.plan.seeds, "Starts and draws of all faults for each [5]")
      ->check(CLI::Range(1, 10000));
  command.add_option("--jobs", a.plan.jobs, "Jobs at the same time [one per core]")
      ->check(CLI::Range(1, 256));
  command
      .add_option("--no-job-after", a.plan.no_job_after,
                  "Begin no further job after so many seconds")
      ->check(CLI::PositiveNumber);
  command.add_option("--scans", a.plan.settings.most_scans, "Scans at most [by scene]")
      ->check(CLI::Range(1, 1000));
  command.add_option(
      "--preset", a.preset,
      "A real instrument; 'vantage scanner presets' lists them [leica-rtc360, unless "
      "--step is given]");
  auto* setting = command.add_option("--setting", a.setting, "Of the preset [its usual one]");
  command
      .add_option("--step", a.step,
                  "Angular steps of the scanner, degrees; without --preset, of none in particular "
                  "[the preset's]")
      ->check(CLI::Range(0.01, 5.0))
      ->excludes(setting);
  command
      .add_option("--preview", a.preview,
                  "Degrees between the rays of scans, which stand for native ones; 0: all [0.25 "
                  "with a preset, else 0]")
      ->check(CLI::Range(0.0, 5.0));
  command.add_option("--density", a.plan.settings.required_density,
                     "Required density, samples / m^2 [2500]");
  command.add_option("--range", a.range, "Farthest that counts, m [the preset's]")
      ->check(CLI::Range(0.1, 1000.0));
  command
      .add_option(
          "--incidence", a.incidence,
          "Angle between ray and surface's normal up to which a return counts, degrees [the "
          "scanner's]")
      ->check(CLI::Range(1.0, 89.9));
  command
      .add_option("--goal", a.plan.settings.goal,
                  "Share of the attainable surface that scans are counted to [0.95]")
      ->check(CLI::Range(0.01, 1.0));
  command
      .add_option(
          "--start", a.start,
          "x,y,z of the first scan, m, in the scene's own frame [by seed; with --cover any]")
      ->delimiter(',')
      ->expected(3)
      ->allow_extra_args(false);
  command.add_option(
      "--lattice", a.plan.settings.cover_lattice,
      "Between the places that 'optimal' and --cover choose from, m, a multiple of 0.3 "
      "[0.6]");
  command
      .add_option("--overlap", a.plan.settings.cover_overlap,
                  "Share of the larger scan, from which on 'optimal' and --cover let two stations "
                  "hang together [0.1]")
      ->check(CLI::Range(0.0, 1.0));
  command
      .add_option("--cover-seconds", a.plan.settings.cover_seconds,
                  "Wall time of 'optimal' and --cover, for each scene and start [120]")
      ->check(CLI::Range(0.1, 100000.0));
  command.add_flag("--cover", a.cover.cover,
                   "Choose the fewest stations of each scene, with a bound, and simulate no jobs");
  command
      .add_option("--table", a.cover.table,
                  "The same for a folder with candidates.csv and visibility.npy")
      ->excludes("--small");
  command.add_option("--write-table", a.cover.write_table,
                     "Write each scene's table to a folder in this one, and choose as --cover");
  command.add_option("--stations", a.cover.stations,
                     "Say what the stations of a file cover, too (x_m,y_m,z_m, a place a line)");
  command.add_option("--truth-samples", a.plan.settings.truth_samples,
                     "Points on the mesh that true coverage is measured on [20000]");
  command.add_option("--data", a.plan.data_folder,
                     "Folder of the meshes small_house and bookstore [$VANTAGE_SHARED_DATA]");
  command.add_option("--vantaged", a.plan.server_program,
                     "The server to start, one for each job at a time, unless --server names a "
                     "running one [beside this program]");
  for (CLI::App* app = command.get_parent(); app != nullptr && a.server == nullptr;
       app = app->get_parent()) {
    a.server = app->get_option_no_throw("--server");
  }
}

}  // namespace

void AddStudy(CLI::App& parent, Environment& environment) {
  AddCommand<StudyArguments>(
      parent, environment, "study",
      "Compare planners over whole simulated jobs: scenes x planners x seeds",
      "  vantage study --small -o study\n"
      "  vantage study --tuning --scene flat-1,flat-2 --planner ours,oracle,random --seeds 3\n"
      "  vantage study --small --no-job-after 300       (and again, until nothing is left)\n"
      "  vantage study --small --step 0.25 -o coarse    (density decides, not what is hidden)\n"
      "  vantage study --cover --scene flat-1,site.ply --goal 0.97 --overlap 0.2\n"
      "  vantage study --cover --scene flat-1 --write-table tables --stations mine.csv\n"
      "  vantage study --table tables/flat-1 --cover-seconds 30",
      DefineStudy, RunStudyCommand);
}

}  // namespace vantage::cli
