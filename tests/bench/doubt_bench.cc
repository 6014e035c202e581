// Scans in doubt in scenes that repeat themselves, tried again as the model grows around them.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/model/partial_model.h"
#include "core/registration/graph/link.h"
#include "core/registration/graph/settled_doubt.h"
#include "core/registration/registration.h"
#include "core/simulation/random_sequence.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/repetitive_scenes.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {
namespace {

using registration::PairAtPose;

// m, one sigma, that priors state and have: what a tap on a plan of such a place is good for.
constexpr double kDoubtPrior = 1.0;
constexpr double kDoubtTurn = sensor::Radians(5);
constexpr size_t kMostInDoubt = 4;  // of a scene
constexpr size_t kMostThatCome = 8;

struct DoubtTally {
  size_t made = 0;      // scans
  size_t in_doubt = 0;  // by the first model
  size_t settled = 0;   // by what came later
  size_t wrong = 0;     // of these, more than three times the bound off
  size_t kept = 0;      // registered by the model as it grew, and not proposed
};

struct InDoubt {
  Eigen::Isometry3d truth;
  sensor::Scan scan;
  registration::RegistrationResult result;
  std::unique_ptr<registration::LinkSurface> surface;
};

struct Placed {
  std::string name;
  Eigen::Isometry3d pose;
  std::unique_ptr<registration::LinkSurface> surface;
  bool came_since;
};

class GrowingJob {
 public:
  GrowingJob(const RepetitiveScene& scene, uint64_t seed, parallel::Parallel& parallel)
      : tracer_(scene.mesh),
        seed_(seed),
        parallel_(parallel),
        random_(simulation::MixBits(seed) ^ 111),
        model_(model::PartialModel::Create({}).value()) {
    for (const Eigen::Vector3d& place : scene.scanned) Merge(place, false);
  }

  void Run(const std::vector<Eigen::Vector3d>& places, DoubtTally& tally) {
    std::vector<Eigen::Vector3d> later;
    for (const Eigen::Vector3d& place : places) {
      if (doubts_.size() < kMostInDoubt) {
        ++tally.made;
        if (Try(place)) continue;
      }
      later.push_back(place);
    }
    tally.in_doubt += doubts_.size();
    if (later.size() > kMostThatCome) later.resize(kMostThatCome);
    for (const Eigen::Vector3d& place : later) Merge(place, true);
    for (const InDoubt& doubt : doubts_) {
      const registration::RegistrationResult anew =
          registration::Register(*model_->Publish(), doubt.scan, *doubt.scan.prior, {}, parallel_)
              .value();
      const std::optional<registration::SettledDoubt> settled = Settle(doubt, anew);
      if (!settled.has_value()) {
        tally.kept += anew.verdict.registered() ? 1 : 0;
        continue;
      }
      ++tally.settled;
      const double off = (anew.T_world_scan.translation() - doubt.truth.translation()).norm();
      if (off > 3 * anew.verdict.error_bound) ++tally.wrong;
    }
  }

