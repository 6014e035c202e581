#include "core/site_prior/alignment.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"
#include "core/site_prior/walls.h"

namespace vantage::site_prior {
namespace {

constexpr double kLeastWalls = 4.0;    // m2 of measured wall, and so much in its lesser direction:
constexpr double kLeastAcross = 0.12;  // a share of it
constexpr double kFacesAlikeWall = 0.8;  // cosine of normals that face alike
constexpr double kCoarseReach = 0.4;     // m: farther off a point does not count
constexpr double kCoarseStep = 0.2;      // m
constexpr double kCoarseYaw = 0.0175;    // rad: a degree
constexpr double kCoarseScale = 0.015;
constexpr size_t kCoarsePoints = 700;
constexpr size_t kFinePoints = 6000;
constexpr size_t kRefined = 24;      // places that are looked at more closely
constexpr double kHeightLeft = 0.3;  // m that the height is off when the walls are found
constexpr double kSamePlace = 0.5;   // m, of two places
constexpr double kSameYaw = 0.05;    // rad
// Chosen on flats 101 to 108 after one scan: of priors that are true 0.94 and more agrees and at
// most 0.05 is missing, and the second best place fits 0.54 as well; of others, at their best
// places, at most 0.76, at least 0.21, and 0.70.
constexpr double kAgrees = 0.65;    // the least share of measured walls
constexpr double kDisagrees = 0.5;  // below it the prior is not of this place
constexpr double kMostMissing = 0.25;
// m2 of measured wall, as a room of 4 by 5 m has over furniture: who saw more, at places of which
// none agrees, has seen enough.
constexpr double kRoomOfWalls = 25.0;
constexpr double kMostRival = 0.75;     // of the best fit
constexpr size_t kDecidedAtLeast = 30;  // cells of the prior's walls

// A change of the placement: the model's middle goes to another place of the prior.
struct Offset {
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();  // m, in the prior
  double yaw = 0;                                   // rad
  double scale = 1;                                 // times the placement's
};

struct Fit {
  PriorPose pose;
  double agreeing = 0;
  double missing = 0;
  double residual = 0;
  double fit = 0;
};

class Search {
 public:
  Search(const model::PlanningView& model, const model::PlanningView& space,
         const PriorPose& placement, double accuracy, std::vector<WallPoint> walls)
      : model_(model),
        placement_(placement),
        tolerance_(std::max(2 * accuracy, 1.5 * model.voxel_size())),
        floors_(model),
        walls_(std::move(walls)),
        middle_(Middle(walls_)),
        field_(space, BoxFor()) {}

  // Places that fit best by a coarse look, apart from one another. Empty when cancelled.
  std::vector<Offset> Coarse(const parallel::Cancellation& cancelled) const;
  // The same place, moved to where the walls lie on each other.
  PriorPose Refine(const Offset& offset) const;
  Fit Judge(const PriorPose& pose) const;

 private:
  static Eigen::Vector3d Middle(const std::vector<WallPoint>& walls) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const WallPoint& wall : walls) sum += wall.at;
    return sum / static_cast<double>(std::max<size_t>(1, walls.size()));
  }
  Eigen::AlignedBox3d BoxFor() const {
    Eigen::AlignedBox3d box;
    double reach = 0;
    for (const WallPoint& wall : walls_) {
      box.extend(placement_.ToPrior(wall.at));
      reach = std::max(reach, (wall.at - middle_).head<2>().norm());
    }
    const double around =
        kSearchRadius + reach * (kSearchYaw + kSearchScale) + WallField::kReach + 0.1;
    box.min() -= Eigen::Vector3d(around, around, 1);
    box.max() += Eigen::Vector3d(around, around, 1);
    return box;
  }
  PriorPose PoseOf(const Offset& offset) const {
    PriorPose pose = placement_;
    pose.yaw -= offset.yaw;
    pose.scale *= offset.scale;
    const Eigen::Vector3d shift(offset.shift.x(), offset.shift.y(), 0);
    const Eigen::Vector3d there = placement_.ToPrior(middle_) + shift;
    pose.translation += middle_ - pose.ToModel(there);
    return pose;
  }
  // Whether the model knows that there is no wall at a place of a prior's, or that there is one.
  enum class Known { kNothing, kWall, kNoWall };
  Known At(const Eigen::Vector3d& p) const;

  const model::PlanningView& model_;
  const PriorPose& placement_;
  const double tolerance_;  // m
  const Floors floors_;
  const std::vector<WallPoint> walls_;
  const Eigen::Vector3d middle_;
  const WallField field_;
};

