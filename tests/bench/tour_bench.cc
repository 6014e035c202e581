// The whole job ahead: how long a tour takes beside greedy stations in their order, how soon there
// is one, and what it comes to in the scene itself (algorithm.md section 12).
#include <algorithm>
#include <bit>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/model/partial_model.h"
#include "core/planning/problem/planning_problem.h"
#include "core/sensor/presets.h"
#include "core/simulation/standable_positions.h"
#include "core/tour/make_tour.h"
#include "core/tour/ordering.h"
#include "core/tour/overlap_table.h"
#include "core/tour/spread_views.h"
#include "core/tour/tour_table.h"
#include "core/tour/ways.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/fleet_job.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {
namespace {

constexpr double kArea = 1000;    // m^2
constexpr double kGoal = 0.95;    // of what is attainable at density
constexpr double kBudget = 60;    // s
constexpr double kStride = 2.0;   // m, from station to station of the walk with the coarse scanner
constexpr double kHeight = 1.5;   // m
constexpr size_t kMostTours = 6;  // of a job
constexpr double kCoarse = 1.5;   // degrees: a tablet's mesh knows shapes, and nothing at density
// Of people and of the scenes for studies: what the study has.
constexpr double kSpeed = 0.5;     // m/s
constexpr double kSetUp = 60;      // s
constexpr double kPreview = 0.25;  // degrees between the rays of scans

// The study's instrument, at its usual setting.
struct Instrument {
  sensor::ScannerModel model;
  double scan_seconds = 0;  // with setting up
};

Instrument TheInstrument() {
  const sensor::Preset preset = sensor::FindPreset("leica-rtc360").value();
  const sensor::ScanSetting setting = preset.Setting("").value();
  return {preset.At(setting), kSetUp + 60 * setting.minutes};
}

// A model of a scene that knows where everything is, and has nothing at the required density: what
// an old survey or a tablet's mesh says.
std::unique_ptr<model::PartialModel> KnownShape(const FleetScene& scene,
                                                parallel::Parallel& parallel) {
  sensor::ScannerModel coarse = scene.scanner;
  coarse.azimuth_step = coarse.elevation_step = sensor::Radians(kCoarse);
  auto model = model::PartialModel::Create({}).value();
  const std::vector<Eigen::Vector3d> places = simulation::StandablePositions(
      *scene.tracer, scene.scene.mesh.Bounds(), scene.scene.starts[0], scene.scene.floor_height,
      kHeight, scene.scanner.clearance, kStride);
  uint64_t number = 0;
  std::vector<Eigen::Vector3d> all = places;
  all.push_back(scene.stands[0]);  // the last: there the scanners stand
  for (const Eigen::Vector3d& place : all) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(place);
    sensor::Scan scan;
    scan.scanner = coarse;
    scan.image = scene.tracer->Scan(coarse, pose, simulation::ScanFaults{}, number, parallel);
    model->Insert(absl::StrCat("coarse", number++), scan, pose, parallel).value();
  }
  return model;
}

size_t CountOf(const simulation::SampleSet& set) {
  size_t count = 0;
  for (const uint64_t word : set) count += static_cast<size_t>(std::popcount(word));
  return count;
}

// What stations come to in the scene itself.
struct Attained {
  std::vector<simulation::SampleSet> measured;  // by station
  double all = 0;                               // samples that are attainable
  double Share(const std::vector<size_t>& stations) const {
    simulation::SampleSet together(measured.empty() ? 0 : measured[0].size(), 0);
    for (const size_t station : stations) {
      for (size_t w = 0; w < together.size(); ++w) together[w] |= measured[station][w];
    }
    return static_cast<double>(CountOf(together)) / all;
  }
};

// The best `count` of places by the scene itself, greedy and then by exchanges, whatever registers.
double StrongBest(const Attained& table, size_t count) {
  std::vector<size_t> chosen;
  const auto best_with = [&](std::vector<size_t> others) {
    std::pair<double, size_t> best = {-1, 0};
    others.push_back(0);
    for (size_t i = 0; i < table.measured.size(); ++i) {
      others.back() = i;
      best = std::max(best, {table.Share(others), i});
    }
    return best;
  };
  for (size_t k = 0; k < count; ++k) chosen.push_back(best_with(chosen).second);
  double share = table.Share(chosen);
  for (bool better = true; better;) {
    better = false;
    for (size_t k = 0; k < count; ++k) {
      std::vector<size_t> others = chosen;
      others.erase(others.begin() + static_cast<ptrdiff_t>(k));
      const auto [with, place] = best_with(others);
      if (with <= share + 1e-6) continue;
      others.push_back(place);
      chosen = others;
      share = with;
      better = true;
    }
  }
  return share;
}

