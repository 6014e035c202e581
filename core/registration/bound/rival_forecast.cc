#include "core/registration/bound/rival_forecast.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "absl/strings/str_format.h"
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
// Between shifts that are tried, voxels: from the one nearest to a twin a wall's samples still find
// its voxels (kWidestReach), as the middle of four is 2.1 voxels away.
constexpr int kShiftStep = 3;
// Shifts at most: a guess needs 560 with voxels of 5 cm. More are tried around the middle only.
constexpr double kMostShifts = 4000;
// Samples that say how much holds at a shift: a share of a half is known to 6 %, one sigma. Fewer
// than the least say nothing, and most shifts are told to be none after a quarter of them.
constexpr size_t kHoldSamples = 64;
constexpr size_t kFewestHoldSamples = 8;
constexpr size_t kFirstHoldSamples = 16;
// Of those that notice a shift so many have to be held that a pose is looked at, of near ones,
// which hold by what does not notice them, of all: what OpenRivals() asks, less two sigma, less
// what a shift that is not quite the twin's loses.
constexpr double kWorthALook = 0.30;
constexpr double kNearWorthALook = 0.78;
constexpr double kNearShift = 0.65;  // m
// After the first samples: less two sigma of them.
constexpr double kFirstLess = 0.2;
// Twins are refined from the best shift among neighbours; as many as an alignment compares
// (kFineMinima), and some for those that end in the same one or where the scan is.
constexpr size_t kRefined = 8;
constexpr double kSamePlace = 0.3;  // m, as in lattices (kNotTheSame)
// Of a pose: for its refinement, and for what speaks for and against it (1 %, one sigma).
constexpr size_t kRefineSamples = 400;
constexpr size_t kCompareSamples = 2000;
constexpr int kRefineSteps = 8;
// A near one may be on its way to where the scan is, as an alignment's first stage would lead it:
// it is followed towards its end.
constexpr int kNearSteps = 30;
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
  SpreadSamples(surface.samples);
  return surface;
}

struct Shift {
  Eigen::Vector3d by = Eigen::Vector3d::Zero();  // m
  double held = 0;                               // of the samples that notice it
};

class Shifts {
 public:
  Shifts(const VoxelSearch& search, std::span<const SurfaceSample> samples,
         const Eigen::Vector3d& position)
      : search_(search), samples_(samples), position_(position) {}

  // Those worth a look within `reach` of where the scan is, the best of their neighbours.
  std::vector<Shift> Within(double reach) const {
    const double step = kShiftStep * search_.voxel_size();
    const double radius = std::min(reach, step * std::sqrt(kMostShifts / sensor::kPi));
    const int steps = static_cast<int>(radius / step);
    std::vector<Shift> found;
    for (int y = -steps; y <= steps; ++y) {
      for (int x = -steps; x <= steps; ++x) {
        const Eigen::Vector3d by(step * x, step * y, 0);
        if ((x == 0 && y == 0) || by.norm() > radius) continue;
        if (const double held = Held(by); held > 0) found.push_back({by, held});
      }
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const Shift& a, const Shift& b) { return a.held > b.held; });
    std::vector<Shift> apart;
    for (const Shift& shift : found) {
      if (apart.size() >= kRefined) break;
      const bool same = std::any_of(apart.begin(), apart.end(), [&](const Shift& other) {
        return (shift.by - other.by).norm() < kSamePlace;
      });
      if (!same) apart.push_back(shift);
    }
    return apart;
  }

 private:
  // Of the samples that notice a shift, of a near one of all; 0 when it is not worth a look.
  double Held(const Eigen::Vector3d& by) const {
    const bool near = by.norm() < kNearShift;
    const double least = near ? kNearWorthALook : kWorthALook;
    // A near one is not to be held by what pulls it back to where the scan is.
    const double reach = near ? kFineReach : kWidestReach;
    size_t asked = 0;
    size_t held = 0;
    const auto share = [&] { return static_cast<double>(held) / static_cast<double>(asked); };
    for (const SurfaceSample& s : samples_) {
      const Eigen::Vector3d normal = s.normal.cast<double>();
      if (!near && std::abs(normal.dot(by)) < kApart) continue;
      ++asked;
      const Eigen::Vector3d point = position_ + by + s.point.cast<double>();
      held += search_.FindsAny(point, normal, reach) ? 1 : 0;
      if (asked == kFirstHoldSamples && share() < least - kFirstLess) return 0;
      if (asked == kHoldSamples) break;
    }
    if (asked < kFewestHoldSamples) return 1;  // nothing speaks against it
    return share() >= least ? share() : 0;
  }

  const VoxelSearch& search_;
  std::span<const SurfaceSample> samples_;
  const Eigen::Vector3d& position_;
};

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
    : model_(model), search_(model, TrueSurfaceBox(model)) {}

