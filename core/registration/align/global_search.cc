#include "core/registration/align/global_search.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "absl/strings/str_format.h"
#include "core/registration/align/floor_plane.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {
namespace {

// Steps that leave the alignment's first stage at most its reach of half a metre to bridge, with
// the walls some metres off.
constexpr double kPlaceStep = 0.35;  // m
constexpr int kHeadings = 60;
// m, beyond which a sample does not fit: the half diagonal of the lattice (0.25 m), and what half a
// heading turns a wall three metres off (0.16 m). Any noise is small against it.
constexpr double kReach = 0.40;
constexpr float kCompatible = 0.75f;  // cosine between normals, as of the first stage
// Samples looked at: few for all candidates, more for the best of them. A share of 60 is off by
// 6 % at most, one sigma, which is why 3000 of up to a million are looked at twice; of 300, by 3 %.
constexpr size_t kFewSamples = 60;
// Fewer still where candidates are many, which leave a share of them: the right one fits a third of
// the samples and more, most others a tenth, and a share of 16 is off by 12 %, one sigma.
constexpr size_t kFirstSamples = 16;
constexpr size_t kMany = 1'000'000;  // candidates
constexpr size_t kLeft = 5;          // one in so many
constexpr size_t kManySamples = 300;
constexpr size_t kLookedAtTwice = 3000;
constexpr size_t kPlaces = 160;       // places from which alignments start
constexpr size_t kPlacesAround = 16;  // around a prior, beside the starts there
// Of a prior, as far as it may be wrong: one in ninety is farther off on a plane.
constexpr double kSigmas = 3;
// m: whoever knows less knows nothing, and is served as well without a prior.
constexpr double kMostShift = 200;
// m and headings between places: places nearer than a step lead to the same minimum.
constexpr double kNotTheSame = 0.30;
constexpr int kHeadingsNotTheSame = 2;
// Five seconds on two cores: 10,000 m2 with three heights.
constexpr size_t kMostCandidates = 16'000'000;
// The same around a prior, which every scan is aligned from.
constexpr size_t kMostAround = 500'000;
// m: a scanner stands where space is known, or this far beyond it, in a doorway or the next room.
constexpr double kBeyondKnown = 3.0;
// The floors of scan and model.
constexpr double kMaxTilt = sensor::Radians(12);  // of a tripod set up by eye
// m, of a bin of heights, whatever the voxels: floors are even, and centroids right, to a few
// centimetres, and a step is higher. The height comes from three bins, to a centimetre.
constexpr double kFloorBin = 0.10;
constexpr float kLevel = 0.95f;      // cosine to the vertical: 18 degrees, for noisy normals
constexpr double kLeastFloor = 2.0;  // m^2: larger than tables are
constexpr size_t kMostFloors = 3;    // heights that are tried: each costs a whole search
// m, up and down, when no floor is seen: tripods differ in height by this much.
constexpr double kHeightOverStation = 0.3;

struct Candidate {
  float score = 0;
  int place = 0;
  int height = 0;
  int heading = 0;
};

struct Turned {
  std::vector<Eigen::Vector3f> point;  // relative to the scanner, world's directions
  std::vector<Eigen::Vector3f> normal;
};

Turned Turn(const ScanSurface& surface, const Eigen::Matrix3d& upright, int heading) {
  const Eigen::Matrix3f turn =
      (Eigen::AngleAxisd(2 * sensor::kPi * heading / kHeadings, Eigen::Vector3d::UnitZ()) * upright)
          .cast<float>();
  Turned turned;
  const size_t count = std::min(kManySamples, surface.samples.size());
  for (size_t i = 0; i < count; ++i) {
    turned.point.emplace_back(turn * surface.samples[i].point);
    turned.normal.emplace_back(turn * surface.samples[i].normal);
  }
  return turned;
}

// Sum over samples of how near compatible surface is.
float Fit(const CorrespondenceField& field, const Turned& turned, size_t count,
          const Eigen::Vector3f& at) {
  constexpr auto kFar = static_cast<float>(kReach * kReach);
  float sum = 0;
  for (size_t i = 0; i < std::min(count, turned.point.size()); ++i) {
    const Eigen::Vector3f point = turned.point[i] + at;
    const SurfaceElement* element = field.Nearest(point, turned.normal[i]);
    if (element == nullptr || turned.normal[i].dot(element->normal) < kCompatible) continue;
    const float along = (point - element->centroid).dot(element->normal);
    const float gap = (point - element->centroid).squaredNorm();
    if (gap < kFar) sum += 1 - along * along / kFar;
  }
  return sum / static_cast<float>(std::max<size_t>(1, std::min(count, turned.point.size())));
}

// The share of the scan's samples that would lie in space known to be empty.
float Misplaced(const model::PlanningView& model, const CorrespondenceField& field,
                const Turned& turned, const Eigen::Vector3f& at) {
  size_t misplaced = 0;
  for (size_t i = 0; i < turned.point.size(); ++i) {
    const Eigen::Vector3f point = turned.point[i] + at;
    if (!model.Empty(model.At(point.cast<double>()))) continue;
    const SurfaceElement* element = field.Nearest(point, turned.normal[i]);
    const bool near = element != nullptr && (point - element->centroid).squaredNorm() <
                                                static_cast<float>(kReach * kReach);
    misplaced += near ? 0 : 1;
  }
  return static_cast<float>(misplaced) /
         static_cast<float>(std::max<size_t>(1, turned.point.size()));
}

// Heights of level surface that much of the model lies at, largest first.
std::vector<double> Floors(const model::PlanningView& model) {
  std::map<int, double> area;
  model.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& voxel) {
        if (state != model::VoxelState::kTrueSurface || voxel.normal.z() < kLevel) return;
        area[static_cast<int>(std::floor(voxel.centroid.z() / kFloorBin))] += voxel.area;
      });
  std::vector<std::pair<double, double>> floors;  // area, height
  for (const auto& [bin, own] : area) {
    const auto at = [&](int other) {
      const auto it = area.find(other);
      return it == area.end() ? 0.0 : it->second;
    };
    if (at(bin - 1) > own || at(bin + 1) >= own) continue;
    const double sum = at(bin - 1) + own + at(bin + 1);
    if (sum < kLeastFloor) continue;
    const double middle = (at(bin + 1) - at(bin - 1)) / sum + bin + 0.5;
    floors.emplace_back(sum, middle * kFloorBin);
  }
  std::sort(floors.rbegin(), floors.rend());
  std::vector<double> heights;
  for (const auto& [sum, height] : floors) {
    if (heights.size() < kMostFloors) heights.push_back(height);
  }
  return heights;
}