class Tours {
 public:
  Tours(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures)
      : options_(options),
        parallel_(parallel),
        figures_(figures),
        instrument_(TheInstrument()),
        scene_(MakeFleetScene(SceneSeeds(options.use).front(), kArea, parallel, instrument_.model,
                              sensor::Radians(kPreview))) {
    model_ = KnownShape(scene_, parallel);
    view_ = model_->Publish();
    config_.station_basis = planning::StationBasis::kExpected;
    prepare_seconds_ = WallSeconds([&] {
      problem_ =
          planning::PlanningProblem::Prepare({*view_, scene_.scanner, config_}, parallel_).value();
    });
  }

  void Run() {
    const tour::Tour one = Make(Request(1), &seen_);
    ReportSeconds();
    const std::vector<uint32_t> greedy = Greedy(one.area);
    ReportMinutes(1, one, greedy);
    if (figures_.Wants("tour.minutes4")) {
      const tour::Tour four = Make(Request(4), nullptr);
      ReportMinutes(4, four, greedy);
      Draw(four);
    }
    if (figures_.Wants("tour.best")) ReportBest();
    if (figures_.Wants("tour.job")) ReportJob(one);
  }

 private:
  struct Seen {
    double seconds = 0;
    double processor_seconds = 0;
    double minutes = 0;
    bool reaches = false;
  };

  tour::TourRequest Request(size_t scanners) const {
    tour::TourRequest request;
    for (size_t s = 0; s < scanners; ++s) {
      fleet::FleetMember& member = request.scanners.emplace_back();
      member.model = scene_.scanner;
      member.at = scene_.stands[s];
      member.speed = kSpeed;
      member.scan_seconds = instrument_.scan_seconds;
    }
    request.goal = kGoal;
    return request;
  }

  tour::Tour Make(const tour::TourRequest& request, std::vector<Seen>* seen) {
    return Make(*problem_, request, seen);
  }
  tour::Tour Make(const planning::PlanningProblem& problem, const tour::TourRequest& request,
                  std::vector<Seen>* seen) {
    const auto began = std::chrono::steady_clock::now();
    const std::clock_t processor_began = std::clock();
    return tour::MakeTour(
               problem, request, parallel::Budget::Seconds(kBudget), parallel_,
               [&](const tour::Tour& tour) {
                 const double seconds =
                     std::chrono::duration<double>(std::chrono::steady_clock::now() - began)
                         .count();
                 absl::FPrintF(
                     stderr, "  %6.1f s: %s; %d candidates, least %d, %d would not register\n",
                     seconds, tour.message, tour.candidates, tour.fewest, tour.not_registering);
                 if (seen != nullptr) {
                   seen->push_back(
                       {seconds,
                        static_cast<double>(std::clock() - processor_began) / CLOCKS_PER_SEC,
                        tour.minutes, tour.reaches_goal});
                 }
               })
        .value();
  }

  void ReportSeconds() {
    const double final = seen_.back().minutes;
    double near = seen_.back().seconds;
    for (size_t i = seen_.size(); i-- > 0 && seen_[i].minutes <= 1.05 * final;) {
      near = seen_[i].seconds;
    }
    figures_.Add({"tour.1000m2.seconds", prepare_seconds_ + seen_.front().seconds, "s", "<= 5",
                  absl::StrFormat("to the first complete tour, of which %.1f s to prepare the "
                                  "problem; from there on %.1f s of one core",
                                  prepare_seconds_, seen_.front().processor_seconds)});
    figures_.Add({"tour.1000m2.seconds_to_5_percent", prepare_seconds_ + near, "s", "<= 60",
                  absl::StrFormat("until it takes at most 5 %% longer than the last one, which "
                                  "takes %.0f min",
                                  final)});
  }

