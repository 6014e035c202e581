// Scans where a site repeats itself, with priors that may lead to the wrong bay: what is registered
// there, and how much is doubted where nothing repeats itself.
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/model/partial_model.h"
#include "core/registration/bound/registration_result.h"
#include "core/registration/registration.h"
#include "core/simulation/random_sequence.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {
namespace {

using Eigen::Vector3d;

// m, one sigma of each horizontal axis, that priors state and have: a total station or a vendor's
// own registration, odometry, a spot on a plan, a spot on a plan of a bare building.
constexpr std::array kPriorSigmas = {0.05, 0.3, 1.0, 2.0};
constexpr double kUpSigma = 0.05;                  // m
constexpr double kTurnSigma = sensor::Radians(5);  // of the heading
constexpr double kTiltSigma = sensor::Radians(1);
constexpr double kOutOfReach = 60;  // m, half of what is longer than ranges

struct RepetitiveScene {
  simulation::TriangleMesh mesh;
  double bay = 0;                 // m, by which it repeats itself
  std::vector<Vector3d> scanned;  // stations of the model
  std::vector<Vector3d> places;   // of scans to come
};

// A corridor longer than ranges with a pillar each bay on both sides; of `marks` other things along
// it none repeats itself.
RepetitiveScene PillarCorridor(uint64_t seed, uint64_t marks) {
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 71);
  RepetitiveScene scene;
  simulation::MeshBuilder builder(scene.mesh);
  const double half = random.Between(1.0, 1.7);
  const double height = random.Between(2.4, 3.2);
  scene.bay = random.Between(1.5, 4.0);
  builder.Box({-kOutOfReach, -half, 0}, {kOutOfReach, half, height});
  const double depth = random.Between(0.12, 0.35);
  const double width = random.Between(0.25, 0.6);
  for (double x = -kOutOfReach; x + width < kOutOfReach; x += scene.bay) {
    builder.Box({x, -half, 0}, {x + width, -half + depth, height});
    builder.Box({x, half - depth, 0}, {x + width, half, height});
  }
  for (uint64_t i = 0; i < marks; ++i) {
    const double x = random.Between(-12, 16);
    const double side = random.Chance(0.5) ? -half + depth : half - depth - 0.25;
    const double z = random.Between(0, 1.5);
    builder.Box({x, side, z}, {x + random.Between(0.3, 0.9), side + 0.25, z + 0.8});
  }
  const double eye = 1.5;
  scene.scanned = {{0, 0.1, eye}, {random.Between(2.5, 4), -0.1, eye}};
  for (int i = 0; i < 3; ++i) {
    scene.places.emplace_back(random.Between(3, 9), random.Between(-0.2, 0.2), eye);
  }
  return scene;
}

// A parking deck with a column each bay, both ways.
RepetitiveScene ParkingDeck(uint64_t seed) {
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 72);
  RepetitiveScene scene;
  simulation::MeshBuilder builder(scene.mesh);
  scene.bay = random.Between(3.5, 6.0);
  const double width = random.Between(0.3, 0.6);
  const double height = random.Between(2.3, 2.8);
  builder.Box({-kOutOfReach, -kOutOfReach, 0}, {kOutOfReach, kOutOfReach, height});
  const int bays = static_cast<int>(kOutOfReach / scene.bay);
  for (int x = -bays; x <= bays; ++x) {
    for (int y = -bays; y <= bays; ++y) {
      const Vector3d low((x + 0.5) * scene.bay, (y + 0.5) * scene.bay, 0);
      builder.Box(low, low + Vector3d(width, width, height));
    }
  }
  const double eye = 1.5;
  scene.scanned = {{0, 0, eye}, {0.8 * scene.bay, 0.3, eye}};
  for (int i = 0; i < 3; ++i) {
    scene.places.emplace_back(random.Between(-1.5, 1.5) * scene.bay / 2 + 3,
                              random.Between(-0.3, 0.3) * scene.bay, eye);
  }
  return scene;
}

// Scans beside the only station, and some metres from it, where they overlap by little.
RepetitiveScene Unique(simulation::Scene of, uint64_t seed) {
  RepetitiveScene scene;
  const simulation::SimulatedScanner tracer(of.mesh);
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 74);
  scene.scanned = {of.starts[0]};
  for (int tries = 0; tries < 1000 && scene.places.size() < 6; ++tries) {
    const double reach = scene.places.size() < 2 ? 1.0 : 4.5;  // m
    const Vector3d at =
        of.starts[0] + Vector3d(random.Between(-reach, reach), random.Between(-reach, reach), 0);
    if (tracer.Clearance(at, 0.35) >= 0.35 && tracer.Visible(of.starts[0], at)) {
      scene.places.push_back(at);
    }
  }
  scene.mesh = std::move(of.mesh);
  return scene;
}

