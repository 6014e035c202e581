// Chains of scans that close: links between all that overlap, adjusted together, beside the noise
// that is known. Graphs that are drawn, and scans that are simulated and registered one after the
// other.
#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/model/partial_model.h"
#include "core/registration/graph/adjust.h"
#include "core/registration/graph/consistency.h"
#include "core/registration/graph/link.h"
#include "core/registration/registration.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/loop_scenes.h"
#include "tests/bench/scenes.h"
#include "tests/bench/shared_error.h"
#include "tests/support/graph_scenes.h"

namespace vantage::bench {
namespace {

using Eigen::Vector3d;
using registration::Adjustment;
using registration::PoseGraph;
using sensor::Matrix6d;
using sensor::Vector6d;

constexpr double kChiSquare3At95 = 7.815;
constexpr double kChiSquare6At95 = 12.592;
// Of an odometer, from one scan to the next, one sigma.
constexpr double kOdometerMetres = 0.08;
constexpr double kOdometerTurn = sensor::Radians(1.5);
constexpr double kOdometerTilt = sensor::Radians(0.5);
// m, by how much what both see may be off: of neighbours in the chain, and of others before it
// closes.
constexpr double kReachNear = 0.15;
constexpr double kReachFar = 0.4;
constexpr size_t kNeighbours = 3;
// m: a person who looks at a scan in doubt sees that it is right when it is off by less.
constexpr double kSeenRight = 0.1;
// Range noise that neighbours share, m: as registration is configured to expect.
constexpr double kSharedSigma = 0.002;
constexpr double kStep = sensor::Radians(0.35);

double Mahalanobis(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd unit = scale.asDiagonal() * covariance * scale.asDiagonal();
  const Eigen::VectorXd scaled = scale.cwiseProduct(error);
  return scaled.dot(unit.ldlt().solve(scaled));
}

// Errors of adjusted poses beside their covariances.
struct PoseTally {
  double error = 0;      // m^2, of positions
  double posterior = 0;  // m^2
  double chi2 = 0;       // of six
  size_t scans = 0;
  size_t within = 0;       // of positions' 95 % ellipsoids
  size_t within_pose = 0;  // of poses'
  double worst = 0;        // m