  // Candidates by what each brings beyond the ones before it, until they bring `area` of the cells
  // by which tours are measured.
  std::vector<uint32_t> Greedy(double area) {
    overlap_.emplace(tour::OverlapTable::Create(*problem_, parallel_).value());
    elements_ = tour::GainElements::Of(*problem_, 32768, 0, parallel_);
    table_.emplace(*problem_, *overlap_, elements_);
    table_
        ->Add(tour::SpreadViews(*problem_, tour::SpacingFor(*problem_),
                                tour::TourRequest().most_candidates),
              parallel::Budget::Unlimited(), parallel_)
        .IgnoreError();
    const tour::GainElements checked = tour::GainElements::Of(*problem_, 131072, 1, parallel_);
    cover::ElementSet measured((checked.weights.size() + 63) / 64, 0);
    std::vector<uint32_t> chosen;
    double brought = 0;
    double so_far = 0;
    while (so_far < area && chosen.size() < table_->candidates().size()) {
      std::pair<double, uint32_t> best = {-1, 0};
      const cover::ElementSet covered = table_->Covered(chosen);
      for (uint32_t i = 0; i < table_->candidates().size(); ++i) {
        if (!Registers(i, chosen)) continue;
        cover::ElementSet with = covered;
        for (size_t w = 0; w < with.size(); ++w) with[w] |= table_->cover().covers[i][w];
        best = std::max(best, {table_->Weight(with), i});
      }
      if (best.first <= brought) break;
      brought = best.first;
      chosen.push_back(best.second);
      uint64_t rays = 0;
      const auto more = tour::Brought(*problem_, table_->candidates()[best.second], checked,
                                      parallel::Budget::Unlimited(), rays);
      so_far = 0;
      for (size_t i = 0; i < checked.weights.size(); ++i) {
        measured[i / 64] |= (*more)[i / 64] & (uint64_t{1} << (i % 64));
        if ((measured[i / 64] >> (i % 64) & 1) != 0) so_far += checked.weights[i];
      }
    }
    return chosen;
  }
  bool Registers(uint32_t candidate, const std::vector<uint32_t>& chosen) const {
    const auto& anchored = table_->cover().anchored;
    if (std::binary_search(anchored.begin(), anchored.end(), candidate)) return true;
    const auto& links = table_->cover().links[candidate];
    return std::any_of(chosen.begin(), chosen.end(), [&](uint32_t other) {
      return std::binary_search(links.begin(), links.end(), other);
    });
  }

  // The greedy stations in the order of the choice, each made by the scanner that is there first.
  void ReportMinutes(size_t scanners, const tour::Tour& tour, const std::vector<uint32_t>& greedy) {
    tour::Ways ways(*problem_);
    std::vector<Eigen::Vector3d> places;
    places.reserve(greedy.size());
    for (const uint32_t i : greedy) places.push_back(table_->candidates()[i].position);
    const auto walk = ways.Between(places, places, parallel::Budget::Unlimited(), parallel_);
    const tour::TourRequest request = Request(scanners);
    std::vector<double> free(scanners, 0);
    std::vector<std::optional<size_t>> at(scanners);
    for (size_t k = 0; k < places.size(); ++k) {
      size_t who = 0;
      double first = tour::kNoWay;
      for (size_t s = 0; s < scanners; ++s) {
        const double way = at[s].has_value()
                               ? walk[*at[s]][k]
                               : ways.Between({&*request.scanners[s].at, 1}, {&places[k], 1},
                                              parallel::Budget::Unlimited(), parallel_)[0][0];
        if (free[s] + way / kSpeed / 60 < first) {
          first = free[s] + way / kSpeed / 60;
          who = s;
        }
      }
      free[who] = first + request.scanners[who].scan_seconds / 60;
      at[who] = k;
    }
    const double minutes = *std::max_element(free.begin(), free.end());
    figures_.Add({absl::StrCat("tour.minutes", scanners), tour.minutes / minutes, "", "<= 0.85",
                  absl::StrFormat("%d stations in %.0f min, %.0f m walked; %d greedy ones in the "
                                  "order of their choice in %.0f min, for the same %.0f m2",
                                  tour.stops.size(), tour.minutes, tour.walked, greedy.size(),
                                  minutes, tour.area)});
  }

  // By the scene's own rays.
  Attained TableOf(const std::vector<Eigen::Vector3d>& places) {
    Attained table;
    table.measured = scene_.truth->MeasuredAtDensity(places, parallel_);
    const simulation::TrueCoverage now = scene_.truth->Measure();
    table.all = now.attainable_at_density_area / scene_.truth->area_per_sample();
    return table;
  }

