#include "core/registration/bound/rival_forecast.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/align.h"
#include "core/registration/align/align_stages.h"
#include "core/registration/align/correspondence_field.h"
#include "core/registration/align/prior_search.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/align/space_agreement.h"
#include "core/registration/align/targets.h"
#include "core/registration/bound/rivals.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {
namespace {

// A prior that leads to a twin is off, too: one in fifteen by more than so many sigma towards it.
// People are half a metre off (PriorReach). And where the search ends, an alignment's first stage
// goes on by as far as it finds correspondences, or as a prior lets it that is better than that.
constexpr double kSigmasOff = 1.5;
constexpr double kGuessOff = 0.5;  // m
// And wrong about the height of a tripod by this: a third of the reach that a guess has upward.
constexpr double kGuessOffUpward = 0.05;  // m
// Headings are guessed to 15 degrees at three sigma (PriorReach).
constexpr double kGuessedTurn = sensor::Radians(5);  // rad
// Of a pose: for its refinement, and for what speaks for and against it (1 %, one sigma).
constexpr size_t kRefineSamples = 400;
constexpr size_t kCompareSamples = 2000;
constexpr int kRefineSteps = 8;
// A near one may be on its way to where the scan is, as an alignment's first stage would lead it,
// and a turned one begins a degree off: they are followed towards their ends.
constexpr int kLongSteps = 30;
constexpr double kFieldCells = 1e5;   // of 20 cm around a room: that stage reaches half a metre
constexpr double kCellAllOver = 0.2;  // m, of a field for all of a model

// What a scan would show of it, in a scanner's frame that has the world's directions.
ScanSurface SurfaceOf(std::span<const OverlapElement> overlap, const Eigen::Vector3d& position,
                      const sensor::ScannerModel& scanner) {
  const double usable = std::cos(scanner.max_incidence);
  ScanSurface surface;
  for (const OverlapElement& e : overlap) {
    if (e.samples < 1) continue;
    const Eigen::Vector3d ray = e.position.cast<double>() - position;
    const double range = ray.norm();
    const double cos_incidence = -e.normal.cast<double>().dot(ray) / range;
    if (!(cos_incidence > usable)) continue;
    SurfaceSample sample;
    sample.point = ray.cast<float>();
    sample.normal = e.normal;
    sample.sigma = static_cast<float>(scanner.RangeSigma(range) * cos_incidence);
    sample.cells = e.samples;
    surface.samples.push_back(sample);
  }
  surface.scanner = scanner;
  SpreadSamples(surface.samples);
  return surface;
}

// rad, about any axis; a forecast's scan has the world's axes.
double TurnOf(const RivalPose& rival) {
  return Eigen::AngleAxisd(rival.T_world_scan.linear()).angle();
}

// The samples by which poses are compared.
std::span<const SurfaceSample> Compared(const ScanSurface& surface) {
  return {surface.samples.data(), std::min(kCompareSamples, surface.samples.size())};
}

// One sigma of the headings of priors, rad.
double HeadingSigma(const RegistrationConfig& config) {
  return config.prior_heading_sigma > 0 ? config.prior_heading_sigma : kGuessedTurn;
}

// How far a rival may be from where the scan is.
MoveReach ReachOfPriors(const RegistrationConfig& config) {
  sensor::PosePrior prior;
  const double heading = HeadingSigma(config);
  const double sigma = config.prior_sigma;
  if (sigma > 0) {
    sensor::Matrix6d covariance = sensor::Matrix6d::Zero();
    covariance(2, 2) = heading * heading;
    covariance.diagonal().tail<3>().setConstant(sigma * sigma);
    prior.covariance = covariance;
  }
  const PriorReach reach = ReachOf(prior);
  const auto beyond = [&](double off) { return off + std::min(off, config.max_correspondence); };
  const double off = kSigmasOff * sigma;
  return {reach.shift + beyond(sigma > 0 ? off : kGuessOff),
          reach.rise + beyond(sigma > 0 ? off : kGuessOffUpward),
          std::min((kSigmasOfPrior + kSigmasOff) * heading, sensor::kPi)};
}

Eigen::AlignedBox3d TrueSurfaceBox(const model::PlanningView& model) {
  Eigen::AlignedBox3d box;
  for (const model::BrickAt& at : model.surface_bricks()) {
    if (at.contents->surface.empty()) continue;
    const double side = model::Brick::kSide * model.voxel_size();
    box.extend(Eigen::Vector3d(at.brick.cast<double>() * side));
    box.extend(Eigen::Vector3d((at.brick.cast<double>().array() + 1) * side));
  }
  return box;
}

double CellsAllOver(const model::PlanningView& model) {
  const Eigen::Vector3d size =
      (model.bounds().max - model.bounds().min).cast<double>() * model.voxel_size() / kCellAllOver;
  return std::clamp(size.prod(), 1.0, CorrespondenceField::kCellsAroundScan);
}

}  // namespace