std::vector<Offset> Search::Coarse(const parallel::Cancellation& cancelled) const {
  struct Scored {
    double score;
    Offset offset;
  };
  std::vector<Scored> all;
  const size_t stride = walls_.size() / kCoarsePoints + 1;
  const int yaws = static_cast<int>(std::lround(kSearchYaw / kCoarseYaw));
  const int scales = static_cast<int>(std::lround(kSearchScale / kCoarseScale));
  const int steps = static_cast<int>(std::lround(kSearchRadius / kCoarseStep));
  std::vector<Eigen::Vector3d> points;
  std::vector<size_t> ways;
  for (int yaw = -yaws; yaw <= yaws; ++yaw) {
    for (int scale = -scales; scale <= scales; ++scale) {
      if (cancelled.Requested()) return {};
      const Offset turned{Eigen::Vector2d::Zero(), yaw * kCoarseYaw, 1 + scale * kCoarseScale};
      const PriorPose pose = PoseOf(turned);
      points.clear();
      ways.clear();
      for (size_t i = 0; i < walls_.size(); i += stride) {
        points.push_back(pose.ToPrior(walls_[i].at));
        ways.push_back(WallField::WayOf(Eigen::Rotation2Dd(-pose.yaw) * walls_[i].normal));
      }
      for (int y = -steps; y <= steps; ++y) {
        for (int x = -steps; x <= steps; ++x) {
          const Eigen::Vector3d shift(x * kCoarseStep, y * kCoarseStep, 0);
          double sum = 0;
          for (size_t i = 0; i < points.size(); ++i) {
            sum += std::max(0.0, kCoarseReach - field_.AwayAt(points[i] + shift, ways[i]));
          }
          all.push_back({sum / (kCoarseReach * static_cast<double>(points.size())),
                         {shift.head<2>(), turned.yaw, turned.scale}});
        }
      }
    }
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Scored& a, const Scored& b) { return a.score > b.score; });
  std::vector<Offset> best;
  for (const Scored& scored : all) {
    const bool near = std::any_of(best.begin(), best.end(), [&](const Offset& other) {
      return (other.shift - scored.offset.shift).norm() < kSamePlace &&
             std::abs(other.yaw - scored.offset.yaw) < kSameYaw;
    });
    if (near) continue;
    best.push_back(scored.offset);
    if (best.size() >= kRefined) break;
  }
  return best;
}

// Gauss and Newton's method with Tukey's weights: points to lines, in the prior's plan.
PriorPose Search::Refine(const Offset& from) const {
  Offset offset = from;
  const Eigen::Vector3d middle = placement_.ToPrior(middle_);
  for (int round = 0; round < 12; ++round) {
    const double reach = round < 4 ? 0.45 : round < 8 ? 0.3 : std::max(0.15, tolerance_);
    const PriorPose pose = PoseOf(offset);
    Eigen::Matrix4d a = Eigen::Matrix4d::Zero();
    Eigen::Vector4d b = Eigen::Vector4d::Zero();
    for (const WallPoint& wall : walls_) {
      const Eigen::Vector3d p = pose.ToPrior(wall.at);
      const Eigen::Vector2d turned = Eigen::Rotation2Dd(-pose.yaw) * wall.normal;
      const auto nearest = field_.At(p, turned);
      if (!nearest.has_value() || std::abs(nearest->along) > reach) continue;
      if (turned.dot(nearest->normal) < kFacesAlikeWall) continue;
      const double u = nearest->along / reach;
      const double weight = wall.area * (1 - u * u) * (1 - u * u);
      const Eigen::Vector2d r = (p - middle).head<2>() - offset.shift;
      Eigen::Vector4d j;
      j << nearest->normal, nearest->normal.dot(Eigen::Vector2d(-r.y(), r.x())),
          -nearest->normal.dot(r);
      a += weight * j * j.transpose();
      b -= weight * nearest->along * j;
    }
    // Held where nothing tells: a centimetre, a tenth of a degree, and a percent of scale.
    a += 0.02 * Eigen::Vector4d(1, 1, 30, 100).asDiagonal().toDenseMatrix();
    b -= 0.02 * Eigen::Vector4d(0, 0, 0, 100 * (offset.scale - 1));
    const Eigen::Vector4d step = a.ldlt().solve(b);
    if (!step.allFinite()) break;
    offset.shift += step.head<2>();
    offset.yaw += step[2];
    offset.scale *= 1 + step[3];
    offset.scale = std::clamp(offset.scale, 1 - kSearchScale, 1 + kSearchScale);
  }
  return PoseOf(offset);
}