  void ReportBest() {
    const std::vector<Eigen::Vector3d> places = simulation::StandablePositions(
        *scene_.tracer, scene_.scene.mesh.Bounds(), scene_.scene.starts[0],
        scene_.scene.floor_height, kHeight, scene_.scanner.clearance, 0.8);
    const Attained table = TableOf(places);
    for (const size_t count : {3, 6, 10}) {
      tour::TourRequest request = Request(1);
      request.scans = count;
      const tour::Tour tour = Make(request, nullptr);
      std::vector<Eigen::Vector3d> made;
      std::vector<size_t> all;
      for (const tour::TourStop& stop : tour.stops) {
        all.push_back(made.size());
        made.push_back(stop.position);
      }
      const double share = TableOf(made).Share(all);
      const double best = StrongBest(table, count);
      figures_.Add({absl::StrCat("tour.best", count), share / best, "", ">= 0.95",
                    absl::StrFormat("%.1f %% of what is attainable, by the scene's own rays; the "
                                    "best of %d places by greedy and exchanges on the same: "
                                    "%.1f %%",
                                    100 * share, places.size(), 100 * best)});
    }
  }

  // A job that goes by its tours, all stops of one and then of one made anew, until the scene's own
  // rays have the goal; beside it the tour that was made before.
  void ReportJob(const tour::Tour& before) {
    std::vector<Eigen::Vector3d> made;
    std::vector<size_t> all;
    for (const tour::TourStop& stop : before.stops) {
      all.push_back(made.size());
      made.push_back(stop.position);
    }
    const std::string of =
        absl::StrFormat("%d stations of the tour attain %.1f %% by the scene's own rays",
                        before.stops.size(), 100 * TableOf(made).Share(all));
    if (!options_.full) {  // the job takes ten minutes
      absl::FPrintF(stderr, "  %s\n", of);
      return;
    }
    simulation::GroundTruth truth(*scene_.truth);
    std::vector<size_t> scans;  // by tour
    size_t number = 0;
    double attained = 0;
    for (tour::Tour tour = before; scans.size() < kMostTours && !tour.stops.empty();) {
      scans.push_back(0);
      for (const tour::TourStop& stop : tour.stops) {
        MakeScan(stop.position, number++);
        truth.AddScan(stop.position, parallel_);
        attained = truth.Measure().attained_share();
        ++scans.back();
        if (attained >= kGoal) break;
      }
      if (attained >= kGoal) break;
      tour::TourRequest request = Request(1);
      request.scanners[0].at = tour.stops.back().position;
      const auto view = model_->Publish();
      const auto problem =
          planning::PlanningProblem::Prepare({*view, scene_.scanner, config_}, parallel_).value();
      tour = Make(*problem, request, nullptr);
    }
    figures_.Add(
        {"tour.job",
         static_cast<double>(before.stops.size()) /
             static_cast<double>(std::max<size_t>(1, number)),
         "", "0.85 to 1.15",
         absl::StrFormat("%s; a job that went by it, and by tours made anew, took %d scans "
                         "to %.1f %% (%s)",
                         of, number, 100 * attained, absl::StrJoin(scans, " + "))});
  }
  // With its true pose.
  void MakeScan(const Eigen::Vector3d& place, size_t number) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(place);
    sensor::Scan scan;
    scan.scanner = scene_.scanner;
    scan.image = scene_.tracer->Scan(scene_.scanner, pose, simulation::ScanFaults{}, number,
                                     parallel_, scene_.preview);
    model_->Insert(absl::StrCat("scan", number), scan, pose, parallel_).value();
  }

  void Draw(const tour::Tour& tour) {
    if (options_.pictures.empty()) return;
    FleetJobResult drawn;
    for (const tour::TourStop& stop : tour.stops) {
      drawn.stops.push_back({stop.scanner, stop.position, stop.end, stop.way});
    }
    DrawTours(scene_, drawn, options_.pictures + "/tours.svg");
  }

  const BenchOptions& options_;
  parallel::Parallel& parallel_;
  Figures& figures_;
  const Instrument instrument_;
  FleetScene scene_;
  std::unique_ptr<model::PartialModel> model_;
  std::shared_ptr<const model::PlanningView> view_;
  planning::PlanningConfig config_;
  double prepare_seconds_ = 0;
  std::shared_ptr<const planning::PlanningProblem> problem_;
  std::vector<Seen> seen_;
  std::optional<tour::OverlapTable> overlap_;
  tour::GainElements elements_;
  std::optional<tour::TourTable> table_;
};

}  // namespace

void BenchTour(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (figures.Wants("tour.")) Tours(options, parallel, figures).Run();
}

}  // namespace vantage::bench