struct Tally {
  size_t scans = 0;
  size_t right = 0;
  size_t wrong = 0;  // registered more than three times its bound off
  size_t rival = 0;  // in doubt for another pose
  size_t refused = 0;
  std::string worst;
  std::string Words() const {
    return absl::StrFormat("%d of %d right, %d wrong, %d another pose, %d else%s", right, scans,
                           wrong, rival, refused, worst);
  }
};

void RegisterIn(const RepetitiveScene& scene, double sigma, uint64_t seed, Tally& tally,
                parallel::Parallel& parallel) {
  const simulation::SimulatedScanner tracer(scene.mesh);
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 73);
  const auto pose_at = [&](const Vector3d& at) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(at);
    pose.rotate(Eigen::AngleAxisd(random.Between(0, 2 * sensor::kPi), Vector3d::UnitZ()));
    return pose;
  };
  sensor::ScannerModel scanner;
  const auto scan_at = [&](const Eigen::Isometry3d& pose, uint64_t of) {
    sensor::Scan scan;
    scan.scanner = scanner;
    scan.image = tracer.Scan(scanner, pose, simulation::ScanFaults{}, of, parallel);
    return scan;
  };
  auto model = model::PartialModel::Create({}).value();
  for (size_t i = 0; i < scene.scanned.size(); ++i) {
    const Eigen::Isometry3d pose = pose_at(scene.scanned[i]);
    model->Insert(absl::StrCat(i), scan_at(pose, seed + i), pose, parallel).value();
  }
  const auto view = model->Publish();
  for (size_t i = 0; i < scene.places.size(); ++i) {
    const Eigen::Isometry3d truth = pose_at(scene.places[i]);
    const sensor::Scan scan = scan_at(truth, seed + 100 + i);
    sensor::PosePrior prior;
    const auto normal = [&](uint64_t stream) {
      return simulation::RandomNormal(seed, i, 2 * stream);
    };
    prior.T_world_scan = truth;
    prior.T_world_scan.pretranslate(
        Vector3d(sigma * normal(0), sigma * normal(1), kUpSigma * normal(2)));
    prior.T_world_scan.rotate(Eigen::AngleAxisd(kTurnSigma * normal(3), Vector3d::UnitZ()));
    const sensor::Vector6d sigmas{{kTiltSigma, kTiltSigma, kTurnSigma, sigma, sigma, kUpSigma}};
    prior.covariance = sigmas.cwiseAbs2().asDiagonal();
    const auto result = registration::Register(*view, scan, prior, {}, parallel).value();
    const double off = (result.T_world_scan.translation() - truth.translation()).norm();
    ++tally.scans;
    if (!result.verdict.registered()) {
      const bool rival = !result.verdict.bases.empty() &&
                         result.verdict.bases[0] == registration::RegistrationBasis::kRivalPose;
      ++(rival ? tally.rival : tally.refused);
    } else if (off > 3 * result.verdict.error_bound) {
      ++tally.wrong;
      absl::StrAppendFormat(&tally.worst, "; %.2f m off at E = %.1f mm", off,
                            1000 * result.verdict.error_bound);
    } else {
      ++tally.right;
    }
  }
}

}  // namespace

void BenchVerdict(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("verdict.")) return;
  const uint64_t first = SceneSeeds(options.use).front();
  const uint64_t scenes = options.full ? 20 : 4;
  for (const double sigma : kPriorSigmas) {
    Tally repetitive;
    Tally marked;
    Tally decks;
    Tally unique;
    for (uint64_t seed = first; seed < first + scenes; ++seed) {
      RegisterIn(PillarCorridor(seed, 0), sigma, seed, repetitive, parallel);
      RegisterIn(PillarCorridor(seed, 6), sigma, seed, marked, parallel);
      RegisterIn(ParkingDeck(seed), sigma, seed, decks, parallel);
      RegisterIn(Unique(simulation::FurnishedFlat(seed), seed), sigma, seed, unique, parallel);
      RegisterIn(Unique(simulation::OfficeStorey(seed, 150), seed), sigma, seed, unique, parallel);
    }
    const std::string name = absl::StrFormat("%gm", sigma);
    figures.Add({"verdict.wrong." + name,
                 static_cast<double>(repetitive.wrong + marked.wrong + decks.wrong + unique.wrong),
                 "scans", "0",
                 absl::StrCat("corridors: ", repetitive.Words(), "; with other things in them: ",
                              marked.Words(), "; parking decks: ", decks.Words())});
    figures.Add({"verdict.doubts." + name,
                 static_cast<double>(unique.rival) / static_cast<double>(unique.scans), "", "0.02",
                 absl::StrCat("flats and offices: ", unique.Words())});
  }
}

}  // namespace vantage::bench