  void Add(const std::vector<Eigen::Isometry3d>& truth, const Adjustment& adjustment) {
    for (size_t i = 0; i < truth.size(); ++i) {
      const registration::AdjustedScan& scan = adjustment.scans[i];
      if (scan.held) continue;
      const Vector6d off = test_support::PoseError(truth[i], scan.T_world_scan);
      const double six = Mahalanobis(off, scan.covariance);
      const double three = Mahalanobis(off.tail<3>(), scan.covariance.bottomRightCorner<3, 3>());
      error += off.tail<3>().squaredNorm();
      posterior += scan.covariance.bottomRightCorner<3, 3>().trace();
      chi2 += six;
      within += three <= kChiSquare3At95 ? 1 : 0;
      within_pose += six <= kChiSquare6At95 ? 1 : 0;
      worst = std::max(worst, off.tail<3>().norm());
      ++scans;
    }
  }
  double Ratio() const { return std::sqrt(error / posterior); }
  double Share() const { return static_cast<double>(within) / static_cast<double>(scans); }
  std::string Words() const {
    const auto count = static_cast<double>(scans);
    return absl::StrFormat(
        "%d poses, %.2f mm rms, %.2f mm at worst, chi2 / 6 %.2f, %.3f of positions and %.3f of "
        "poses within 95 %%",
        scans, 1000 * std::sqrt(error / count), 1000 * worst, chi2 / count / 6, Share(),
        static_cast<double>(within_pose) / count);
  }
};

// Graphs whose noise is as their links say.
void DrawnGraphs(size_t draws, Figures& figures) {
  struct Kind {
    const char* name;
    test_support::GraphScene scene;
  };
  const std::array<Kind, 3> kinds = {
      Kind{"ring", test_support::RingCorridorGraph(100, 4, 1)},
      Kind{"storeys", test_support::ThreeStoreysGraph(32, 2)},
      Kind{"street", test_support::StreetGraph(60, 3)},
  };
  PoseTally all;
  std::string words;
  for (const Kind& kind : kinds) {
    PoseTally tally;
    for (size_t draw = 0; draw < draws; ++draw) {
      const PoseGraph graph = test_support::NoisyGraph(kind.scene, {}, 7000 + draw);
      const Adjustment adjustment = registration::Adjust(graph).value();
      tally.Add(kind.scene.truth, adjustment);
      all.Add(kind.scene.truth, adjustment);
    }
    absl::StrAppendFormat(&words, "%s%s: %s", words.empty() ? "" : "; ", kind.name, tally.Words());
  }
  figures.Add({"loop.rms.drawn", all.Ratio(), "", "1.2", words});
  figures.Add({"loop.bounds95.drawn", all.Share(), "", "0.93 to 0.997", ""});
}

void TimeOfAdjustment(Figures& figures) {
  const test_support::GraphScene scene = test_support::RingCorridorGraph(100, 4, 1);
  const PoseGraph graph = test_support::NoisyGraph(scene, {}, 1);
  const double seconds = MedianSeconds(5, [&] { registration::Adjust(graph).value(); });
  figures.Add({"loop.seconds", seconds, "s", "1",
               absl::StrFormat("%d scans, %d links, to adjusted poses with covariances; one thread",
                               graph.nodes().size(), graph.links().size())});
}

// A chain of scans in a site, registered one after the other.
struct SimulatedChain {
  std::vector<Eigen::Isometry3d> truth;
  std::vector<Eigen::Isometry3d> registered;
  std::vector<registration::LinkSurface> surfaces;
  size_t doubts = 0;       // scans that were not registered by themselves
  size_t by_odometer = 0;  // of these, those that a person put where the odometer says
};

SimulatedChain RunChain(const LoopScene& scene, uint64_t seed, parallel::Parallel& parallel) {
  const simulation::SimulatedScanner tracer(scene.mesh);
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = kStep;
  const registration::RegistrationConfig config;
  const auto model = model::PartialModel::Create({}).value();
  SimulatedChain chain;
  Normal normal(simulation::MixBits(seed) ^ 85);
  for (size_t i = 0; i < scene.stations.size(); ++i) {
    const Eigen::Isometry3d truth =
        test_support::RandomUpright(scene.stations[i], simulation::RandomBits(seed, i, 3));
    sensor::Scan scan;
    scan.scanner = scanner;
    scan.image = tracer.Scan(scanner, truth, simulation::ScanFaults{}, seed + i, parallel);
    AddSharedError(truth, kSharedSigma, config.correlation_length,
                   simulation::RandomBits(seed, i, 4), scan.image);
    Eigen::Isometry3d pose = truth;
    if (i > 0) {
      sensor::PosePrior prior;
      prior.T_world_scan =
          chain.registered.back() * (chain.truth.back().inverse(Eigen::Isometry) * truth);
      prior.T_world_scan.pretranslate(Vector3d(kOdometerMetres * normal.Three()));
      prior.T_world_scan.rotate(Eigen::AngleAxisd(kOdometerTurn * normal(), Vector3d::UnitZ()));
      Vector6d sigmas;
      sigmas << kOdometerTilt, kOdometerTilt, kOdometerTurn, kOdometerMetres, kOdometerMetres,
          kOdometerMetres;
      prior.covariance = sigmas.cwiseAbs2().asDiagonal();
      const registration::RegistrationResult result =
          registration::Register(*model->Publish(), scan, prior, config, parallel).value();
      pose = result.T_world_scan;
      if (!result.verdict.registered()) {
        ++chain.doubts;
        // Against where the chain has its last scan: drift is not what a person sees.
        const Eigen::Isometry3d expected =
            chain.registered.back() * (chain.truth.back().inverse(Eigen::Isometry) * truth);
        if ((pose.translation() - expected.translation()).norm() > kSeenRight) {
          pose = prior.T_world_scan;
          ++chain.by_odometer;
        }
      }
    }
    model->Insert(test_support::ScanName(i), scan, pose, parallel).value();
    chain.truth.push_back(truth);
    chain.registered.push_back(pose);
    chain.surfaces.push_back(registration::MakeLinkSurface(scan, config, parallel));
  }
  return chain;
}

// Links of all pairs that may overlap, beside the truth.
struct LinkTally {
  size_t pairs = 0;
  size_t links = 0;
  size_t doubtful = 0;
  size_t within = 0;  // 95 % of six
  double chi2 = 0;
  double seconds = 0;
  double worst = 0;  // m