Search::Known Search::At(const Eigen::Vector3d& p) const {
  const model::VoxelIndex at = model_.At(p);
  const int reach = static_cast<int>(std::ceil(tolerance_ / model_.voxel_size()));
  bool empty = false;
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      const model::VoxelState state = model_.State(at + model::VoxelIndex(dx, dy, 0));
      if (state == model::VoxelState::kTrueSurface || state == model::VoxelState::kAbsorbed) {
        return Known::kWall;
      }
      if (dx == 0 && dy == 0) empty = state == model::VoxelState::kEmpty;
    }
  }
  return empty ? Known::kNoWall : Known::kNothing;
}

Fit Search::Judge(const PriorPose& pose) const {
  Fit fit;
  fit.pose = pose;
  double area = 0;
  double agreeing = 0;
  double squares = 0;
  for (const WallPoint& wall : walls_) {
    area += wall.area;
    const Eigen::Vector2d turned = Eigen::Rotation2Dd(-pose.yaw) * wall.normal;
    const auto nearest = field_.At(pose.ToPrior(wall.at), turned);
    if (!nearest.has_value()) continue;
    const double off = nearest->along * pose.scale;
    if (std::abs(off) > tolerance_ || turned.dot(nearest->normal) < kFacesAlikeWall) continue;
    agreeing += wall.area;
    squares += wall.area * off * off;
  }
  fit.agreeing = area > 0 ? agreeing / area : 0;
  fit.residual = agreeing > 0 ? std::sqrt(squares / agreeing) : 0;
  size_t there = 0;
  size_t gone = 0;
  for (const WallPoint& wall : field_.points()) {
    const Eigen::Vector3d p = pose.ToModel(wall.at);
    const std::optional<double> floor = floors_.Under(p.z());
    if (!floor.has_value() || p.z() < *floor + kWallsFrom || p.z() > *floor + kWallsTo) continue;
    const Known known = At(p);
    there += known == Known::kWall ? 1 : 0;
    gone += known == Known::kNoWall ? 1 : 0;
  }
  if (there + gone >= kDecidedAtLeast) {
    fit.missing = static_cast<double>(gone) / static_cast<double>(there + gone);
  }
  fit.fit = fit.agreeing * (1 - fit.missing);
  return fit;
}

// z in the prior of what lies under measured floor, at most `most` (m) off, less what it should be
// by the pose; 0 where nothing tells.
double HeightOff(const model::PlanningView& model, const model::PlanningView& space,
                 const PriorPose& pose, double most) {
  // Measured floor: what faces up within a hand of where a scanner stood.
  std::vector<Eigen::Vector3d> floor;
  const Floors floors(model);
  model.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& surface) {
        if (state != model::VoxelState::kTrueSurface || surface.normal.z() < 0.9F) return;
        const Eigen::Vector3d at = surface.centroid.cast<double>();
        const std::optional<double> under = floors.Under(at.z());
        if (under.has_value() && std::abs(at.z() - *under) < 0.1) floor.push_back(at);
      });
  if (floor.empty()) return 0;
  constexpr double kCell = 0.2;
  const Eigen::AlignedBox3d box = [&] {
    Eigen::AlignedBox3d around;
    for (const Eigen::Vector3d& p : floor) around.extend(pose.ToPrior(p));
    around.min().array() -= 1 + most;
    around.max().array() += 1 + most;
    return around;
  }();
  const int width = static_cast<int>(box.sizes().x() / kCell) + 1;
  const int height = static_cast<int>(box.sizes().y() / kCell) + 1;
  std::vector<std::vector<float>> levels(static_cast<size_t>(width) * static_cast<size_t>(height));
  const auto cell_of = [&](const Eigen::Vector3d& p) -> std::optional<size_t> {
    const int x = static_cast<int>(std::floor((p.x() - box.min().x()) / kCell));
    const int y = static_cast<int>(std::floor((p.y() - box.min().y()) / kCell));
    if (x < 0 || y < 0 || x >= width || y >= height) return std::nullopt;
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  };
  space.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState, const model::SurfaceVoxel& surface) {
        const Eigen::Vector3d p = surface.centroid.cast<double>();
        if (surface.normal.z() < 0.9F || p.z() < box.min().z() || p.z() > box.max().z()) return;
        if (const auto cell = cell_of(p)) levels[*cell].push_back(static_cast<float>(p.z()));
      });
  std::vector<double> off;
  for (const Eigen::Vector3d& p : floor) {
    const Eigen::Vector3d in_prior = pose.ToPrior(p);
    const auto cell = cell_of(in_prior);
    if (!cell.has_value()) continue;
    double nearest = most;
    bool found = false;
    for (const float z : levels[*cell]) {
      const double apart = static_cast<double>(z) - in_prior.z();
      if (std::abs(apart) >= std::abs(nearest)) continue;
      nearest = apart;
      found = true;
    }
    if (found) off.push_back(nearest);
  }
  if (off.empty()) return 0;
  const auto median = off.begin() + static_cast<ptrdiff_t>(off.size() / 2);
  std::nth_element(off.begin(), median, off.end());
  return *median * pose.scale;
}

