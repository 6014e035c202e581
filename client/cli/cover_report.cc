#include "client/cli/cover_report.h"

#include <cstdio>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/json.h"
#include "client/cli/terminal.h"
#include "client/library/error.h"
#include "client/study/best_cover.h"
#include "client/study/place_file.h"
#include "client/study/scene_list.h"
#include "client/study/study_scene.h"
#include "client/study/visibility_table.h"
#include "core/parallel/thread_pool.h"

namespace vantage::cli {
namespace {

// Somewhere between a station and the candidate that stands for it: a cell of the truth's lattice.
constexpr double kTolerance = 0.5;  // m

struct CoverRow {
  std::string name;
  size_t candidates = 0;
  size_t samples = 0;
  study::BestCoverResult best;
  std::vector<Eigen::Vector3d> places;  // of the stations, in order
  std::optional<study::StationScore> given;
  std::string file;  // that the stations were written to
};

absl::StatusOr<CoverRow> MakeRow(const std::string& name, const study::VisibilityTable& table,
                                 const study::StudySettings& settings,
                                 const std::vector<Eigen::Vector3d>& given,
                                 const std::string& output) {
  const study::CoverSettings cover = {settings.goal, settings.cover_overlap,
                                      settings.cover_seconds};
  CoverRow row{name, table.candidates.size(), table.samples, {}, {}, {}, {}};
  if (!given.empty()) {
    auto score = study::ScoreStations(table, cover, given, kTolerance);
    if (!score.ok()) return score.status();
    row.given = *std::move(score);
  }
  auto best = study::BestCover(table, cover);
  if (!best.ok()) return best.status();
  row.best = *std::move(best);
  for (const size_t i : row.best.route) row.places.push_back(table.candidates[i]);
  row.file = absl::StrCat(output, "/stations-", study::JobName(name), ".csv");
  if (absl::Status s = study::WritePlaces(row.file, row.places); !s.ok()) return s;
  return row;
}

Json ToJson(const CoverRow& row) {
  Json stations = Json::array();
  for (const Eigen::Vector3d& at : row.places) stations.push_back({at.x(), at.y(), at.z()});
  Json json = {{"scene", row.name},         {"candidates", row.candidates},
               {"samples", row.samples},    {"stations", row.best.route.size()},
               {"least", row.best.least},   {"proven", row.best.proven},
               {"greedy", row.best.greedy}, {"covered", row.best.covered},
               {"how", row.best.how},       {"positions_m", std::move(stations)}};
  if (row.given) {
    json["given"] = {{"stations", row.given->stations},
                     {"covered", row.given->covered},
                     {"covered_by_step", row.given->by_step},
                     {"linked", row.given->linked}};
  }
  return json;
}

void Print(const CoverRow& row) {
  std::printf("%-16s %6d places, %d samples: %d stations cover %.1f %% (%s%d, greedy %d)\n",
              row.name.c_str(), static_cast<int>(row.candidates), static_cast<int>(row.samples),
              static_cast<int>(row.best.route.size()), 100 * row.best.covered,
              row.best.proven ? "proven: at least " : "at least ", static_cast<int>(row.best.least),
              static_cast<int>(row.best.greedy));
  std::printf("%-16s %s\n%-16s %s\n", "", row.best.how.c_str(), "", row.file.c_str());
  if (!row.given) return;
  std::printf(
      "%-16s given: %d stations cover %.1f %%, %s\n", "", static_cast<int>(row.given->stations),
      100 * row.given->covered,
      row.given->linked == row.given->stations
          ? "and hang together"
          : absl::StrFormat("and only %d of them hang together with the first", row.given->linked)
                .c_str());
}

}  // namespace

absl::StatusOr<ExitCode> ReportCovers(const study::StudyPlan& plan, const CoverArguments& arguments,
                                      const std::string& output, bool json) {
  std::vector<Eigen::Vector3d> given;
  if (!arguments.stations.empty()) {
    auto read = study::ReadPlaces(arguments.stations);
    if (!read.ok()) return read.status();
    given = *std::move(read);
  }
  std::error_code error;
  std::filesystem::create_directories(output, error);
  if (error) {
    return client::WithFix(absl::PermissionDeniedError(absl::StrCat("cannot make the folder ",
                                                                    output, ": ", error.message())),
                           "name another one with --output");
  }
  std::vector<CoverRow> rows;
  if (!arguments.table.empty()) {
    auto table = study::ReadVisibilityTable(arguments.table);
    if (!table.ok()) return table.status();
    if (plan.settings.start) {
      size_t nearest = 0;
      for (size_t i = 1; i < table->candidates.size(); ++i) {
        if ((table->candidates[i] - *plan.settings.start).norm() <
            (table->candidates[nearest] - *plan.settings.start).norm()) {
          nearest = i;
        }
      }
      const double away = (table->candidates[nearest] - *plan.settings.start).norm();
      if (away > kTolerance) {
        return client::WithFix(
            absl::InvalidArgumentError(
                absl::StrFormat("--start: no candidate within %.1f m; the nearest is %.2f m away",
                                kTolerance, away)),
            "name one of candidates.csv");
      }
      table->start = nearest;
    }
    auto row = MakeRow("table", *table, plan.settings, given, output);
    if (!row.ok()) return row.status();
    rows.push_back(*std::move(row));
  } else {
    ProgressLine line(2);
    parallel::ThreadPool pool(plan.jobs > 0 ? plan.jobs : 2);
    for (const std::string& name : plan.scenes) {
      line.Show(absl::StrCat(name, ": measuring what can be attained"));
      auto site = study::BuildScene(name, plan.data_folder);
      if (!site.ok()) return site.status();
      const auto scene = study::StudyScene::Make(*std::move(site), plan.settings, pool);
      if (!scene.ok()) return scene.status();
      std::optional<size_t> start;
      if (plan.settings.start) start = (*scene)->StartIndex(1);
      const study::VisibilityTable table =
          study::MakeVisibilityTable(**scene, plan.settings.cover_lattice, start);
      if (!arguments.write_table.empty()) {
        const std::string folder = absl::StrCat(arguments.write_table, "/", study::JobName(name));
        if (absl::Status s = study::WriteVisibilityTable(table, folder); !s.ok()) return s;
      }
      line.Show(absl::StrCat(name, ": choosing stations"));
      auto row = MakeRow(name, table, plan.settings, given, output);
      if (!row.ok()) return row.status();
      rows.push_back(*std::move(row));
    }
    line.Clear();
  }
  bool enough = true;
  Json list = Json::array();
  for (const CoverRow& row : rows) {
    if (json) {
      list.push_back(ToJson(row));
    } else {
      Print(row);
    }
    enough &= !row.given || row.given->covered >= plan.settings.goal;
  }
  if (json) PrintJson({{"covers", std::move(list)}});
  return enough ? ExitCode::kOk : ExitCode::kUnwelcome;
}

}  // namespace vantage::cli