  std::string Words() const {
    const auto count = static_cast<double>(std::max<size_t>(1, links));
    return absl::StrFormat(
        "%d links of %d pairs (%d in doubt), %.1f ms a pair, chi2 / 6 %.2f, %.3f within 95 %%, "
        "%.1f mm off at worst",
        links, pairs, doubtful, 1000 * seconds / static_cast<double>(std::max<size_t>(1, pairs)),
        chi2 / count / 6, static_cast<double>(within) / count, 1000 * worst);
  }
};

PoseGraph GraphOf(const SimulatedChain& chain, LinkTally& tally) {
  std::vector<registration::ScanNode> nodes;
  std::vector<std::string> names;
  for (size_t i = 0; i < chain.truth.size(); ++i) {
    registration::ScanNode node;
    node.id = test_support::ScanName(i);
    names.push_back(node.id);
    node.T_world_scan = chain.registered[i];
    node.fixed = i == 0;
    nodes.push_back(std::move(node));
  }
  std::vector<registration::ScanLink> links;
  for (size_t i = 0; i < nodes.size(); ++i) {
    for (size_t j = i + 1; j < nodes.size(); ++j) {
      const registration::PlacedSurface a{names[i], chain.surfaces[i], chain.registered[i]};
      const registration::PlacedSurface b{names[j], chain.surfaces[j], chain.registered[j]};
      registration::LinkOutcome outcome;
      bool overlap = false;
      tally.seconds += ThreadSeconds([&] {
        overlap = registration::MayOverlap(a, b);
        if (!overlap) return;
        registration::LinkOptions options;
        options.reach = j - i <= kNeighbours ? kReachNear : kReachFar;
        outcome = registration::LinkScans(a, b, {}, options);
      });
      if (!overlap) continue;
      ++tally.pairs;
      if (!outcome.link.has_value()) continue;
      ++tally.links;
      tally.doubtful += outcome.link->in_doubt ? 1 : 0;
      const Vector6d off = test_support::PoseError(
          chain.truth[i].inverse(Eigen::Isometry) * chain.truth[j], outcome.link->T_a_b);
      const double chi2 = off.dot(outcome.link->information * off);
      tally.chi2 += chi2;
      tally.within += chi2 <= kChiSquare6At95 ? 1 : 0;
      tally.worst = std::max(tally.worst, off.tail<3>().norm());
      links.push_back(*outcome.link);
    }
  }
  return PoseGraph::Create(std::move(nodes), std::move(links)).value();
}

double RmsOff(const SimulatedChain& chain) {
  double sum = 0;
  for (size_t i = 1; i < chain.truth.size(); ++i) {
    sum += (chain.registered[i].translation() - chain.truth[i].translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(chain.truth.size() - 1));
}

void SimulatedSites(const char* name, LoopScene (*make)(uint64_t), uint64_t first, uint64_t sites,
                    Figures& figures, parallel::Parallel& parallel) {
  PoseTally poses;
  LinkTally links;
  std::string words;
  for (uint64_t seed = first; seed < first + sites; ++seed) {
    const SimulatedChain chain = RunChain(make(seed), seed, parallel);
    const PoseGraph graph = GraphOf(chain, links);
    const registration::LinkDecisions decisions = registration::DecideLinks(graph).value();
    const PoseGraph decided = graph.WithLinks(decisions.keep);
    const Adjustment adjustment = registration::Adjust(decided).value();
    poses.Add(chain.truth, adjustment);
    const auto parts =
        static_cast<size_t>(std::count_if(adjustment.scans.begin(), adjustment.scans.end(),
                                          [](const auto& scan) { return scan.held; }));
    absl::StrAppendFormat(&words,
                          "; site %d: %d scans, %d in doubt (%d put by odometer), one by one "
                          "%.1f mm rms off, %d pieces, chi2 / freedom %.2f",
                          seed, chain.truth.size(), chain.doubts, chain.by_odometer,
                          1000 * RmsOff(chain), parts,
                          adjustment.chi2 / std::max(1, adjustment.degrees_of_freedom));
  }
  figures.Add({absl::StrCat("loop.rms.", name), poses.Ratio(), "", "1.2",
               absl::StrCat(poses.Words(), "; ", links.Words(), words)});
  figures.Add({absl::StrCat("loop.bounds95.", name), poses.Share(), "", "0.93 to 0.997", ""});
}

}  // namespace

void BenchLoop(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (figures.Wants("loop.seconds")) TimeOfAdjustment(figures);
  if (figures.Wants("loop.rms.drawn") || figures.Wants("loop.bounds95.drawn")) {
    DrawnGraphs(options.full ? 400 : 100, figures);
  }
  const uint64_t first = SceneSeeds(options.use).front();
  const uint64_t sites = options.full ? 5 : 1;
  const auto run = [&](const char* name, LoopScene (*make)(uint64_t)) {
    if (!figures.Wants(absl::StrCat("loop.rms.", name)) &&
        !figures.Wants(absl::StrCat("loop.bounds95.", name))) {
      return;
    }
    SimulatedSites(name, make, first, sites, figures, parallel);
  };
  run("ring", RingCorridor);
  run("storeys", StoreysByStairs);
  run("street", StreetAroundBlock);
}

}  // namespace vantage::bench
