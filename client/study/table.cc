#include "client/study/table.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/study/forecast_score.h"
#include "client/study/median.h"
#include "client/study/planner_list.h"

namespace vantage::study {
namespace {

using study_records::v1::Figure;
using study_records::v1::JobRecord;
using study_records::v1::Row;
using study_records::v1::ScanRecord;
using study_records::v1::Table;

// A job and the most scans that its scene allows.
struct Entry {
  const JobRecord* record = nullptr;
  int most_scans = 0;
};
constexpr double kNever = std::numeric_limits<double>::infinity();
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
    const bool reached = needed <= record->scans_size();
    row.set_most_scans(std::max(row.most_scans(), most_scans));
    row.set_reached(row.reached() + (reached ? 1 : 0));
    scans.push_back(reached ? needed : kNever);
    minutes.push_back(reached ? record->scans(needed - 1).minutes() : kNever);
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
  if (Median(scans) < kNever) row.set_scans95(Median(scans));
  if (Median(minutes) < kNever) row.set_minutes95(Median(minutes));
  row.set_area_under_curve(MeanAreaUnderCurve(jobs));
  if (!ratios.empty()) row.set_obtained_over_predicted(Median(ratios));
  double sum = 0;
  for (const double share : shares) sum += share;
  if (!shares.empty()) row.set_share_of_best(sum / static_cast<double>(shares.size()));
  row.set_plan_seconds(Median(seconds));
  return row;
}

// A number that is known to lie from `low` to `high`. For the scans that a job without success
// would have needed only `low` is known.
struct Bounds {
  double low = 0;
  double high = 0;
};

// The median and the sum of numbers lie between those of their bounds.
Bounds MedianOf(const std::vector<Bounds>& values) {
  std::vector<double> lows, highs;
  for (const Bounds& value : values) {
    lows.push_back(value.low);
    highs.push_back(value.high);
  }
  return {Median(lows), Median(highs)};
}

using Format = absl::ParsedFormat<'g'>;
const Format kPlain("%.3g");
const Format kSigned("%+.3g");

std::string Words(const Bounds& bounds, const Format& format = kPlain) {
  const auto number = [&](double value) { return absl::StrFormat(format, value); };
  if (bounds.low == bounds.high) return number(bounds.low);
  if (bounds.high == kNever) return absl::StrCat("at least ", number(bounds.low));
  if (bounds.low == -kNever) return absl::StrCat("at most ", number(bounds.high));
  return absl::StrCat(number(bounds.low), " to ", number(bounds.high));
}

// Which of two values is the worse.
enum class Worse { kLarger, kSmaller };

// The worst of a comparison between two planners over the scenes that both were run in, seed by
// seed.
struct Comparison {
  Worse worse = Worse::kLarger;
  std::optional<Bounds> worst;
  bool some_undecided = false;  // scenes in which neither reached the goal
  std::vector<std::string> words;

  void Add(const std::string& scene, const Bounds& value, const std::string& what) {
    if (!worst) {
      worst = value;
    } else if (worse == Worse::kLarger) {
      worst = Bounds{std::max(worst->low, value.low), std::max(worst->high, value.high)};
    } else {
      worst = Bounds{std::min(worst->low, value.low), std::min(worst->high, value.high)};
    }
    words.push_back(absl::StrCat(scene, ": ", what));
  }
  void AddUndecided(const std::string& scene) {
    some_undecided = true;
    words.push_back(absl::StrCat(scene, ": ", kByNeither));
  }