// The share of measured walls that face across the direction that most face.
double AcrossShare(const std::vector<WallPoint>& walls) {
  Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
  double area = 0;
  for (const WallPoint& wall : walls) {
    sum += wall.area * wall.normal * wall.normal.transpose();
    area += wall.area;
  }
  if (!(area > 0)) return 0;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(sum);
  return solver.eigenvalues()[0] / area;
}

std::string Words(const Alignment& alignment, bool several) {
  const double percent = 100 * alignment.agreeing;
  switch (alignment.verdict) {
    case AlignmentVerdict::kNotEnoughSeen:
      if (several) {
        return absl::StrFormat(
            "the prior fits in several places (%.0f %% of %.1f m2 of walls agree at the best); it "
            "is used as soon as scans tell which",
            percent, alignment.wall_area);
      }
      return absl::StrFormat(
          "too little was seen to align the prior: %.1f m2 of walls over furniture",
          alignment.wall_area);
    case AlignmentVerdict::kAligned:
      return absl::StrFormat(
          "the prior is aligned: %.0f %% of %.1f m2 of measured walls agree, to %.0f mm; scale "
          "%.3f",
          percent, alignment.wall_area, 1000 * alignment.residual, alignment.pose.scale);
    case AlignmentVerdict::kNotAligned:
      return absl::StrFormat(
          "the prior is not used: of %.1f m2 of measured walls only %.0f %% agree with it at the "
          "best place within %.0f m and %.0f degrees of where it was put, and %.0f %% of its walls "
          "there are not; place it anew, or give another one",
          alignment.wall_area, percent, kSearchRadius, kSearchYaw * 180 / M_PI,
          100 * alignment.missing);
  }
  return "";
}

}  // namespace

absl::StatusOr<Alignment> Align(const model::PlanningView& model, const model::PlanningView& space,
                                const PriorPose& placement, double accuracy,
                                const parallel::Cancellation& cancelled) {
  Alignment alignment;
  alignment.pose = placement;
  std::vector<WallPoint> walls = MeasuredWalls(model, kFinePoints);
  for (const WallPoint& wall : walls) alignment.wall_area += wall.area;
  if (alignment.wall_area < kLeastWalls || AcrossShare(walls) < kLeastAcross) {
    alignment.message = Words(alignment, false);
    return alignment;
  }
  PriorPose start = placement;
  start.translation.z() -= HeightOff(model, space, placement, kSearchHeight);
  const Search search(model, space, start, accuracy, std::move(walls));
  std::vector<Fit> fits;
  for (const Offset& offset : search.Coarse(cancelled)) {
    if (cancelled.Requested()) break;
    fits.push_back(search.Judge(search.Refine(offset)));
  }
  if (cancelled.Requested()) return absl::CancelledError("site prior");
  std::stable_sort(fits.begin(), fits.end(),
                   [](const Fit& a, const Fit& b) { return a.fit > b.fit; });
  const Fit& best = fits.front();
  Fit rival;
  for (const Fit& fit : fits) {
    const Eigen::Vector3d middle = best.pose.ToPrior(model.Centre(model.bounds().min)) +
                                   best.pose.ToPrior(model.Centre(model.bounds().max));
    const double apart =
        (fit.pose.ToModel(middle / 2) - best.pose.ToModel(middle / 2)).head<2>().norm();
    if (apart < kSamePlace &&
        std::abs(std::remainder(fit.pose.yaw - best.pose.yaw, 2 * M_PI)) < kSameYaw) {
      continue;
    }
    rival = fit;
    break;
  }
  alignment.pose = best.pose;
  alignment.agreeing = best.agreeing;
  alignment.missing = best.missing;
  alignment.residual = best.residual;
  alignment.rival = best.fit > 0 ? rival.fit / best.fit : 0;
  alignment.pose.translation.z() -= HeightOff(model, space, best.pose, kHeightLeft);
  const bool several = alignment.rival > kMostRival;
  const bool agrees = best.agreeing >= kAgrees && best.missing <= kMostMissing;
  if (agrees) {
    alignment.verdict = several ? AlignmentVerdict::kNotEnoughSeen : AlignmentVerdict::kAligned;
  } else if (best.agreeing < kDisagrees || best.missing > kMostMissing || !several ||
             alignment.wall_area > kRoomOfWalls) {
    alignment.verdict = AlignmentVerdict::kNotAligned;
  }
  alignment.message = Words(alignment, several);
  return alignment;
}

}  // namespace vantage::site_prior