std::vector<RivalPose> RivalForecast::Rivals(std::span<const OverlapElement> overlap,
                                             const Eigen::Vector3d& position,
                                             const sensor::ScannerModel& scanner,
                                             const RegistrationConfig& config) const {
  parallel::Serial serial;
  const ScanSurface surface = SurfaceOf(overlap, position, scanner);
  sensor::PosePrior prior;
  prior.T_world_scan.translate(position);
  if (config.prior_sigma > 0) {
    sensor::Matrix6d covariance = sensor::Matrix6d::Zero();
    covariance.diagonal().tail<3>().setConstant(config.prior_sigma * config.prior_sigma);
    prior.covariance = covariance;
  }
  const std::span<const SurfaceSample> samples(surface.samples.data(),
                                               std::min(kCompareSamples, surface.samples.size()));
  const double off = config.prior_sigma > 0 ? kSigmasOff * config.prior_sigma : kGuessOff;
  const double reach = ReachOf(prior).shift + off + std::min(off, config.max_correspondence);
  const std::vector<Shift> shifts = Shifts(search_, samples, position).Within(reach);
  if (shifts.empty()) return {};

  Alignment alignment;
  alignment.T_world_scan = prior.T_world_scan;
  alignment.score = ScorePose(search_, samples, prior.T_world_scan);
  sensor::PosePrior free = prior;
  free.covariance.reset();
  std::optional<CorrespondenceField> around;
  const CorrespondenceField* field = nullptr;
  if (all_over_ != nullptr && all_over_->reach == config.max_correspondence) {
    field = &all_over_->field;
  }
  for (const Shift& shift : shifts) {
    free.T_world_scan = prior.T_world_scan;
    free.T_world_scan.pretranslate(shift.by);
    Minimum there;
    const PriorTerm term(free, {});
    const bool near = shift.by.norm() < kNearShift;
    if (near) {
      if (field == nullptr) {
        Eigen::AlignedBox3d box = BoxOf(surface, prior.T_world_scan);
        const Eigen::Vector3d margin =
            Eigen::Vector3d::Constant(kNearShift + config.max_correspondence);
        field = &around.emplace(model_, Eigen::AlignedBox3d(box.min() - margin, box.max() + margin),
                                config.max_correspondence, serial, kFieldCells);
      }
      free.T_world_scan =
          AlignCoarse(*field, samples.first(std::min(kRefineSamples, samples.size())),
                      free.T_world_scan, term, config.max_correspondence, model_.voxel_size());
    }
    there.T_world_scan =
        AlignFine(search_, surface, kRefineSamples, free.T_world_scan, term, config, serial,
                  near ? kNearSteps : kRefineSteps, WideScale(model_.voxel_size()))
            .pose;
    const auto same = [&](const Eigen::Isometry3d& other) {
      return SurfaceDistance(there.T_world_scan, other, samples) < kApart;
    };
    const double away =
        (there.T_world_scan.translation() - prior.T_world_scan.translation()).norm();
    const bool known = std::any_of(alignment.rivals.begin(), alignment.rivals.end(),
                                   [&](const Minimum& m) { return same(m.T_world_scan); });
    if (known || away > reach || same(prior.T_world_scan)) continue;
    there.score = ScorePose(search_, samples, there.T_world_scan);
    if (there.score < kLeastRivalShare * alignment.score) continue;
    const SpaceAgreement space =
        AgreementOf(samples, CompareSamples(model_, search_, samples, there.T_world_scan, serial));
    there.score *= space.Left();
    alignment.rivals.push_back(there);
  }
  if (alignment.rivals.empty()) return {};
  std::stable_sort(alignment.rivals.begin(), alignment.rivals.end(),
                   [](const Minimum& a, const Minimum& b) { return a.score > b.score; });
  const std::vector<SampleAgreement> agreements =
      CompareSamples(model_, search_, samples, prior.T_world_scan, serial);
  return OpenRivals(model_, surface, alignment, {samples, agreements}, serial);
}

void RivalForecast::Judge(std::span<const OverlapElement> overlap, const Eigen::Vector3d& position,
                          const sensor::ScannerModel& scanner, const RegistrationConfig& config,
                          RegistrationVerdict& verdict, std::span<const TargetTie> targets) const {
  if (!verdict.registered()) return;
  std::vector<RivalPose> rivals = Rivals(overlap, position, scanner, config);
  // As the scan that is not made yet would see them, its axes along the world's.
  std::vector<TargetTie> seen(targets.begin(), targets.end());
  for (TargetTie& target : seen) target.in_scan = target.in_world - position;
  std::erase_if(rivals, [&](const RivalPose& rival) { return Refute(seen, rival.T_world_scan); });
  if (rivals.empty()) return;
  double nearest = rivals.front().distance;
  double farthest = 0;
  for (const RivalPose& rival : rivals) {
    nearest = std::min(nearest, rival.distance);
    farthest = std::max(farthest, rival.distance);
  }
  verdict.outcome = RegistrationOutcome::kDoubtful;
  verdict.bases = {RegistrationBasis::kRivalPose};
  verdict.error_bound += farthest;
  verdict.rigorous_bound = std::max(verdict.rigorous_bound, verdict.error_bound);
  verdict.reason = absl::StrFormat(
      "a scan from here would fit %.2f m away as well by all that is known (%.0f %% of what fits "
      "here)",
      rivals.front().distance, 100 * rivals.front().fit_share);
  // Of which the reach of Rivals() ends before the nearest.
  const double sigma =
      std::max(nearest / (kSigmasOfPrior + 2 * kSigmasOff),
               (nearest - config.max_correspondence) / (kSigmasOfPrior + kSigmasOff));
  verdict.remedy = absl::StrFormat(
      "say how good the priors are (%.2f m, one sigma, would tell them apart), or have this scan "
      "and one before see two targets",
      std::floor(100 * sigma) / 100);
}

}  // namespace vantage::registration
