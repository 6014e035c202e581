#include "client/study/table.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/study/planner_list.h"

namespace vantage {
namespace {

using study::v1::Figure;
using study::v1::JobRecord;
using study::v1::Row;
using study::v1::ScanRecord;
using study::v1::Table;

// A job and the most scans that its scene allows.
struct Entry {
  const JobRecord* record = nullptr;
  int most_scans = 0;
};
using ByScene = std::vector<std::pair<std::string, std::map<std::string, std::vector<Entry>>>>;

bool KnowsTheScene(const std::string& planner) {
  const StudyPlanner* known = FindPlanner(planner);
  return known != nullptr && known->kind == PlannerKind::kKnowsTheScene;
}

double MeanAreaUnderCurve(const std::vector<Entry>& jobs) {
  double sum = 0;
  for (const Entry& job : jobs) sum += AreaUnderCurve(*job.record, job.most_scans);
  return jobs.empty() ? 0 : sum / static_cast<double>(jobs.size());
}

Row MakeRow(const std::string& scene, const std::string& planner, const std::vector<Entry>& jobs,
            double goal) {
  Row row;
  row.set_scene(scene);
  row.set_planner(planner);
  row.set_jobs(static_cast<int>(jobs.size()));
  std::vector<double> scans, minutes, ratios, seconds, shares;
  for (const auto& [record, most_scans] : jobs) {
    const int needed = ScansUntil(*record, goal, most_scans);
    scans.push_back(needed);
    const bool reached = needed <= record->scans_size();
    row.set_reached(row.reached() + (reached ? 1 : 0));
    if (reached) minutes.push_back(record->scans(needed - 1).minutes());
    for (const ScanRecord& scan : record->scans()) {
      row.set_scans(row.scans() + 1);
      row.set_lost(row.lost() + (scan.merged() ? 0 : 1));
      if (scan.number() == 1) continue;
      seconds.push_back(scan.plan_seconds());
      row.set_budgeted(row.budgeted() + (scan.has_plan_budget() ? 1 : 0));
      row.set_over_budget(row.over_budget() + (scan.plan_attempts() > 1 ? 1 : 0));
      if (scan.number() <= needed && scan.best() > 0) {
        shares.push_back(std::clamp(scan.gained() / scan.best(), 0.0, 1.0));
      }
      if (scan.has_predicted() && scan.predicted() > 0 && scan.merged()) {
        ratios.push_back(scan.obtained() / scan.predicted());
      }
    }
  }
  row.set_scans95(Median(scans));
  if (2 * minutes.size() >= jobs.size() && !minutes.empty()) row.set_minutes95(Median(minutes));
  row.set_area_under_curve(MeanAreaUnderCurve(jobs));
  if (!ratios.empty()) row.set_obtained_over_predicted(Median(ratios));
  double sum = 0;
  for (const double share : shares) sum += share;
  if (!shares.empty()) row.set_share_of_best(sum / static_cast<double>(shares.size()));
  row.set_plan_seconds(Median(seconds));
  return row;
}

// The worst of a comparison between two planners over the scenes that both were run in, seed by
// seed.
struct Comparison {
  std::optional<double> worst;
  std::vector<std::string> words;

