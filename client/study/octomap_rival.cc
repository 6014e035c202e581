#include "client/study/octomap_rival.h"

#include <octomap/OcTree.h>

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "core/simulation/random_sequence.h"

namespace vantage::study {
namespace {

constexpr double kResolution = 0.1;  // m
constexpr double kGainRange = 5.0;   // m
constexpr int kCandidates = 80;
constexpr double kRayStep = sensor::Radians(6);
constexpr int kThinning = 4;  // every so many columns and rows are inserted
constexpr uint64_t kDrawStream = 400;

octomap::point3d ToPoint(const Eigen::Vector3d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

class Octomap final : public Rival {
 public:
  explicit Octomap(const sensor::ScannerModel& scanner) : scanner_(scanner), tree_(kResolution) {}

  void SeeScan(const sensor::RangeImage& image, const Eigen::Isometry3d& T_world_scan) override {
    octomap::Pointcloud cloud;
    for (int column = 0; column < image.columns(); column += kThinning) {
      for (int row = 0; row < image.rows(); row += kThinning) {
        const float range = image.at(column, row);
        if (!sensor::RangeImage::IsRange(range)) continue;
        cloud.push_back(
            ToPoint(T_world_scan * (static_cast<double>(range) * image.Direction(column, row))));
      }
    }
    tree_.insertPointCloud(cloud, ToPoint(T_world_scan.translation()), scanner_.range_max,
                           /*lazy_eval=*/true, /*discretize=*/true);
    tree_.updateInnerOccupancy();
  }

  Proposal Propose(const PlanningSituation& s) override {
    const size_t count = s.problem.feasible().cells().size();
    if (count == 0) return {std::nullopt, std::nullopt, "no place is feasible"};
    std::vector<size_t> volume(kCandidates, 0);
    std::vector<Eigen::Vector3d> places(kCandidates);
    for (int i = 0; i < kCandidates; ++i) {
      const uint64_t draw =
          simulation::RandomBits(s.seed, static_cast<uint64_t>(s.number * kCandidates + i),
                                 kDrawStream + s.problem.config().rejected.size());
      places[static_cast<size_t>(i)] = s.problem.feasible().Centre(draw % count);
    }
    s.parallel.For(places.size(), [&](size_t i) { volume[i] = UnknownFrom(places[i]); });
    const auto best = std::max_element(volume.begin(), volume.end());
    if (*best == 0)
      return {std::nullopt, std::nullopt, "no unknown volume is visible from any place"};
    return {places[static_cast<size_t>(best - volume.begin())], std::nullopt, ""};
  }

 private:
  // Unknown cells along the rays of the scanner, each counted once, up to what is occupied.
  size_t UnknownFrom(const Eigen::Vector3d& place) const {
    std::unordered_set<octomap::OcTreeKey, octomap::OcTreeKey::KeyHash> unknown;
    octomap::KeyRay ray;
    for (double elevation = scanner_.elevation_min; elevation <= scanner_.elevation_max;
         elevation += kRayStep) {
      const double turn = kRayStep / std::max(std::cos(elevation), 0.05);
      for (double azimuth = 0; azimuth < 2 * sensor::kPi; azimuth += turn) {
        const Eigen::Vector3d direction(std::cos(elevation) * std::cos(azimuth),
                                        std::cos(elevation) * std::sin(azimuth),
                                        std::sin(elevation));
        if (!tree_.computeRayKeys(ToPoint(place), ToPoint(place + kGainRange * direction), ray)) {
          continue;
        }
        for (const octomap::OcTreeKey& key : ray) {
          const octomap::OcTreeNode* node = tree_.search(key);
          if (node == nullptr) {
            unknown.insert(key);
          } else if (tree_.isNodeOccupied(node)) {
            break;
          }
        }
      }
    }
    return unknown.size();
  }

  sensor::ScannerModel scanner_;
  octomap::OcTree tree_;
};

}  // namespace

std::unique_ptr<Rival> OctomapRival(const sensor::ScannerModel& scanner) {
  return std::make_unique<Octomap>(scanner);
}

}  // namespace vantage::study