FieldAllOver::FieldAllOver(const model::PlanningView& model, const RegistrationConfig& config,
                           parallel::Parallel& parallel)
    : reach(config.max_correspondence),
      field(model,
            Eigen::AlignedBox3d(model.bounds().min.cast<double>() * model.voxel_size(),
                                model.bounds().max.cast<double>() * model.voxel_size()),
            reach, parallel, CellsAllOver(model)) {}

bool FieldAllOver::Serves(const model::PlanningView& model, const RegistrationConfig& config) {
  const Eigen::Vector3d size =
      (model.bounds().max - model.bounds().min).cast<double>() * model.voxel_size();
  return std::cbrt(size.prod() / CellsAllOver(model)) <= config.max_correspondence / 2;
}

uint64_t FieldAllOver::EstimatedBytes() {
  // In six directions, and elements for at most one of them: walls are fewer than that.
  constexpr uint64_t kBytesOfCell = 24 + sizeof(SurfaceElement);
  return static_cast<uint64_t>(CorrespondenceField::kCellsAroundScan) * kBytesOfCell;
}

RivalForecast::RivalForecast(const model::PlanningView& model)
    : model_(model),
      search_(model, TrueSurfaceBox(model)),
      coarse_(std::make_shared<const CoarseSurface>(
          model, MoveSearch::kShiftStep * model.voxel_size(), kWidestReach * model.voxel_size())) {}

double RivalForecast::EstimatedBytes(const model::PlanningView& model) {
  const double h = model.voxel_size();
  // Empty space may go much farther.
  const Eigen::AlignedBox3d box = TrueSurfaceBox(model);
  if (box.isEmpty()) return 0;
  return CoarseSurface::Bytes(box.sizes(), MoveSearch::kShiftStep * h, kWidestReach * h);
}

std::vector<Minimum> RivalForecast::Refined(const ScanSurface& surface,
                                            const Eigen::Vector3d& position,
                                            std::span<const ScanMove> moves, const MoveReach& reach,
                                            double least, const RegistrationConfig& config) const {
  parallel::Serial serial;
  const std::span<const SurfaceSample> samples = Compared(surface);
  const Eigen::Isometry3d here = Moved(position, {});
  std::optional<CorrespondenceField> around;
  const CorrespondenceField* field = nullptr;
  if (all_over_ != nullptr && all_over_->reach == config.max_correspondence) {
    field = &all_over_->field;
  }
  std::vector<Minimum> minima;
  for (const ScanMove& move : moves) {
    sensor::PosePrior free;
    free.T_world_scan = Moved(position, move);
    const PriorTerm term(free, {});
    const bool near = move.turn == 0 && move.by.norm() < kNearMove;
    if (near) {
      if (field == nullptr) {
        Eigen::AlignedBox3d box = BoxOf(surface, here);
        const Eigen::Vector3d margin =
            Eigen::Vector3d::Constant(kNearMove + config.max_correspondence);
        field = &around.emplace(model_, Eigen::AlignedBox3d(box.min() - margin, box.max() + margin),
                                config.max_correspondence, serial, kFieldCells);
      }
      free.T_world_scan =
          AlignCoarse(*field, samples.first(std::min(kRefineSamples, samples.size())),
                      free.T_world_scan, term, config.max_correspondence, model_.voxel_size());
    }
    Minimum there;
    there.T_world_scan =
        AlignFine(search_, surface, kRefineSamples, free.T_world_scan, term, config, serial,
                  near || move.turn != 0 ? kLongSteps : kRefineSteps,
                  WideScale(model_.voxel_size()))
            .pose;
    const auto same = [&](const Eigen::Isometry3d& other) {
      return SurfaceDistance(there.T_world_scan, other, samples) < kApart;
    };
    const Eigen::Vector3d moved = there.T_world_scan.translation() - position;
    const bool away = moved.head<2>().norm() > reach.shift ||
                      std::abs(moved.z()) > reach.rise + config.max_correspondence;
    const bool known = std::any_of(minima.begin(), minima.end(),
                                   [&](const Minimum& m) { return same(m.T_world_scan); });
    if (known || away || same(here)) continue;
    there.score = ScorePose(search_, samples, there.T_world_scan);
    if (there.score < least) continue;
    const SpaceAgreement space =
        AgreementOf(samples, CompareSamples(model_, search_, samples, there.T_world_scan, serial));
    there.score *= space.Left();
    there.contradiction_share = space.ContradictionShare();
    minima.push_back(there);
  }
  std::stable_sort(minima.begin(), minima.end(),
                   [](const Minimum& a, const Minimum& b) { return a.score > b.score; });
  return minima;
}