// z of the scanner, m.
std::vector<double> Heights(const model::PlanningView& model, const FloorPlane* floor) {
  std::vector<double> heights;
  if (floor != nullptr) {
    for (const double z : Floors(model)) heights.push_back(z - floor->height);
  }
  if (!heights.empty()) return heights;
  for (const model::Station& station : model.stations()) {
    for (const double off : {-kHeightOverStation, 0.0, kHeightOverStation}) {
      const double z = station.position.z() + off;
      const bool near = std::any_of(heights.begin(), heights.end(), [z](double other) {
        return std::abs(other - z) < 0.5 * kHeightOverStation;
      });
      if (!near) heights.push_back(z);
    }
  }
  return heights;
}

// Whether space is known to be empty at one of the heights, at the place or around it.
bool NearKnown(const model::PlanningView& model, const Eigen::Vector2d& place,
               const std::vector<double>& heights) {
  constexpr int kAround = 8;
  for (const double z : heights) {
    for (const double away : {0.0, 0.5 * kBeyondKnown, kBeyondKnown}) {
      for (int k = 0; k < (away > 0 ? kAround : 1); ++k) {
        const double angle = 2 * sensor::kPi * k / kAround;
        if (model.Empty(model.At(
                {place.x() + away * std::cos(angle), place.y() + away * std::sin(angle), z}))) {
          return true;
        }
      }
    }
  }
  return false;
}

// Where a scan is tried: all combinations.
struct Lattice {
  std::vector<Eigen::Vector2d> places;                    // m
  std::vector<double> heights;                            // z of the scanner, m
  std::vector<int> headings;                              // of kHeadings, about the vertical,
  Eigen::Matrix3d upright = Eigen::Matrix3d::Identity();  // after this
};