  void Add(const std::string& scene, double value, const std::string& what) {
    if (!worst || value > *worst) worst = value;
    words.push_back(absl::StrCat(scene, ": ", what));
  }
};

void AddFigure(Table& table, const std::string& name, const std::string& target,
               const Comparison& comparison) {
  Figure& figure = *table.add_figures();
  figure.set_name(name);
  figure.set_target(target);
  if (comparison.worst) figure.set_value(*comparison.worst);
  figure.set_detail(absl::StrJoin(comparison.words, "; "));
}

// Calls fn(a, b) for the jobs of both planners with the same seed.
void ForPairs(const std::map<std::string, std::vector<Entry>>& scene, const std::string& a,
              const std::string& b, const std::function<void(const Entry&, const Entry&)>& fn) {
  const auto first = scene.find(a);
  const auto second = scene.find(b);
  if (first == scene.end() || second == scene.end()) return;
  for (const Entry& job : first->second) {
    for (const Entry& other : second->second) {
      if (job.record->seed() == other.record->seed()) fn(job, other);
    }
  }
}

void AddFigures(const ByScene& scenes, double goal, Table& table) {
  const auto scans = [goal](const Entry& job) {
    return static_cast<double>(ScansUntil(*job.record, goal, job.most_scans));
  };
  Comparison over_oracle;
  Comparison vs_spacing;
  Comparison budget;
  Comparison lost;
  int lost_scans = 0;
  int made = 0;
  int jobs = 0;
  int overlap_lost = 0;
  int overlap_jobs = 0;
  for (const auto& [name, planners] : scenes) {
    std::vector<double> over;
    std::vector<double> ours;
    std::vector<double> theirs;
    ForPairs(planners, "ours", "oracle",
             [&](const Entry& a, const Entry& b) { over.push_back(scans(a) - scans(b)); });
    if (!over.empty()) {
      over_oracle.Add(name, Median(over), absl::StrFormat("%+.1f", Median(over)));
    }
    ForPairs(planners, "ours", "spacing", [&](const Entry& a, const Entry& b) {
      ours.push_back(scans(a));
      theirs.push_back(scans(b));
    });
    if (!ours.empty()) {
      const double ratio = Median(ours) / Median(theirs);
      vs_spacing.Add(name, ratio, absl::StrFormat("%g of %g", Median(ours), Median(theirs)));
    }
    std::vector<Entry> quick, complete;
    ForPairs(planners, "ours-0.2s", "ours-complete", [&](const Entry& a, const Entry& b) {
      quick.push_back(a);
      complete.push_back(b);
    });
    if (!quick.empty()) {
      const double loss = 1 - MeanAreaUnderCurve(quick) / MeanAreaUnderCurve(complete);
      budget.Add(name, loss, absl::StrFormat("%.3f", loss));
    }
    for (const auto& [planner, entries] : planners) {
      for (const Entry& job : entries) {
        const auto losses = std::count_if(job.record->scans().begin(), job.record->scans().end(),
                                          [](const ScanRecord& scan) { return !scan.merged(); });
        if (planner == "ours") {
          ++jobs;
          made += job.record->scans_size();
          lost_scans += static_cast<int>(losses);
        } else if (planner == "ours-overlap") {
          ++overlap_jobs;
          overlap_lost += static_cast<int>(losses);
        }
      }
    }
  }
  if (jobs > 0) {
    lost.worst = lost_scans;
    lost.words.push_back(absl::StrFormat("of %d scans in %d jobs; overlap alone: %d in %d jobs",
                                         made, jobs, overlap_lost, overlap_jobs));
  }
  AddFigure(table, "study.scans95_over_oracle", "at most 1 in every scene", over_oracle);
  AddFigure(table, "study.scans_vs_spacing", "at most 0.8 in every scene", vs_spacing);
  AddFigure(table, "study.lost_scans", "0 in 100 jobs", lost);
  AddFigure(table, "study.budget200ms_auc", "at most 0.01 of the area under the curve lost",
            budget);
}

}  // namespace

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const size_t middle = values.size() / 2;
  return values.size() % 2 == 1 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

int ScansUntil(const JobRecord& record, double goal, int most_scans) {
  for (const ScanRecord& scan : record.scans()) {
    if (scan.covered() >= goal) return scan.number();
  }
  return std::max(most_scans, record.scans_size()) + 1;
}

double AreaUnderCurve(const JobRecord& record, int most_scans) {
  double sum = 0;
  for (int i = 0; i < most_scans && record.scans_size() > 0; ++i) {
    sum += record.scans(std::min(i, record.scans_size() - 1)).covered();
  }
  return most_scans > 0 ? sum / most_scans : 0;
}

Table MakeTable(const std::vector<JobRecord>& records, double goal,
                const std::vector<int>& most_scans, const std::string& settings) {
  ByScene scenes;
  std::vector<std::pair<std::string, std::string>> order;
  for (size_t i = 0; i < records.size(); ++i) {
    const JobRecord& record = records[i];
    if (scenes.empty() || scenes.back().first != record.scene()) {
      scenes.push_back({record.scene(), {}});
    }
    std::vector<Entry>& jobs = scenes.back().second[record.planner()];
    if (jobs.empty()) order.emplace_back(record.scene(), record.planner());
    jobs.push_back({&record, most_scans[i]});
  }
  Table table;
  table.set_settings(settings);
  size_t next = 0;
  for (const auto& [scene, planners] : scenes) {
    const int first = table.rows_size();
    double fewest = 0;
    for (; next < order.size() && order[next].first == scene; ++next) {
      const std::string& planner = order[next].second;
      const Row row = MakeRow(scene, planner, planners.at(planner), goal);
      const bool counts = !KnowsTheScene(planner) && row.reached() > 0;
      if (counts && (fewest == 0 || row.scans95() < fewest)) fewest = row.scans95();
      *table.add_rows() = row;
    }
    for (int i = first; i < table.rows_size(); ++i) {
      Row& row = *table.mutable_rows(i);
      row.set_winner(fewest > 0 && !KnowsTheScene(row.planner()) && row.reached() > 0 &&
                     row.scans95() <= fewest);
    }
  }
  AddFigures(scenes, goal, table);
  return table;
}

}  // namespace vantage
