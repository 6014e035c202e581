#include "core/registration/align/lattice_search.h"

#include <algorithm>
#include <cmath>

#include "core/sensor/scanner_model.h"

namespace vantage::registration {
namespace {

constexpr int kHeadings = Lattice::kHeadings;
// m, beyond which a sample does not fit: the half diagonal of the lattice (0.25 m), and what half a
// heading turns a wall three metres off (0.16 m). Any noise is small against it.
constexpr double kReach = 0.40;
constexpr float kCompatible = 0.75f;  // cosine between normals, as of the first stage
// Samples looked at: few for all candidates, more for the best of them. A share of 60 is off by
// 6 % at most, one sigma, which is why 3000 of up to a million are looked at twice; of 300, by 3 %.
constexpr size_t kFewSamples = Lattice::kFewestSamples;
constexpr size_t kManySamples = 300;
constexpr size_t kLookedAtTwice = 3000;
// Fewer still where candidates are many, which leave a share of them: the right one fits a third of
// the samples and more, most others a tenth, and a share of 16 is off by 12 %, one sigma.
constexpr size_t kFirstSamples = 16;
constexpr size_t kMany = 1'000'000;  // candidates
constexpr size_t kLeft = 5;          // one in so many
// m and headings between places: places nearer than a step lead to the same minimum.
constexpr double kNotTheSame = 0.30;
constexpr int kHeadingsNotTheSame = 2;
// Where a site repeats itself the right place need not be among the best: it may lie between those
// of the lattice, where another lies on one, and where the model ends it fits three quarters of
// what another does. Places as good as that are wanted however many they are, but one around each
// (m): the first stage's reach is half a metre.
constexpr float kAsGood = 0.5f;
constexpr double kGoodOnesApart = 0.60;

struct Candidate {
  float score = 0;
  int place = 0;
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

}  // namespace

LatticeFinds SearchLattice(const model::PlanningView& model, const CorrespondenceField& field,
                           const ScanSurface& surface, const Lattice& lattice,
                           const LatticeWish& wish, parallel::Parallel& parallel) {
  const auto at = [&](const Candidate& c) -> Eigen::Vector3f {
    return lattice.places[static_cast<size_t>(c.place)].cast<float>();
  };
  const auto better = [](const Candidate& a, const Candidate& b) {
    if (a.score != b.score) return a.score > b.score;
    return a.heading != b.heading ? a.heading < b.heading : a.place < b.place;
  };
  const size_t headings = lattice.headings.size();
  const bool many = lattice.size() > kMany;
  std::vector<std::vector<Candidate>> best(headings);
  parallel.For(headings, [&](size_t slot) {
    const int heading = lattice.headings[slot];
    const Turned turned = Turn(surface, lattice.upright, heading);
    std::vector<Candidate>& list = best[slot];
    const size_t first = many ? kFirstSamples : kFewSamples;
    list.reserve(lattice.places.size());
    for (int place = 0; place < static_cast<int>(lattice.places.size()); ++place) {
      Candidate c{0, place, heading};
      c.score = Fit(field, turned, first, at(c));
      list.push_back(c);
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
  LatticeFinds finds;
  for (const Candidate& c : all) {
    const bool enough = chosen.size() >= wish.least;
    if (enough && !(c.score >= kAsGood * all.front().score)) break;
    const double apart = enough ? kGoodOnesApart : kNotTheSame;
    const bool same = std::any_of(chosen.begin(), chosen.end(), [&](const Candidate& other) {
      const int turn = std::abs(c.heading - other.heading);
      return std::min(turn, kHeadings - turn) < kHeadingsNotTheSame &&
             (at(c) - at(other)).norm() < apart;
    });
    if (same) continue;
    if (chosen.size() >= wish.most) {
      finds.more = true;
      break;
    }
    chosen.push_back(c);
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() =
        Eigen::AngleAxisd(2 * sensor::kPi * c.heading / kHeadings, Eigen::Vector3d::UnitZ()) *
        lattice.upright;
    pose.translation() = at(c).cast<double>();
    finds.poses.push_back(pose);
  }
  return finds;
}

}  // namespace vantage::registration