std::vector<RivalPose> RivalForecast::Twins(const ScanSurface& surface,
                                            const Eigen::Vector3d& position, const MoveReach& reach,
                                            const RegistrationConfig& config) const {
  parallel::Serial serial;
  const std::span<const SurfaceSample> samples = Compared(surface);
  const std::vector<ScanMove> moves = MoveSearch(search_, *coarse_, samples, position).Twins(reach);
  if (moves.empty()) return {};
  Alignment alignment;
  alignment.T_world_scan = Moved(position, {});
  alignment.score = ScorePose(search_, samples, alignment.T_world_scan);
  alignment.rivals =
      Refined(surface, position, moves, reach, kLeastRivalShare * alignment.score, config);
  if (alignment.rivals.empty()) return {};
  const std::vector<SampleAgreement> agreements =
      CompareSamples(model_, search_, samples, alignment.T_world_scan, serial);
  return OpenRivals(model_, surface, alignment, {samples, agreements}, serial);
}

std::vector<RivalPose> RivalForecast::Rivals(std::span<const OverlapElement> overlap,
                                             const Eigen::Vector3d& position,
                                             const sensor::ScannerModel& scanner,
                                             const RegistrationConfig& config,
                                             std::span<const TargetTie> targets) const {
  // As the scan that is not made yet would see them, its axes along the world's.
  std::vector<TargetTie> seen(targets.begin(), targets.end());
  for (TargetTie& target : seen) target.in_scan = target.in_world - position;
  const ScanSurface surface = SurfaceOf(overlap, position, scanner);
  std::vector<RivalPose> rivals = Twins(surface, position, ReachOfPriors(config), config);
  std::erase_if(rivals, [&](const RivalPose& rival) { return Refute(seen, rival.T_world_scan); });
  return rivals;
}

void RivalForecast::Judge(std::span<const OverlapElement> overlap, const Eigen::Vector3d& position,
                          const sensor::ScannerModel& scanner, const RegistrationConfig& config,
                          RegistrationVerdict& verdict, std::span<const TargetTie> targets) const {
  if (!verdict.registered()) return;
  const std::vector<RivalPose> rivals = Rivals(overlap, position, scanner, config, targets);
  if (rivals.empty()) return;
  constexpr double kNone = std::numeric_limits<double>::infinity();
  double nearest = kNone;     // m, of those that are not turned
  double least_turn = kNone;  // rad, of those that are
  double farthest = 0;
  for (const RivalPose& rival : rivals) {
    const double turn = TurnOf(rival);
    if (turn >= kLeastTwinTurn) {
      least_turn = std::min(least_turn, turn);
    } else {
      nearest = std::min(nearest, rival.distance);
    }
    farthest = std::max(farthest, rival.farthest);
  }
  verdict.outcome = RegistrationOutcome::kDoubtful;
  verdict.bases = {RegistrationBasis::kRivalPose};
  verdict.error_bound += farthest;
  verdict.rigorous_bound = std::max(verdict.rigorous_bound, verdict.error_bound);
  const double turned = TurnOf(rivals.front());
  verdict.reason = absl::StrFormat(
      "a scan from here would fit %.2f m away%s as well by all that is known (%.0f %% of what fits "
      "here)",
      rivals.front().distance,
      turned >= kLeastTwinTurn
          ? absl::StrFormat(" and turned by %.0f degrees", sensor::Degrees(turned))
          : "",
      100 * rivals.front().fit_share);
  std::vector<std::string> would;
  if (nearest < kNone) {
    // Of which the reach of Rivals() ends before the nearest.
    const double sigma =
        std::max(nearest / (kSigmasOfPrior + 2 * kSigmasOff),
                 (nearest - config.max_correspondence) / (kSigmasOfPrior + kSigmasOff));
    would.push_back(absl::StrFormat("%.2f m", std::floor(100 * sigma) / 100));
  }
  if (least_turn < kNone) {
    const double sigma = sensor::Degrees(least_turn) / (kSigmasOfPrior + kSigmasOff);
    would.push_back(absl::StrFormat("%.0f degrees of heading", std::floor(0.9 * sigma)));
  }
  verdict.remedy = absl::StrFormat(
      "say how good the priors are (%s, one sigma, would tell them apart), or have this scan and "
      "one before see two targets",
      absl::StrJoin(would, " and "));
}

}  // namespace vantage::registration