  static constexpr char kByNeither[] = "not reached by either";
};

void AddFigure(Table& table, const std::string& name, const std::string& target,
               const Comparison& comparison, const Format& format = kPlain) {
  Figure& figure = *table.add_figures();
  figure.set_name(name);
  figure.set_target(target);
  figure.set_detail(absl::StrJoin(comparison.words, "; "));
  if (!comparison.worst) {
    figure.set_stated(comparison.some_undecided ? Comparison::kByNeither : "not run");
    return;
  }
  const Bounds& worst = *comparison.worst;
  if (worst.low == worst.high) figure.set_value(worst.low);
  figure.set_stated(
      absl::StrCat(Words(worst, format), comparison.some_undecided ? " where one reached it" : ""));
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

// Planners with our registration rule as it is: with the default configuration and any budget.
bool KeepsOurRule(const std::string& planner) {
  const StudyPlanner* known = FindPlanner(planner);
  return known != nullptr && known->kind == PlannerKind::kOurs &&
         known->choice == simulated_job::ViewChoice::kRegistrable &&
         known->overrides.ByteSizeLong() == 0;
}

struct Losses {
  int jobs = 0;
  int scans = 0;
  int lost = 0;

  void Add(const Entry& job) {
    ++jobs;
    scans += job.record->scans_size();
    for (const ScanRecord& scan : job.record->scans()) lost += scan.merged() ? 0 : 1;
  }
};

Comparison LostScans(const ByScene& scenes) {
  Losses ours, overlap;
  for (const auto& [name, planners] : scenes) {
    for (const auto& [planner, jobs] : planners) {
      for (const Entry& job : jobs) {
        if (KeepsOurRule(planner)) ours.Add(job);
        if (planner == "ours-overlap") overlap.Add(job);
      }
    }
  }
  Comparison lost;
  if (ours.jobs == 0) return lost;
  const double count = ours.lost;
  lost.worst = Bounds{count, count};
  lost.words.push_back(absl::StrFormat(
      "of %d scans in %d jobs of ours, whatever the budget; by overlap alone %d of %d in %d",
      ours.scans, ours.jobs, overlap.lost, overlap.scans, overlap.jobs));
  return lost;
}

// The area under the curve that plans of 0.2 s lose, compared with plans that score every view
// exactly or, where those were not run, with plans of 1 s.
Comparison BudgetLoss(const ByScene& scenes) {
  Comparison budget;
  for (const auto& [name, planners] : scenes) {
    const std::string against = planners.contains("ours-complete") ? "ours-complete" : "ours";
    std::vector<Entry> quick, thorough;
    ForPairs(planners, "ours-0.2s", against, [&](const Entry& a, const Entry& b) {
      quick.push_back(a);
      thorough.push_back(b);
    });
    if (quick.empty()) continue;
    const double loss = 1 - MeanAreaUnderCurve(quick) / MeanAreaUnderCurve(thorough);
    budget.Add(name, {loss, loss},
               absl::StrFormat("%.3f against %s (%d jobs)", loss, against, quick.size()));
  }
  return budget;
}

// The scans that a job needed for a share of the attainable surface.
Bounds ScansOf(const Entry& job, double share) {
  const double needed = ScansUntil(*job.record, share, job.most_scans);
  return {needed, needed > job.record->scans_size() ? kNever : needed};
}

// The scans that ours needs beyond those of `other`. `prefix`: of the scenes' names.
Comparison ScansBeyond(const ByScene& scenes, const std::string& other, double share,
                       const std::string& prefix = "") {
  Comparison beyond;
  for (const auto& [name, planners] : scenes) {
    if (!name.starts_with(prefix)) continue;
    std::vector<Bounds> over;
    ForPairs(planners, "ours", other, [&](const Entry& a, const Entry& b) {
      const Bounds ours = ScansOf(a, share);
      const Bounds theirs = ScansOf(b, share);
      over.push_back({ours.low - theirs.high, ours.high - theirs.low});
    });
    if (over.empty()) continue;
    const Bounds behind = MedianOf(over);
    if (behind.low == -kNever && behind.high == kNever) {
      beyond.AddUndecided(name);
    } else {
      beyond.Add(name, behind, Words(behind, kSigned));
    }
  }
  return beyond;
}

// The scans that ours needs, as a share of those of `other`.
Comparison ScansAgainst(const ByScene& scenes, const std::string& other, double share) {
  Comparison against;
  for (const auto& [name, planners] : scenes) {
    std::vector<Bounds> ours, theirs;
    ForPairs(planners, "ours", other, [&](const Entry& a, const Entry& b) {
      ours.push_back(ScansOf(a, share));
      theirs.push_back(ScansOf(b, share));
    });
    if (ours.empty()) continue;
    const Bounds a = MedianOf(ours);
    const Bounds b = MedianOf(theirs);
    if (a.high == kNever && b.high == kNever) {
      against.AddUndecided(name);
    } else {
      const Bounds ratio{a.low / b.high, a.high / b.low};
      against.Add(name, {b.high == kNever ? -kNever : ratio.low, ratio.high},
                  absl::StrCat(Words(a), " of ", Words(b)));
    }
  }
  return against;
}

double CoveredAfter(const JobRecord& record, int scans) {
  const int last = std::min(scans, record.scans_size()) - 1;
  return last < 0 ? 0 : record.scans(last).covered();
}

// The means of what `of` says of the jobs of ours, over those of `other` with the same seeds.
Comparison MeansOver(const ByScene& scenes, const std::string& other,
                     const std::function<double(const Entry&)>& of) {
  Comparison over{Worse::kSmaller, std::nullopt, false, {}};
  for (const auto& [name, planners] : scenes) {
    double ours = 0;
    double theirs = 0;
    int jobs = 0;
    ForPairs(planners, "ours", other, [&](const Entry& a, const Entry& b) {
      ours += of(a);
      theirs += of(b);
      ++jobs;
    });
    if (theirs <= 0) continue;
    const double ratio = ours / theirs;
    over.Add(name, {ratio, ratio}, absl::StrFormat("%.3f of %.3f", ours / jobs, theirs / jobs));
  }
  return over;
}

// Scans made between the first sight of a room's door and the first scan in the room. What came
// after is not known of a room that nobody went into.
void AddWaits(const JobRecord& record, std::vector<Bounds>& waits) {
  for (const study_records::v1::RoomRecord& room : record.rooms()) {
    if (room.entered() == 1) continue;
    if (room.has_entered()) {
      const double wait = room.has_seen() ? room.entered() - room.seen() - 1 : 0;
      waits.push_back({wait, wait});
    } else if (room.has_seen()) {
      waits.push_back({static_cast<double>(record.scans_size() - room.seen()), kNever});
    }
  }
}

Bounds LongestOf(const std::vector<Bounds>& waits) {
  Bounds longest;
  for (const Bounds& wait : waits) {
    longest = {std::max(longest.low, wait.low), std::max(longest.high, wait.high)};
  }
  return longest;
}

// Over all rooms of all scenes; of other planners in words.
void AddRoomWaits(const ByScene& scenes, Table& table) {
  std::map<std::string, std::vector<Bounds>> by_planner;
  for (const auto& [name, planners] : scenes) {
    for (const auto& [planner, jobs] : planners) {
      for (const Entry& job : jobs) AddWaits(*job.record, by_planner[planner]);
    }
  }
  Comparison median, longest;
  for (const auto& [planner, waits] : by_planner) {
    if (waits.empty()) continue;
    const auto never = std::count_if(waits.begin(), waits.end(),
                                     [](const Bounds& wait) { return wait.high == kNever; });
    median.words.push_back(absl::StrFormat("%s: %s over %d rooms, %d never entered", planner,
                                           Words(MedianOf(waits)), waits.size(), never));
    longest.words.push_back(absl::StrCat(planner, ": ", Words(LongestOf(waits))));
    if (planner != "ours") continue;
    median.worst = MedianOf(waits);
    longest.worst = LongestOf(waits);
  }
  AddFigure(table, "study.rooms.wait", "at most 2 in the median", median);
  AddFigure(table, "study.rooms.wait_worst", "at most 5", longest);
}

// Expected gain over what truly came to density, in the mean over the scans of ours, at places that
// are expected or known.
Comparison ExpectedOverObtained(const ByScene& scenes, bool at_expected) {
  Comparison ratio;
  double all_predicted = 0;
  double all_gained = 0;
  for (const auto& [name, planners] : scenes) {
    double predicted = 0;
    double gained = 0;
    int scans = 0;
    const auto jobs = planners.find("ours");
    if (jobs == planners.end()) continue;
    for (const Entry& job : jobs->second) {
      for (const ScanRecord& scan : job.record->scans()) {
        const int tried = scan.expected_places_size();
        const bool expected = tried > 0 && scan.expected_places(tried - 1).free();
        if (!scan.has_predicted() || !scan.merged() || expected != at_expected) continue;
        predicted += scan.predicted();
        gained += scan.gained();
        ++scans;
      }
    }
    if (gained <= 0) continue;
    all_predicted += predicted;
    all_gained += gained;
    ratio.words.push_back(absl::StrFormat("%s: %.2f (%d scans)", name, predicted / gained, scans));
  }
  if (all_gained > 0) ratio.worst = Bounds{all_predicted / all_gained, all_predicted / all_gained};
  return ratio;
}

// Whether what plans expect of scans comes, and within the intervals that they state.
void AddForecasts(const ByScene& scenes, Table& table) {
  std::vector<const ScanRecord*> scans;
  for (const auto& [name, planners] : scenes) {
    const auto jobs = planners.find("ours");
    if (jobs == planners.end()) continue;
    for (const Entry& job : jobs->second) {
      for (const ScanRecord& scan : job.record->scans()) scans.push_back(&scan);
    }
  }
  const ForecastScore score = ScoreForecasts(scans);
  const auto add = [&](const char* name, const char* aim, double value) {
    Comparison comparison;
    if (score.scans > 0) comparison.worst = Bounds{value, value};
    comparison.words.push_back(
        absl::StrFormat("%d scans, %.0f m2 expected", score.scans, score.expected));
    AddFigure(table, name, aim, comparison);
  };
  add("promise.interval80", "0.75 to 0.85 by area", score.held);
  add("promise.width", "0.5 of what is expected, in the median", score.width);
  add("promise.winkler", "below 1, which is a constant factor's", score.winkler);
  add("promise.within25", "at least 0.7 by area", score.near);
}

// The share of the expected places that proved free, less the stated chance.
Comparison ExpectedPlacesFree(const ByScene& scenes) {
  int tried = 0;
  int free = 0;
  double chance = 0;
  for (const auto& [name, planners] : scenes) {
    const auto jobs = planners.find("ours");
    if (jobs == planners.end()) continue;
    for (const Entry& job : jobs->second) {
      for (const ScanRecord& scan : job.record->scans()) {
        for (const study_records::v1::ExpectedPlace& place : scan.expected_places()) {
          ++tried;
          free += place.free() ? 1 : 0;
          chance += place.chance();
        }
      }
    }
  }
  Comparison beyond;
  if (tried == 0) return beyond;
  const double value = (free - chance) / tried;
  beyond.worst = Bounds{value, value};
  beyond.words.push_back(
      absl::StrFormat("%d of %d free, %.2f stated in the mean", free, tried, chance / tried));
  return beyond;
}

void AddFigures(const ByScene& scenes, double goal, Table& table) {
  constexpr double kNearlyAll = 0.9;
  constexpr int kEarly = 8;  // scans
  AddFigure(table, "study.scans95_over_oracle", "at most 1 in every scene",
            ScansBeyond(scenes, "oracle", goal), kSigned);
  AddFigure(table, "study.scans95_over_oracle_expected", "at most 2 in every scene",
            ScansBeyond(scenes, "oracle-expected", goal), kSigned);
  AddFigure(table, "study.scans90_over_oracle", "at most 2 in every scene",
            ScansBeyond(scenes, "oracle", kNearlyAll), kSigned);
  AddFigure(table, "site.storeys3.scans", "at most 2 beyond the oracle's",
            ScansBeyond(scenes, "oracle", goal, "house-"), kSigned);
  AddFigure(table, "study.scans_vs_spacing", "at most 0.8 in every scene",
            ScansAgainst(scenes, "spacing", goal));
  AddFigure(table, "study.scans95_vs_surveyor", "at most 0.8 in every scene",
            ScansAgainst(scenes, "surveyor", goal));
  const auto early = [](const Entry& job) { return CoveredAfter(*job.record, kEarly); };
  AddFigure(table, "study.covered8_over_oracle", "at least 0.96 in every scene",
            MeansOver(scenes, "oracle", early));
  AddFigure(table, "study.covered8_over_octomap", "at least 1.1 in every scene",
            MeansOver(scenes, "octomap", early));
  AddFigure(table, "study.auc_over_oracle", "at least 0.97 in every scene",
            MeansOver(scenes, "oracle", [](const Entry& job) {
              return AreaUnderCurve(*job.record, job.most_scans);
            }));
  AddRoomWaits(scenes, table);
  AddFigure(table, "study.expected_over_obtained.known", "0.8 to 1.25 in the mean",
            ExpectedOverObtained(scenes, false));
  AddFigure(table, "study.expected_over_obtained.expected", "0.8 to 1.25 in the mean",
            ExpectedOverObtained(scenes, true));
  AddForecasts(scenes, table);
  AddFigure(table, "study.expected_places_free", "within 0.1 of the stated chance",
            ExpectedPlacesFree(scenes), kSigned);
  AddFigure(table, "study.lost_scans", "0 in 100 jobs", LostScans(scenes));
  AddFigure(table, "study.budget200ms_auc", "at most 0.01 of the area under the curve lost",
            BudgetLoss(scenes));
}

}  // namespace

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
      const bool counts = !KnowsTheScene(planner) && row.has_scans95();
      if (counts && (fewest == 0 || row.scans95() < fewest)) fewest = row.scans95();
      *table.add_rows() = row;
    }
    for (int i = first; i < table.rows_size(); ++i) {
      Row& row = *table.mutable_rows(i);
      row.set_winner(row.has_scans95() && !KnowsTheScene(row.planner()) && row.scans95() <= fewest);
    }
  }
  AddFigures(scenes, goal, table);
  return table;
}

}  // namespace vantage::study
