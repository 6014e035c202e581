#include "tests/bench/calibration_pair.h"

#include <cmath>
#include <sstream>
#include <vector>

#include "absl/strings/str_format.h"
#include "core/model/partial_model.h"
#include "core/planning/ranking/registration_check.h"
#include "core/registration/align/align.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/bound/registration_result.h"
#include "core/registration/registration.h"
#include "core/simulation/random_sequence.h"
#include "core/simulation/simulated_scanner.h"
#include "core/visibility/occlusion_scene.h"
#include "core/visibility/opaque_grid.h"
#include "tests/bench/shared_error.h"

namespace vantage::bench {
namespace {

using Eigen::Vector3d;

constexpr double kStationClearance = 0.30;  // m
constexpr double kNearestSecond = 0.5;      // m from the first scan
constexpr double kFarthestSecond = 4.5;
constexpr double kHiddenShare = 0.2;  // of second places need not be seen from the first

Eigen::Isometry3d Upright(const Vector3d& position, double heading, double tilt_sigma,
                          Normal& normal) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(position);
  pose.rotate(Eigen::AngleAxisd(heading, Vector3d::UnitZ()));
  pose.rotate(Eigen::AngleAxisd(tilt_sigma * normal(), Vector3d::UnitX()));
  pose.rotate(Eigen::AngleAxisd(tilt_sigma * normal(), Vector3d::UnitY()));
  return pose;
}

CalibrationScene Scaled(CalibrationScene scene, double scale) {
  for (Eigen::Vector3f& vertex : scene.mesh.vertices) vertex *= static_cast<float>(scale);
  scene.T_scene_local.translation() *= scale;
  scene.stations = Eigen::AlignedBox3d(scale * scene.stations.min(), scale * scene.stations.max());
  return scene;
}

class Site {
 public:
  Site(const SceneFamily& family, uint64_t seed, const CalibrationSettings& settings)
      : scene_(Scaled(family.make(seed), settings.scale)),
        tracer_(scene_.mesh),
        settings_(settings) {
    scanner_.azimuth_step = scanner_.elevation_step = settings.step;
    scanner_.range_max = settings.scale * kCalibrationRange;
    scanner_.positioning_error = settings.position_guess;
  }
  const sensor::ScannerModel& scanner() const { return scanner_; }
  const simulation::SimulatedScanner& tracer() const { return tracer_; }

  bool CanStand(const Vector3d& at) const {
    return tracer_.tracer().Trace(at.cast<float>(), Eigen::Vector3f(0, 0, -1), 0).hit &&
           tracer_.Clearance(at, kStationClearance) >= kStationClearance;
  }
  Vector3d Place(simulation::RandomSequence& random) const {
    const Eigen::AlignedBox3d& box = scene_.stations;
    Vector3d local;
    for (int k = 0; k < 3; ++k) local[k] = random.Between(box.min()[k], box.max()[k]);
    return scene_.T_scene_local * local;
  }
  sensor::Scan Measure(const Eigen::Isometry3d& pose, uint64_t seed) const {
    parallel::Serial serial;
    sensor::Scan scan;
    scan.scanner = scanner_;
    scan.image = tracer_.Scan(scanner_, pose, simulation::ScanFaults{}, seed, serial);
    AddSharedError(pose, settings_.shared_sigma, settings_.correlation_length, seed, scan.image);
    return scan;
  }

 private:
  CalibrationScene scene_;
  simulation::SimulatedScanner tracer_;
  CalibrationSettings settings_;
  sensor::ScannerModel scanner_;
};

}  // namespace

double LargestMove(const Eigen::Isometry3d& pose, const Eigen::Isometry3d& truth,
                   const Eigen::AlignedBox3d& box) {
  if (box.isEmpty()) return (pose.translation() - truth.translation()).norm();
  const Eigen::Isometry3d wrong = pose * truth.inverse();
  double largest = 0;
  for (int i = 0; i < 8; ++i) {
    const Vector3d x = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i));
    largest = std::max(largest, (wrong * x - x).norm());
  }
  return largest;
}