// The best of them, at most `most`, apart from each other.
std::vector<Eigen::Isometry3d> SearchLattice(const model::PlanningView& model,
                                             const CorrespondenceField& field,
                                             const ScanSurface& surface, const Lattice& lattice,
                                             size_t most, parallel::Parallel& parallel) {
  const auto at = [&](const Candidate& c) -> Eigen::Vector3f {
    const Eigen::Vector2d& place = lattice.places[static_cast<size_t>(c.place)];
    return Eigen::Vector3d(place.x(), place.y(), lattice.heights[static_cast<size_t>(c.height)])
        .cast<float>();
  };
  const auto better = [](const Candidate& a, const Candidate& b) {
    if (a.score != b.score) return a.score > b.score;
    if (a.heading != b.heading) return a.heading < b.heading;
    return a.height != b.height ? a.height < b.height : a.place < b.place;
  };
  const size_t headings = lattice.headings.size();
  const bool many = lattice.places.size() * lattice.heights.size() * headings > kMany;
  std::vector<std::vector<Candidate>> best(headings);
  parallel.For(headings, [&](size_t slot) {
    const int heading = lattice.headings[slot];
    const Turned turned = Turn(surface, lattice.upright, heading);
    std::vector<Candidate>& list = best[slot];
    const size_t first = many ? kFirstSamples : kFewSamples;
    list.reserve(lattice.heights.size() * lattice.places.size());
    for (int height = 0; height < static_cast<int>(lattice.heights.size()); ++height) {
      for (int place = 0; place < static_cast<int>(lattice.places.size()); ++place) {
        Candidate c{0, place, height, heading};
        c.score = Fit(field, turned, first, at(c));
        list.push_back(c);
      }
    }
    if (many) {
      const size_t left = list.size() / kLeft + 1;
      std::nth_element(list.begin(), list.begin() + static_cast<ptrdiff_t>(left), list.end(),
                       better);
      list.resize(left);
      list.shrink_to_fit();
      for (Candidate& c : list) c.score = Fit(field, turned, kFewSamples, at(c));
    }
    const size_t keep = std::min(list.size(), 4 * kLookedAtTwice / headings);
    std::partial_sort(list.begin(), list.begin() + static_cast<ptrdiff_t>(keep), list.end(),
                      better);
    list.resize(keep);
  });
  std::vector<Candidate> all;
  for (const auto& list : best) all.insert(all.end(), list.begin(), list.end());
  std::sort(all.begin(), all.end(), better);
  if (all.size() > kLookedAtTwice) all.resize(kLookedAtTwice);
  std::vector<std::vector<Candidate>> by_heading(kHeadings);
  for (const Candidate& c : all) by_heading[static_cast<size_t>(c.heading)].push_back(c);
  parallel.For(kHeadings, [&](size_t heading) {
    if (by_heading[heading].empty()) return;
    const Turned turned = Turn(surface, lattice.upright, static_cast<int>(heading));
    for (Candidate& c : by_heading[heading]) {
      const Eigen::Vector3f place = at(c);
      c.score = Fit(field, turned, kManySamples, place) - Misplaced(model, field, turned, place);
    }
  });
  all.clear();
  for (const auto& list : by_heading) all.insert(all.end(), list.begin(), list.end());
  std::sort(all.begin(), all.end(), better);

  std::vector<Candidate> chosen;
  std::vector<Eigen::Isometry3d> poses;
  for (const Candidate& c : all) {
    if (chosen.size() >= most) break;
    const bool same = std::any_of(chosen.begin(), chosen.end(), [&](const Candidate& other) {
      const int turn = std::abs(c.heading - other.heading);
      return std::min(turn, kHeadings - turn) < kHeadingsNotTheSame &&
             (at(c) - at(other)).norm() < kNotTheSame;
    });
    if (same) continue;
    chosen.push_back(c);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() =
        Eigen::AngleAxisd(2 * sensor::kPi * c.heading / kHeadings, Eigen::Vector3d::UnitZ()) *
        lattice.upright;
    pose.translation() = at(c).cast<double>();
    poses.push_back(pose);
  }
  return poses;
}

}  // namespace

