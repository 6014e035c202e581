#include "tests/bench/fleet_job.h"

#include <algorithm>
#include <array>
#include <bit>
#include <fstream>
#include <limits>
#include <optional>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/fleet/fleet_request.h"
#include "core/fleet/joint_plan.h"
#include "core/fleet/travel.h"
#include "core/model/partial_model.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/standable_positions.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::bench {
namespace {

constexpr double kHeight = 1.5;  // m, of the viewpoints that are allowed
// m, around the first scan, where the others stand: a fleet comes in by one door, and the floor
// there is in the first scan, so that everybody can be sent somewhere after it.
constexpr double kGathering = 5;

size_t Count(const simulation::SampleSet& set) {
  size_t count = 0;
  for (const uint64_t word : set) count += static_cast<size_t>(std::popcount(word));
  return count;
}

// `first` and others of `positions` near it and in its sight, each the farthest from those before.
std::vector<Eigen::Vector3d> StandsAround(const Eigen::Vector3d& first,
                                          const std::vector<Eigen::Vector3d>& positions,
                                          const simulation::SimulatedScanner& tracer) {
  std::vector<Eigen::Vector3d> near;
  for (const Eigen::Vector3d& p : positions) {
    if ((p - first).norm() <= kGathering && tracer.Visible(first, p)) near.push_back(p);
  }
  std::vector<Eigen::Vector3d> stands = {first};
  const auto distance = [&](const Eigen::Vector3d& p) {
    double least = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector3d& other : stands) least = std::min(least, (p - other).norm());
    return least;
  };
  while (stands.size() < std::min(kMostFleetScanners, near.size() + 1)) {
    const auto next = std::max_element(near.begin(), near.end(),
                                       [&](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
                                         return distance(a) < distance(b);
                                       });
    const Eigen::Vector3d chosen = *next;
    stands.push_back(chosen);
  }
  return stands;
}

// One scanner's state.
struct Member {
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  std::optional<Eigen::Vector3d> going;  // to
  double done = 0;                       // min, when its scan will be in
};

class FleetJob {
 public:
  FleetJob(const FleetScene& scene, const FleetJobOptions& options, parallel::Parallel& parallel)
      : scene_(scene),
        options_(options),
        parallel_(parallel),
        truth_(*scene.truth),
        model_(model::PartialModel::Create({}).value()),
        members_(options.scanners),
        ways_(options.scanners) {}

  FleetJobResult Run() {
    for (size_t i = 0; i < members_.size(); ++i) {
      members_[i].at = scene_.stands[i % scene_.stands.size()];
    }
    members_[0].going = members_[0].at;
    members_[0].done = options_.scan_seconds / 60;
    while (result_.scans < options_.most_scans) {
      const auto next =
          std::min_element(members_.begin(), members_.end(), [](const Member& a, const Member& b) {
            return (a.going ? a.done : kNever) < (b.going ? b.done : kNever);
          });
      if (!next->going.has_value()) break;  // no scanner has a view to go to
      MakeScan(*next);
      if (result_.attained >= options_.target) break;
      const auto view = model_->Publish();
      // The scanner that has waited longest comes first.
      for (Member& member : members_) {
        if (!member.going.has_value()) SendOut(*view, member);
      }
    }
    if (attained_ > 0) {
      result_.times = static_cast<double>(measured_) / static_cast<double>(attained_);
      result_.waste = 1 - 1 / result_.times;
    }
    return std::move(result_);
  }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();

  void MakeScan(Member& member) {
    now_ = member.done;
    member.at = *member.going;
    member.going.reset();
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(member.at);
    sensor::Scan scan;
    scan.scanner = scene_.scanner;
    scan.image = scene_.tracer->Scan(scene_.scanner, pose, simulation::ScanFaults{}, result_.scans,
                                     parallel_, scene_.preview);
    model_->Insert(absl::StrCat("scan", result_.scans), scan, pose, parallel_).value();
    measured_ += Count(truth_.MeasuredAtDensity({member.at}, parallel_)[0]);
    truth_.AddScan(member.at, parallel_);
    attained_ = Count(truth_.AtDensity());
    result_.attained = truth_.Measure().attained_share();
    result_.minutes = now_;
    ++result_.scans;
    result_.stops.push_back({IndexOf(member), member.at, now_, std::move(WayOf(member))});
  }

  size_t IndexOf(const Member& member) const {
    return static_cast<size_t>(&member - members_.data());
  }
  std::vector<Eigen::Vector3d>& WayOf(const Member& member) { return ways_[IndexOf(member)]; }

  void SendOut(const model::PlanningView& view, Member& member) {
    fleet::FleetRequest request;
    request.scanners = {{scene_.scanner, member.at, {}, options_.speed, options_.scan_seconds}};
    request.ranking = fleet::FleetRanking::kScorePerMinute;
    for (const Member& other : members_) {
      if (options_.claims && other.going.has_value()) {
        request.pledged.push_back({*other.going, scene_.scanner});
      }
    }
    planning::PlanningConfig config;
    config.candidates = 1;
    config.seed = options_.most_scans * IndexOf(member) + result_.scans + 1;
    parallel::Budget budget;
    budget.work_limit = options_.plan_work;
    const auto plan = fleet::MakeJointPlan(view, request, config, budget, parallel_,
                                           [](const planning::Plan&) {});
    if (!plan.ok() || plan->plan.views.empty() ||
        plan->plan.views[0].score < options_.enough * config.required_density) {
      return;
    }
    const Eigen::Vector3d to = plan->plan.views[0].position;
    const visibility::OpaqueGrid grid(view);
    const planning::FeasibleViews feasible =
        planning::FeasibleViews::Find(view, grid, scene_.scanner, config, parallel_).value();
    WayOf(member) = fleet::TravelMap(fleet::WalkGridOf(feasible, {}), member.at).Way(to);
    member.going = to;
    member.done = now_ + plan->journeys[0].minutes.value_or(options_.scan_seconds / 60);
  }