Eigen::AlignedBox3d OverlapBox(const model::PlanningView& model, const sensor::Scan& scan,
                               const Eigen::Isometry3d& truth, parallel::Parallel& parallel) {
  const registration::RegistrationConfig config;
  const registration::ScanSurface surface =
      registration::SampleSurface(scan, config.sample_spacing, parallel);
  Eigen::AlignedBox3d box;
  for (const registration::Correspondence& c : registration::FindCorrespondences(
           registration::VoxelSearch(model, registration::BoxOf(surface, truth)), surface, truth,
           config, parallel)) {
    box.extend(c.point);
  }
  return box;
}

std::vector<CalibrationPair> MeasureScene(const SceneFamily& family, int scene, uint64_t seed,
                                          int count, const CalibrationSettings& settings,
                                          const registration::RegistrationConfig& configured) {
  parallel::Serial serial;
  registration::RegistrationConfig config = configured;
  const Site site(family, seed, settings);
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 41);
  Normal normal(simulation::MixBits(seed) ^ 43);
  std::vector<CalibrationPair> pairs;
  Vector3d first = site.Place(random);
  for (int tries = 0; !site.CanStand(first); ++tries) {
    if (tries > 10'000) return pairs;
    first = site.Place(random);
  }
  const Eigen::Isometry3d T_world_first =
      Upright(first, random.Between(0, 2 * sensor::kPi), settings.tilt_guess, normal);
  auto model = model::PartialModel::Create({});
  const sensor::Scan made = site.Measure(T_world_first, seed);
  if (!model.ok() || !(*model)->Insert("first", made, T_world_first, serial).ok()) return pairs;
  const auto view = (*model)->Publish();
  const visibility::OpaqueGrid grid(*view);
  const auto occlusion = visibility::OcclusionScene::Create(grid, serial).value();
  const auto surface =
      planning::OverlapSurface::Create(*view, grid, occlusion, site.scanner(), serial).value();

  for (int tries = 0; static_cast<int>(pairs.size()) < count && tries < 20'000; ++tries) {
    const Vector3d at = site.Place(random);
    const double away = (at - first).norm();
    const bool may_hide = random.Chance(kHiddenShare);
    if (away < kNearestSecond || away > settings.scale * kFarthestSecond || !site.CanStand(at)) {
      continue;
    }
    if (!may_hide && !site.tracer().Visible(first, at)) continue;
    CalibrationPair pair;
    pair.family = family.name;
    pair.degenerate = family.degenerate;
    pair.scene = scene;
    pair.pair = static_cast<int>(pairs.size());
    const double heading = random.Between(0, 2 * sensor::kPi);
    const double off = settings.prior_lie;
    const Eigen::Isometry3d truth = Upright(at, heading, off * settings.tilt_guess, normal);
    // The planned place with a positioning error, and the heading with a compass's error; upright.
    sensor::PosePrior prior;
    const Vector3d planned = at + off * settings.position_guess * normal.Three();
    // Only places known to be empty are planned.
    if (!view->Empty(view->At(planned))) continue;
    const double guessed_heading = heading + off * settings.heading_guess * normal();
    prior.T_world_scan = Upright(planned, guessed_heading, 0, normal);
    const sensor::Vector6d sigma{{settings.tilt_guess, settings.tilt_guess, settings.heading_guess,
                                  settings.position_guess, settings.position_guess,
                                  settings.position_guess}};
    prior.covariance = sigma.cwiseAbs2().asDiagonal();
    const Eigen::Isometry3d missed = truth.inverse() * prior.T_world_scan;
    pair.prior_metres = missed.translation().norm();
    pair.prior_degrees = sensor::Degrees(Eigen::AngleAxisd(missed.linear()).angle());

    const auto predicted = surface.Predict(prior.T_world_scan.translation(), occlusion, config,
                                           parallel::Budget::Unlimited());
    const sensor::Scan scan = site.Measure(truth, seed * 1000 + static_cast<uint64_t>(tries));
    const auto aligned = registration::Register(*view, scan, prior, config, serial);
    if (!predicted.has_value() || !aligned.ok()) continue;
    pair.predicted = predicted->verdict.outcome;
    pair.predicted_bound = predicted->verdict.error_bound;
    pair.predicted_judged = predicted->verdict.judged_bound;
    pair.predicted_overlap = predicted->verdict.overlap_share;
    RecordAlignment(*aligned, truth, OverlapBox(*view, scan, truth, serial), pair);
    if (settings.learn && aligned->residuals.has_value()) {
      config.instrument.Add(*aligned->residuals);
    }
    pairs.push_back(std::move(pair));
  }
  return pairs;
}

