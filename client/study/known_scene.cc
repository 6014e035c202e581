#include "client/study/known_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "client/simulated_job/placement.h"

namespace vantage::study {
namespace {

using Eigen::Vector3d;

constexpr double kSnap = 0.5;  // m
constexpr int kOffsets = 4;    // per axis
constexpr double kSpacings[] = {1.25, 1.5, 1.75, 2, 2.25, 2.5, 3, 3.5, 4, 4.5, 5, 6, 7, 8};

ScanMade Place(const StudyScene& scene, uint64_t seed, int number, const Vector3d& position) {
  const simulated_job::PlacementErrors errors = scene.ErrorsFor(seed);
  const simulated_job::Placement placement =
      number == 1
          ? simulated_job::FirstPlacement(position, errors)
          : simulated_job::PlacementAt(position, number, Eigen::Isometry3d::Identity(), errors);
  ScanMade made;
  made.position = position;
  made.at = placement.T_scene_scan.translation();
  made.merged = true;
  return made;
}

// The allowed positions nearest to the grid's points, each once.
std::set<size_t> SnapGrid(const StudyScene& scene, double spacing, const Eigen::Vector2d& offset,
                          double height) {
  std::set<size_t> chosen;
  const Eigen::AlignedBox3d bounds = scene.site().mesh.Bounds();
  for (double x = bounds.min().x() + offset.x(); x < bounds.max().x(); x += spacing) {
    for (double y = bounds.min().y() + offset.y(); y < bounds.max().y(); y += spacing) {
      size_t best = 0;
      double least = kSnap;
      for (size_t i = 0; i < scene.positions().size(); ++i) {
        const Vector3d& at = scene.positions()[i];
        if (std::abs(at.z() - height) > 0.01) continue;
        const double distance = (at.head<2>() - Eigen::Vector2d(x, y)).norm();
        if (distance >= least) continue;
        least = distance;
        best = i;
      }
      if (least < kSnap) chosen.insert(best);
    }
  }
  return chosen;
}

// The ways between allowed positions, each row computed when it is first asked for.
class Ways {
 public:
  explicit Ways(const StudyScene& scene) : scene_(scene) {}
  const std::vector<double>& From(size_t position) {
    std::vector<double>& row = rows_[position];
    if (row.empty()) {
      row = scene_.walks().Distances(scene_.positions()[position], scene_.positions());
    }
    return row;
  }

 private:
  const StudyScene& scene_;
  std::map<size_t, std::vector<double>> rows_;
};

// Goes on to the nearest remaining place each time.
std::vector<size_t> WalkThrough(Ways& ways, size_t start, const std::set<size_t>& chosen) {
  std::set<size_t> left = chosen;
  std::vector<size_t> route;
  size_t at = start;
  while (!left.empty()) {
    const std::vector<double>& way = ways.From(at);
    at = *std::min_element(left.begin(), left.end(),
                           [&](size_t a, size_t b) { return way[a] < way[b]; });
    left.erase(at);
    route.push_back(at);
  }
  return route;
}

}  // namespace

void RunOracleJob(const StudyScene& scene, uint64_t seed, JobDiary& diary) {
  RunGivenJob(scene, seed, {}, diary);
}

void RunGivenJob(const StudyScene& scene, uint64_t seed, const std::vector<Vector3d>& route,
                 JobDiary& diary) {
  diary.Add(Place(scene, seed, 1, scene.StartFor(seed)));
  for (const Vector3d& position : route) {
    if (diary.Over()) break;
    diary.Add(Place(scene, seed, diary.scans() + 1, position));
  }
  while (!diary.Over()) {
    const JobDiary::Best best = diary.BestNow();
    if (best.new_samples == 0) {
      diary.record().set_ended("nothing is left to gain");
      return;
    }
    diary.Add(Place(scene, seed, diary.scans() + 1, scene.positions()[best.position]));
  }
  diary.record().set_ended("enough is covered, or as many scans made as allowed");
}

RegularSpacing BestSpacing(const StudyScene& scene, uint64_t seed) {
  constexpr size_t kNever = std::numeric_limits<size_t>::max();
  const size_t start = scene.StartIndex(seed);
  const size_t all = CountOf(scene.attainable());
  const auto goal =
      static_cast<size_t>(std::ceil(scene.settings().goal * static_cast<double>(all)));
  std::set<double> heights;
  for (const Vector3d& at : scene.positions()) heights.insert(at.z());

  Ways ways(scene);
  RegularSpacing best;
  // Grids are compared by the scans needed, then by what is missing early. Where the goal is out of
  // reach, what is missing at the end counts: a coarse grid covers more early, but soon has no
  // places left.
  std::pair<size_t, size_t> best_merit = {kNever, kNever};
  for (const double spacing : kSpacings) {
    for (int offset = 0; offset < kOffsets * kOffsets; ++offset) {
      const int row = offset / kOffsets;
      const int column = offset % kOffsets;
      const Eigen::Vector2d shift = spacing / kOffsets * Eigen::Vector2d(column + 0.5, row + 0.5);
      for (const double height : heights) {
        const std::vector<size_t> route =
            WalkThrough(ways, start, SnapGrid(scene, spacing, shift, height));
        simulation::SampleSet covered = scene.sets()[start];
        size_t now = CountOf(covered);
        std::pair<size_t, size_t> merit = {now >= goal ? 1 : kNever, 0};
        for (size_t scans = 2; scans <= static_cast<size_t>(scene.most_scans()); ++scans) {
          if (scans - 2 < route.size()) {
            AddTo(covered, scene.sets()[route[scans - 2]]);
            now = CountOf(covered);
          }
          if (now >= goal) merit.first = std::min(merit.first, scans);
          merit.second += all - now;
        }
        if (merit.first == kNever) merit.second = all - now;
        if (merit >= best_merit) continue;
        best_merit = merit;
        best.spacing = spacing;
        best.route.clear();
        for (const size_t i : route) best.route.push_back(scene.positions()[i]);
      }
    }
  }
  return best;
}

}  // namespace vantage::study