GlobalSearch SearchGlobally(const model::PlanningView& model, const CorrespondenceField& field,
                            const ScanSurface& surface, double spacing,
                            parallel::Parallel& parallel) {
  GlobalSearch search;
  FloorPlane floor;
  search.floor_found = FindFloorPlane(surface.samples, spacing, kMaxTilt, floor);
  Lattice lattice;
  if (search.floor_found) {
    lattice.upright = Eigen::Quaterniond::FromTwoVectors(floor.normal, Eigen::Vector3d::UnitZ())
                          .toRotationMatrix();
  }
  lattice.heights = Heights(model, search.floor_found ? &floor : nullptr);
  // A scanner stands where space is known, or a step beyond: in a doorway, in the next room.
  const double h = model.voxel_size();
  const Eigen::Vector2d low = model.bounds().min.cast<double>().head<2>() * h;
  const Eigen::Vector2d size = model.bounds().max.cast<double>().head<2>() * h - low;
  const int columns = static_cast<int>(size.x() / kPlaceStep) + 1;
  const int rows = static_cast<int>(size.y() / kPlaceStep) + 1;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const Eigen::Vector2d place(low.x() + (column + 0.5) * kPlaceStep,
                                  low.y() + (row + 0.5) * kPlaceStep);
      if (NearKnown(model, place, lattice.heights)) lattice.places.push_back(place);
    }
  }
  if (lattice.places.size() * lattice.heights.size() * kHeadings > kMostCandidates) {
    search.why_not =
        absl::StrFormat("the site (%.0f x %.0f m) is too large to be searched", size.x(), size.y());
    return search;
  }
  lattice.headings.resize(kHeadings);
  std::iota(lattice.headings.begin(), lattice.headings.end(), 0);
  if (lattice.places.empty() || lattice.heights.empty() || surface.samples.size() < kFewSamples) {
    search.why_not = "too little surface to look for its place";
    return search;
  }
  search.places = SearchLattice(model, field, surface, lattice, kPlaces, parallel);
  return search;
}

PriorReach ReachOf(const sensor::PosePrior& prior) {
  PriorReach reach;
  if (!prior.covariance.has_value()) return reach;
  const sensor::Matrix6d& covariance = *prior.covariance;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> horizontal(covariance.block<2, 2>(3, 3));
  const auto sigmas = [](double variance, double most) {
    return std::min(kSigmas * std::sqrt(std::max(0.0, variance)), most);
  };
  reach.shift = sigmas(horizontal.eigenvalues()[1], kMostShift);
  reach.rise = sigmas(covariance(5, 5), kMostShift);
  reach.turn = sigmas(covariance(2, 2), sensor::kPi);
  return reach;
}

std::vector<Eigen::Isometry3d> SearchAround(const model::PlanningView& model,
                                            const CorrespondenceField& field,
                                            const ScanSurface& surface, double spacing,
                                            const sensor::PosePrior& prior,
                                            parallel::Parallel& parallel) {
  const PriorReach reach = ReachOf(prior);
  if (surface.samples.size() < kFewSamples) return {};
  const Eigen::Vector3d at = prior.T_world_scan.translation();
  Lattice lattice;
  lattice.upright = prior.T_world_scan.linear();
  lattice.heights = {at.z()};
  if (reach.rise > kHeightOverStation) {
    FloorPlane floor;
    const bool found = FindFloorPlane(surface.samples, spacing, kMaxTilt, floor);
    for (const double z : Heights(model, found ? &floor : nullptr)) {
      if (std::abs(z - at.z()) <= reach.rise) lattice.heights.push_back(z);
    }
  }
  // All that the prior allows, or as much of it around its middle as is not too much work.
  for (int heading = 0; heading < kHeadings; ++heading) {
    const double turn = 2 * sensor::kPi * std::min(heading, kHeadings - heading) / kHeadings;
    if (turn <= reach.turn + 1e-9) lattice.headings.push_back(heading);
  }
  const size_t each = lattice.heights.size() * lattice.headings.size();
  const double most = static_cast<double>(kMostAround) / static_cast<double>(each);
  const double radius = std::min(reach.shift, kPlaceStep * std::sqrt(most / sensor::kPi));
  const int steps = static_cast<int>(radius / kPlaceStep);
  for (int y = -steps; y <= steps; ++y) {
    for (int x = -steps; x <= steps; ++x) {
      const Eigen::Vector2d shift = kPlaceStep * Eigen::Vector2d(x, y);
      if (shift.norm() <= radius) lattice.places.push_back(at.head<2>() + shift);
    }
  }
  return SearchLattice(model, field, surface, lattice, kPlacesAround, parallel);
}

}  // namespace vantage::registration