void RecordAlignment(const registration::RegistrationResult& aligned,
                     const Eigen::Isometry3d& truth, const Eigen::AlignedBox3d& overlap,
                     CalibrationPair& pair) {
  pair.outcome = aligned.verdict.outcome;
  pair.bound = aligned.verdict.error_bound;
  pair.judged = aligned.verdict.judged_bound;
  pair.overlap = aligned.verdict.overlap_share;
  pair.achieved = LargestMove(aligned.T_world_scan, truth, overlap);
  const Eigen::Isometry3d error = truth.inverse() * aligned.T_world_scan;
  pair.metres = error.translation().norm();
  pair.degrees = sensor::Degrees(Eigen::AngleAxisd(error.linear()).angle());
  pair.seconds = aligned.seconds;
  pair.attainable = aligned.verdict.attainable_accuracy.value_or(0);
  pair.decided_by = registration::BasesText(aligned.verdict.bases);
}

std::string CalibrationHeader() {
  return "family,degenerate,scene,pair,prior_m,prior_deg,predicted,predicted_bound_m,"
         "predicted_judged_m,predicted_overlap,outcome,bound_m,judged_m,"
         "overlap,achieved_m,scanner_m,scanner_deg,seconds,decided_by,attainable_m";
}

std::string ToLine(const CalibrationPair& p) {
  return absl::StrFormat(
      "%s,%d,%d,%d,%.4f,%.3f,%d,%.6f,%.6f,%.4f,%d,%.6f,%.6f,%.4f,%.6f,"
      "%.6f,%.4f,%.3f,%s,%.6f",
      p.family, p.degenerate ? 1 : 0, p.scene, p.pair, p.prior_metres, p.prior_degrees,
      static_cast<int>(p.predicted), p.predicted_bound, p.predicted_judged, p.predicted_overlap,
      static_cast<int>(p.outcome), p.bound, p.judged, p.overlap, p.achieved, p.metres, p.degrees,
      p.seconds, p.decided_by, p.attainable);
}

std::optional<CalibrationPair> FromLine(const std::string& line) {
  std::istringstream in(line);
  CalibrationPair p;
  std::vector<std::string> fields;
  for (std::string field; std::getline(in, field, ',');) fields.push_back(field);
  constexpr size_t kFields = 20;
  if (fields.size() != kFields || fields[0] == "family") return std::nullopt;
  size_t at = 0;
  const auto number = [&] { return std::strtod(fields[at++].c_str(), nullptr); };
  const auto whole = [&] { return static_cast<int>(number()); };
  p.family = fields[at++];
  p.degenerate = whole() != 0;
  p.scene = whole();
  p.pair = whole();
  p.prior_metres = number();
  p.prior_degrees = number();
  p.predicted = static_cast<registration::RegistrationOutcome>(whole());
  p.predicted_bound = number();
  p.predicted_judged = number();
  p.predicted_overlap = number();
  p.outcome = static_cast<registration::RegistrationOutcome>(whole());
  p.bound = number();
  p.judged = number();
  p.overlap = number();
  p.achieved = number();
  p.metres = number();
  p.degrees = number();
  p.seconds = number();
  p.decided_by = fields[at++];
  p.attainable = number();
  return p;
}

}  // namespace vantage::bench