 private:
  Eigen::Isometry3d PoseAt(const Eigen::Vector3d& place) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(place);
    pose.rotate(Eigen::AngleAxisd(random_.Between(0, 2 * sensor::kPi), Eigen::Vector3d::UnitZ()));
    return pose;
  }
  sensor::Scan ScanAt(const Eigen::Isometry3d& pose) {
    sensor::Scan scan;
    scan.image = tracer_.Scan(scan.scanner, pose, simulation::ScanFaults{}, seed_ + 1000 + made_++,
                              parallel_);
    return scan;
  }
  std::unique_ptr<registration::LinkSurface> SurfaceOf(const sensor::Scan& scan) {
    return std::make_unique<registration::LinkSurface>(
        registration::MakeLinkSurface(scan, {}, parallel_));
  }
  void Merge(const Eigen::Vector3d& place, bool came_since) {
    const Eigen::Isometry3d pose = PoseAt(place);
    const sensor::Scan scan = ScanAt(pose);
    const std::string name = absl::StrFormat("scan-%02d", in_model_.size());
    model_->Insert(name, scan, pose, parallel_).value();
    in_model_.push_back({name, pose, SurfaceOf(scan), came_since});
  }
  // Whether it is in doubt.
  bool Try(const Eigen::Vector3d& place) {
    InDoubt made;
    made.truth = PoseAt(place);
    made.scan = ScanAt(made.truth);
    const auto normal = [&](uint64_t stream) {
      return simulation::RandomNormal(seed_, made_, 2 * stream);
    };
    sensor::PosePrior prior;
    prior.T_world_scan = made.truth;
    prior.T_world_scan.pretranslate(
        Eigen::Vector3d(kDoubtPrior * normal(0), kDoubtPrior * normal(1), 0.05 * normal(2)));
    prior.T_world_scan.rotate(Eigen::AngleAxisd(kDoubtTurn * normal(3), Eigen::Vector3d::UnitZ()));
    const sensor::Vector6d sigmas{
        {sensor::Radians(1), sensor::Radians(1), kDoubtTurn, kDoubtPrior, kDoubtPrior, 0.05}};
    prior.covariance = sigmas.cwiseAbs2().asDiagonal();
    made.scan.prior = prior;
    made.result =
        registration::Register(*model_->Publish(), made.scan, prior, {}, parallel_).value();
    if (made.result.verdict.registered() || made.result.rival_poses.empty()) return false;
    made.surface = SurfaceOf(made.scan);
    doubts_.push_back(std::move(made));
    return true;
  }
  std::vector<PairAtPose> PairsAt(const InDoubt& doubt, const Eigen::Isometry3d& pose) const {
    std::vector<PairAtPose> pairs;
    for (const Placed& other : in_model_) {
      PairAtPose& pair = pairs.emplace_back();
      pair.scan = other.name;
      pair.came_since = other.came_since;
      const registration::PlacedSurface a{"doubt", *doubt.surface, pose};
      const registration::PlacedSurface b{other.name, *other.surface, other.pose};
      if (registration::MayOverlap(a, b)) pair.outcome = registration::LinkScans(a, b, {}, {});
    }
    return pairs;
  }
  std::optional<registration::SettledDoubt> Settle(
      const InDoubt& doubt, const registration::RegistrationResult& anew) const {
    if (!anew.verdict.registered()) return std::nullopt;
    std::vector<registration::DoubtfulPose> poses;
    const Eigen::Isometry3d& first = doubt.result.T_world_scan;
    poses.push_back({first, PairsAt(doubt, first)});
    for (const registration::RivalPose& rival : doubt.result.rival_poses) {
      poses.push_back({rival.T_world_scan, PairsAt(doubt, rival.T_world_scan)});
    }
    return registration::SettleDoubt(anew, PairsAt(doubt, anew.T_world_scan), poses);
  }

  simulation::SimulatedScanner tracer_;
  uint64_t seed_;
  parallel::Parallel& parallel_;
  simulation::RandomSequence random_;
  std::unique_ptr<model::PartialModel> model_;
  std::vector<Placed> in_model_;
  std::vector<InDoubt> doubts_;
  uint64_t made_ = 0;
};

}  // namespace

void BenchDoubt(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("doubt.")) return;
  const uint64_t first = SceneSeeds(options.use).front();
  const uint64_t scenes = options.full ? 8 : 2;
  using Make = RepetitiveScene (*)(uint64_t);
  constexpr std::array<std::pair<const char*, Make>, 4> kKinds = {{
      {"doors", DoorCorridor},
      {"pillars", [](uint64_t s) { return PillarCorridor(s, 0); }},
      {"marked", [](uint64_t s) { return PillarCorridor(s, 6); }},
      {"decks", ParkingDeck},
  }};
  size_t wrong = 0;
  size_t settled = 0;
  size_t in_doubt = 0;
  std::string words;
  for (const auto& [name, make] : kKinds) {
    DoubtTally tally;
    for (uint64_t seed = first; seed < first + scenes; ++seed) {
      const RepetitiveScene scene = make(seed);
      GrowingJob(scene, seed, parallel).Run(scene.places, tally);
    }
    wrong += tally.wrong;
    settled += tally.settled;
    in_doubt += tally.in_doubt;
    absl::StrAppendFormat(&words,
                          "%s%s: of %d scans %d in doubt between places, of which %d settled, %d "
                          "wrong, %d registered anew and kept in doubt by links",
                          words.empty() ? "" : "; ", name, tally.made, tally.in_doubt,
                          tally.settled, tally.wrong, tally.kept);
  }
  figures.Add({"doubt.wrong", static_cast<double>(wrong), "", "0", words});
  figures.Add(
      {"doubt.settled",
       static_cast<double>(settled) / static_cast<double>(std::max<size_t>(1, in_doubt)), "", "",
       "of scans in doubt, those whose pose is proposed once their surroundings are scanned"});
}

}  // namespace vantage::bench