  const FleetScene& scene_;
  const FleetJobOptions& options_;
  parallel::Parallel& parallel_;
  simulation::GroundTruth truth_;
  std::unique_ptr<model::PartialModel> model_;
  std::vector<Member> members_;
  std::vector<std::vector<Eigen::Vector3d>> ways_;
  FleetJobResult result_;
  double now_ = 0;       // min
  size_t measured_ = 0;  // samples, over all scans
  size_t attained_ = 0;  // samples
};

}  // namespace

FleetScene MakeFleetScene(uint64_t seed, double area, parallel::Parallel& parallel,
                          const sensor::ScannerModel& scanner, double preview) {
  FleetScene made;
  made.scanner = scanner;
  made.preview = preview;
  made.scene = simulation::OfficeStorey(seed, area);
  made.tracer = std::make_unique<simulation::SimulatedScanner>(made.scene.mesh);
  const std::vector<Eigen::Vector3d> positions =
      simulation::StandablePositions(*made.tracer, made.scene.mesh.Bounds(), made.scene.starts[0],
                                     made.scene.floor_height, kHeight, made.scanner.clearance, 0.4);
  made.truth = std::make_unique<simulation::GroundTruth>(
      made.scene.mesh, *made.tracer, made.scanner, planning::PlanningConfig().required_density,
      positions, static_cast<size_t>(100 * area), parallel);
  made.stands = StandsAround(made.scene.starts[0], positions, *made.tracer);
  return made;
}

FleetJobResult RunFleetJob(const FleetScene& scene, const FleetJobOptions& options,
                           parallel::Parallel& parallel) {
  return FleetJob(scene, options, parallel).Run();
}

bool DrawTours(const FleetScene& scene, const FleetJobResult& result, const std::string& path) {
  constexpr double kScale = 24;  // px a metre
  constexpr double kCut = 1.2;   // m, the height at which the floor plan is cut
  constexpr std::array<const char*, 8> kColours = {"#d62728", "#1f77b4", "#2ca02c", "#9467bd",
                                                   "#ff7f0e", "#17becf", "#8c564b", "#e377c2"};
  const Eigen::AlignedBox3d bounds = scene.scene.mesh.Bounds();
  const Eigen::Vector3d size = kScale * bounds.sizes();
  const auto x = [&](double value) { return kScale * (value - bounds.min().x()); };
  const auto y = [&](double value) { return kScale * (bounds.max().y() - value); };
  std::ofstream out(path);
  out << absl::StrFormat(
      "<svg xmlns='http://www.w3.org/2000/svg' width='%.0f' height='%.0f' font-family='sans-serif' "
      "font-size='12'>\n<rect width='100%%' height='100%%' fill='white'/>\n<g stroke='#444' "
      "stroke-width='1.2'>\n",
      size.x(), size.y());
  for (const auto& triangle : scene.scene.mesh.triangles) {
    std::vector<Eigen::Vector2d> cut;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d a =
          scene.scene.mesh.vertices[triangle[static_cast<size_t>(k)]].cast<double>();
      const Eigen::Vector3d b =
          scene.scene.mesh.vertices[triangle[static_cast<size_t>((k + 1) % 3)]].cast<double>();
      if ((a.z() < kCut) == (b.z() < kCut)) continue;
      const double t = (kCut - a.z()) / (b.z() - a.z());
      cut.emplace_back((a + t * (b - a)).head<2>());
    }
    if (cut.size() != 2) continue;
    out << absl::StrFormat("<line x1='%.1f' y1='%.1f' x2='%.1f' y2='%.1f'/>\n", x(cut[0].x()),
                           y(cut[0].y()), x(cut[1].x()), y(cut[1].y()));
  }
  out << "</g>\n";
  for (const FleetStop& stop : result.stops) {
    const char* colour = kColours[stop.scanner % kColours.size()];
    std::string points;
    for (const Eigen::Vector3d& p : stop.way) {
      absl::StrAppendFormat(&points, "%.1f,%.1f ", x(p.x()), y(p.y()));
    }
    out << absl::StrFormat(
        "<polyline points='%s' fill='none' stroke='%s' stroke-width='2'/>\n<circle cx='%.1f' "
        "cy='%.1f' r='7' fill='%s'/>\n<text x='%.1f' y='%.1f' fill='%s'>%.0f</text>\n",
        points, colour, x(stop.position.x()), y(stop.position.y()), colour,
        x(stop.position.x()) + 9, y(stop.position.y()) - 4, colour, stop.minutes);
  }
  out << "</svg>\n";
  return out.good();
}

}  // namespace vantage::bench
