#include "core/registration/align.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "core/registration/correspondence_field.h"

namespace vantage {
namespace {

constexpr size_t kCoarseSamples = 2000;     // for the many starts
constexpr size_t kScoreSamples = 4000;      // for comparing minima
constexpr size_t kFineSamples = 24'000;     // for the last stage
constexpr int kFineMinima = 5;              // that are refined and compared
constexpr double kCoarseCompatible = 0.75;  // cosine between normals
constexpr double kFineCompatible = 0.80;
constexpr double kFineReach = 1.6;  // voxels from a sample to a voxel's centroid
// A guess without covariance, so that what nothing constrains stays where it is: m, rad.
constexpr double kVagueShift = 1.0;
constexpr double kVagueTurn = 0.3;

// A pose change about a fixed point: [rotation; translation].
Eigen::Isometry3d Moved(const Eigen::Isometry3d& pose, const Vector6d& change,
                        const Eigen::Vector3d& about) {
  const double angle = change.head<3>().norm();
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (angle > 1e-15) {
    turn = Eigen::AngleAxisd(angle, change.head<3>() / angle).toRotationMatrix();
  }
  Eigen::Isometry3d moved = pose;
  moved.linear() = Eigen::Quaterniond(turn * pose.linear()).normalized().toRotationMatrix();
  moved.translation() = turn * (pose.translation() - about) + about + change.tail<3>();
  return moved;
}

// The change that leads from `from` to `to`, about a point (small rotations).
Vector6d Change(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to,
                const Eigen::Vector3d& about) {
  const Eigen::Matrix3d turn = to.linear() * from.linear().transpose();
  const Eigen::AngleAxisd rotation(turn);
  Vector6d change;
  change << rotation.angle() * rotation.axis(),
      to.translation() - about - turn * (from.translation() - about);
  return change;
}

// Normal equations of a Gauss-Newton step about a point.
struct Normals {
  Matrix6d h = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  double cost = 0;
  size_t count = 0;

  void Add(const Eigen::Vector3d& arm, const Eigen::Vector3d& normal, double residual, double w) {
    Vector6d row;
    row << arm.cross(normal), normal;
    h.selfadjointView<Eigen::Lower>().rankUpdate(row, w);
    b += (w * residual) * row;
    ++count;
  }
  void operator+=(const Normals& other) {
    h += other.h;
    b += other.b;
    cost += other.cost;
    count += other.count;
  }
};

// What is known of the pose beforehand, about the prior's scanner position.
class PriorTerm {
 public:
  explicit PriorTerm(const PosePrior& prior) : pose_(prior.T_world_scan) {
    information_.setZero();
    if (prior.covariance.has_value()) {
      information_ = prior.covariance->ldlt().solve(Matrix6d::Identity());
    } else {
      information_.diagonal() << Eigen::Vector3d::Constant(1 / (kVagueTurn * kVagueTurn)),
          Eigen::Vector3d::Constant(1 / (kVagueShift * kVagueShift));
    }
    if (prior.levelled_sigma.has_value()) {
      const double sigma = *prior.levelled_sigma;
      information_(0, 0) += 1 / (sigma * sigma);
      information_(1, 1) += 1 / (sigma * sigma);
    }
  }
  void AddTo(Normals& normals, const Eigen::Isometry3d& pose, const Eigen::Vector3d& about) const {
    const Vector6d change = Change(pose_, pose, pose_.translation());
    Matrix6d move = Matrix6d::Identity();  // of a change about `about` into one about the prior
    const Eigen::Vector3d arm = pose_.translation() - about;
    move.bottomLeftCorner<3, 3>() << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(),
        0;
    normals.h += (move.transpose() * information_ * move).eval();
    normals.b += move.transpose() * information_ * change;
  }

 private:
  Eigen::Isometry3d pose_;
  Matrix6d information_;
};

Vector6d Solve(Normals& normals) {
  normals.h = Matrix6d(normals.h.selfadjointView<Eigen::Lower>());
  return -normals.h.ldlt().solve(normals.b);
}

double Tukey(double residual, double scale) {
  const double ratio = residual / scale;
  if (std::abs(ratio) >= 1) return 0;
  const double rest = 1 - ratio * ratio;
  return rest * rest;
}

// --- The first stage: few samples, wide search.

Eigen::Isometry3d AlignCoarse(const CorrespondenceField& field,
                              std::span<const SurfaceSample> samples, Eigen::Isometry3d pose,
                              const PriorTerm& prior, double reach, double voxel) {
  const double last = 2.0 * voxel;
  for (double radius = reach; radius > last; radius *= 0.75) {
    for (int step = 0; step < 3; ++step) {
      const Eigen::Matrix3f turn = pose.linear().cast<float>();
      const Eigen::Vector3f shift = pose.translation().cast<float>();
      const Eigen::Vector3d about = pose.translation();
      Normals normals;
      // One sigma of the residuals at this stage: they are still mostly misalignment.
      const double weight = 9 / (radius * radius);
      const auto far = static_cast<float>(2.25 * radius * radius);
      for (const SurfaceSample& s : samples) {
        const Eigen::Vector3f point = turn * s.point + shift;
        const Eigen::Vector3f normal = turn * s.normal;
        const SurfaceElement* element = field.Nearest(point, normal);
        if (element == nullptr) continue;
        const Eigen::Vector3f gap = point - element->centroid;
        if (gap.squaredNorm() > far || normal.dot(element->normal) < kCoarseCompatible) continue;
        const double residual = gap.dot(element->normal);
        const double w = Tukey(residual, radius);
        if (w <= 0) continue;
        normals.Add(point.cast<double>() - about, element->normal.cast<double>(), residual,
                    w * weight);
      }
      if (normals.count < 20) return pose;
      prior.AddTo(normals, pose, about);
      const Vector6d change = Solve(normals);
      pose = Moved(pose, change, about);
      if (change.tail<3>().norm() < 0.02 * radius && change.head<3>().norm() < 0.002) break;
    }
  }
  return pose;
}

// Where the starts are around the prior: shifts and headings at a spacing that the first stage's
// reach bridges, as far as the prior may be wrong.
std::vector<Eigen::Isometry3d> Starts(const PosePrior& prior) {
  double shift = 0.40;
  double turn = Radians(12);
  if (prior.covariance.has_value()) {
    shift = std::min(shift, 2 * std::sqrt(prior.covariance->diagonal().tail<3>().maxCoeff()));
    turn = std::min(turn, 2 * std::sqrt((*prior.covariance)(2, 2)));
  }
  std::vector<Eigen::Isometry3d> starts{prior.T_world_scan};
  for (const double heading : {0.0, -1.0, 1.0}) {
    for (const double x : {0.0, -1.0, 1.0}) {
      for (const double y : {0.0, -1.0, 1.0}) {
        if (heading == 0 && x == 0 && y == 0) continue;
        Vector6d change = Vector6d::Zero();
        change[2] = heading * turn;
        change[3] = x * shift;
        change[4] = y * shift;
        starts.push_back(Moved(prior.T_world_scan, change, prior.T_world_scan.translation()));
      }
    }
  }
  return starts;
}

// --- The last stage: the voxels themselves.

struct Match {
  const SurfaceVoxel* voxel = nullptr;
  Eigen::Vector3d normal;  // mean of the sample's and the voxel's
};

class VoxelSearch {
 public:
  VoxelSearch(const PlanningView& model, double reach_voxels)
      : model_(model), reach_(reach_voxels * model.voxel_size()) {}

  // The nearest compatible true-surface voxel by its centroid.
  Match Find(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) const {
    Match best;
    const double h = model_.voxel_size();
    const VoxelIndex low = model_.At(point - Eigen::Vector3d::Constant(reach_));
    const VoxelIndex high = model_.At(point + Eigen::Vector3d::Constant(reach_));
    double nearest = reach_ * reach_;
    for (int z = low.z(); z <= high.z(); ++z) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int x = low.x(); x <= high.x(); ++x) {
          const VoxelIndex v(x, y, z);
          const Eigen::Array3d corner = v.cast<double>().array() * h;
          const Eigen::Array3d outside =
              (corner - point.array()).max(point.array() - corner - h).max(0.0);
          if (outside.square().sum() >= nearest) continue;
          if (model_.State(v) != VoxelState::kTrueSurface) continue;
          const SurfaceVoxel* voxel = model_.Surface(v);
          const Eigen::Vector3d voxel_normal = voxel->normal.cast<double>();
          if (voxel_normal.dot(normal) < kFineCompatible) continue;
          const double distance = (point - voxel->centroid.cast<double>()).squaredNorm();
          if (distance >= nearest) continue;
          nearest = distance;
          best.voxel = voxel;
        }
      }
    }
    if (best.voxel != nullptr) {
      best.normal = (best.voxel->normal.cast<double>() + normal).normalized();
    }
    return best;
  }

 private:
  const PlanningView& model_;
  double reach_;
};

// Variance of a residual before any of it is seen.
double ResidualVariance(const SurfaceSample& sample, const SurfaceVoxel& voxel,
                        const Eigen::Vector3d& gap, double along, double roughness,
                        double normal_sigma) {
  const double noise = std::max<double>(sample.sigma, roughness);
  const double model = noise * noise / std::max<double>(1.0, voxel.samples);
  const double interpolated = voxel.samples == 0 ? noise * noise : 0.0;
  const double across = gap.squaredNorm() - along * along;  // m^2, off the centroid in its plane
  return noise * noise + model + interpolated +
         0.5 * normal_sigma * normal_sigma * std::max(0.0, across);
}

struct FineResult {
  Eigen::Isometry3d pose;
  bool converged = false;
  int iterations = 0;
};

FineResult AlignFine(const PlanningView& model, const ScanSurface& surface, size_t count,
                     const Eigen::Isometry3d& pose, const PriorTerm& prior,
                     const RegistrationConfig& config, Parallel& parallel, int max_iterations) {
  const std::span<const SurfaceSample> samples(surface.samples.data(),
                                               std::min(count, surface.samples.size()));
  constexpr size_t kChunk = 1024;
  const size_t chunks = (samples.size() + kChunk - 1) / kChunk;
  std::vector<Match> matches(samples.size());
  std::vector<Eigen::Vector3d> looked_up_at(samples.size(),
                                            Eigen::Vector3d::Constant(std::nan("")));
  std::vector<Normals> partial(chunks);
  std::vector<std::vector<double>> magnitudes(chunks);
  const double h = model.voxel_size();
  const double still = 0.02 * h;  // a sample that moved less keeps its voxel
  FineResult result{pose, false, 0};
  double scale = 1.5 * h;  // of the robust weights, shrinking to what the residuals show
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    // Wider at first: the coarse pose may be a voxel off.
    const VoxelSearch search(model, iteration < 2 ? 2.5 : kFineReach);
    const Eigen::Vector3d about = result.pose.translation();
    parallel.For(chunks, [&](size_t chunk) {
      Normals sum;
      magnitudes[chunk].clear();
      const size_t end = std::min(samples.size(), (chunk + 1) * kChunk);
      for (size_t i = chunk * kChunk; i < end; ++i) {
        const SurfaceSample& s = samples[i];
        const Eigen::Vector3d point = result.pose * s.point.cast<double>();
        const Eigen::Vector3d normal = result.pose.linear() * s.normal.cast<double>();
        if (iteration < 3 || !((point - looked_up_at[i]).squaredNorm() < still * still)) {
          matches[i] = search.Find(point, normal);
          looked_up_at[i] = point;
        }
        const Match& match = matches[i];
        if (match.voxel == nullptr) continue;
        const Eigen::Vector3d gap = point - match.voxel->centroid.cast<double>();
        const double residual = gap.dot(match.normal);
        magnitudes[chunk].push_back(std::abs(residual));
        const double w = Tukey(residual, scale);
        if (w <= 0) continue;
        const double variance = ResidualVariance(s, *match.voxel, gap, residual, surface.roughness,
                                                 config.normal_sigma);
        sum.Add(point - about, match.normal, residual, w / variance);
      }
      partial[chunk] = sum;
    });
    Normals normals;
    std::vector<double> all;
    for (size_t chunk = 0; chunk < chunks; ++chunk) {
      normals += partial[chunk];
      all.insert(all.end(), magnitudes[chunk].begin(), magnitudes[chunk].end());
    }
    if (normals.count < 20) return result;
    const auto middle = all.begin() + static_cast<ptrdiff_t>(all.size() / 2);
    std::nth_element(all.begin(), middle, all.end());
    const double sigma = 1.4826 * std::max(*middle, 0.001);
    scale = std::clamp(4.685 * sigma, 0.2 * h, std::max(0.2 * h, scale));
    prior.AddTo(normals, result.pose, about);
    const Vector6d change = Solve(normals);
    result.pose = Moved(result.pose, change, about);
    result.iterations = iteration + 1;
    if (iteration >= 3 && change.tail<3>().norm() < 5e-5 && change.head<3>().norm() < 2e-5) {
      result.converged = true;
      break;
    }
  }
  return result;
}

// How far apart two poses put the scan's surface: rms over samples, m.
double Apart(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b,
             std::span<const SurfaceSample> samples) {
  double sum = 0;
  for (const SurfaceSample& s : samples) {
    const Eigen::Vector3d p = s.point.cast<double>();
    sum += (a * p - b * p).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(std::max<size_t>(1, samples.size())));
}

// Share of the samples that fit, less the contradictions. Samples here count alike, whatever number
// of the image's samples they stand for: near surface must not decide alone.
double Score(const PlanningView& model, std::span<const SurfaceSample> samples,
             const Eigen::Isometry3d& pose) {
  const VoxelSearch search(model, kFineReach);
  const double scale = model.voxel_size();
  double fit = 0;
  for (const SurfaceSample& s : samples) {
    const Eigen::Vector3d point = pose * s.point.cast<double>();
    const Eigen::Vector3d normal = pose.linear() * s.normal.cast<double>();
    const Match match = search.Find(point, normal);
    if (match.voxel == nullptr) continue;
    fit += Tukey((point - match.voxel->centroid.cast<double>()).dot(match.normal), scale);
  }
  return fit / static_cast<double>(std::max<size_t>(1, samples.size()));
}

}  // namespace

Alignment Align(const PlanningView& model, const ScanSurface& surface, const PosePrior& prior,
                const RegistrationConfig& config, Parallel& parallel) {
  const auto first = [&surface](size_t count) {
    return std::span<const SurfaceSample>(surface.samples.data(),
                                          std::min(count, surface.samples.size()));
  };
  const PriorTerm prior_term(prior);
  const double h = model.voxel_size();

  Eigen::AlignedBox3d box;
  for (const SurfaceSample& s : surface.samples) {
    box.extend(prior.T_world_scan * s.point.cast<double>());
  }
  const double margin = 1.0 + config.max_correspondence;
  box.extend(Eigen::Vector3d(box.min() - Eigen::Vector3d::Constant(margin)));
  box.extend(Eigen::Vector3d(box.max() + Eigen::Vector3d::Constant(margin)));
  const CorrespondenceField field(model, box, config.max_correspondence, parallel);

  const std::vector<Eigen::Isometry3d> starts = Starts(prior);
  std::vector<Minimum> minima(starts.size());
  parallel.For(starts.size(), [&](size_t i) {
    const Eigen::Isometry3d pose = AlignCoarse(field, first(kCoarseSamples), starts[i], prior_term,
                                               config.max_correspondence, h);
    minima[i] = {pose, Score(model, first(kCoarseSamples), pose)};
  });
  const auto better = [](const Minimum& a, const Minimum& b) { return a.score > b.score; };
  std::stable_sort(minima.begin(), minima.end(), better);
  const auto keep_distinct = [&](std::vector<Minimum>& list, double apart) {
    std::vector<Minimum> distinct;
    for (const Minimum& m : list) {
      const bool same = std::any_of(distinct.begin(), distinct.end(), [&](const Minimum& other) {
        return Apart(m.T_world_scan, other.T_world_scan, first(500)) < apart;
      });
      if (!same) distinct.push_back(m);
    }
    list = std::move(distinct);
  };
  keep_distinct(minima, 0.5 * kApart);
  if (minima.size() > kFineMinima) minima.resize(kFineMinima);

  parallel.For(minima.size(), [&](size_t i) {
    Serial serial;
    minima[i].T_world_scan = AlignFine(model, surface, kScoreSamples, minima[i].T_world_scan,
                                       prior_term, config, serial, 12)
                                 .pose;
    minima[i].score = Score(model, first(kScoreSamples), minima[i].T_world_scan);
    const SpaceAgreement space =
        CompareWithSpace(model, first(kCoarseSamples), minima[i].T_world_scan);
    const double met = space.fitting + space.contradicting;
    if (met > 0) minima[i].score *= 1 - space.contradicting / met;
  });
  std::stable_sort(minima.begin(), minima.end(), better);
  keep_distinct(minima, kApart);

  Alignment result;
  const FineResult fine = AlignFine(model, surface, kFineSamples, minima.front().T_world_scan,
                                    prior_term, config, parallel, 30);
  result.T_world_scan = fine.pose;
  result.converged = fine.converged;
  result.iterations = fine.iterations;
  result.score = minima.front().score;
  result.rivals.assign(minima.begin() + 1, minima.end());
  return result;
}

std::vector<Correspondence> FindCorrespondences(const PlanningView& model,
                                                const ScanSurface& surface,
                                                const Eigen::Isometry3d& pose,
                                                const RegistrationConfig& config) {
  std::vector<Correspondence> found;
  const VoxelSearch search(model, kFineReach);
  for (const SurfaceSample& s : surface.samples) {
    const Eigen::Vector3d point = pose * s.point.cast<double>();
    const Eigen::Vector3d normal = pose.linear() * s.normal.cast<double>();
    const Match match = search.Find(point, normal);
    if (match.voxel == nullptr) continue;
    const Eigen::Vector3d gap = point - match.voxel->centroid.cast<double>();
    Correspondence c;
    c.point = point;
    c.normal = match.normal;
    c.residual = gap.dot(match.normal);
    c.variance =
        ResidualVariance(s, *match.voxel, gap, c.residual, surface.roughness, config.normal_sigma);
    c.normal_angle =
        std::acos(std::clamp(normal.dot(match.voxel->normal.cast<double>()), -1.0, 1.0));
    c.cells = s.cells;
    found.push_back(c);
  }
  return found;
}

SpaceAgreement CompareWithSpace(const PlanningView& model, std::span<const SurfaceSample> samples,
                                const Eigen::Isometry3d& T_world_scan) {
  const double h = model.voxel_size();
  const VoxelSearch search(model, kFineReach);
  const Eigen::Vector3d origin = T_world_scan.translation();
  const double behind = 4 * h;  // so far past a surface a sample has gone through it
  SpaceAgreement agreement;
  for (const SurfaceSample& s : samples) {
    const Eigen::Vector3d point = T_world_scan * s.point.cast<double>();
    const Eigen::Vector3d normal = T_world_scan.linear() * s.normal.cast<double>();
    if (search.Find(point, normal).voxel != nullptr) {
      agreement.fitting += s.cells;
      continue;
    }
    const VoxelIndex at = model.At(point);
    bool free = model.Empty(at);
    for (int z = -2; free && z <= 2; ++z) {
      for (int y = -2; free && y <= 2; ++y) {
        for (int x = -2; free && x <= 2; ++x) free = model.Empty(at + VoxelIndex(x, y, z));
      }
    }
    bool contradicts = free;
    const Eigen::Vector3d ray = point - origin;
    const double length = ray.norm();
    const Eigen::Vector3d direction = ray / length;
    VoxelIndex last = VoxelIndex::Constant(INT32_MIN);
    for (double t = 0.3; !contradicts && t < length - behind; t += 0.5 * h) {
      const VoxelIndex v = model.At(origin + t * direction);
      if (v == last) continue;
      last = v;
      if (model.State(v) != VoxelState::kTrueSurface) continue;
      const SurfaceVoxel* voxel = model.Surface(v);
      const Eigen::Vector3d n = voxel->normal.cast<double>();
      if (voxel->samples == 0 || n.dot(direction) > -0.3) continue;
      const Eigen::Vector3d to = voxel->centroid.cast<double>() - origin;
      const double off = (to - to.dot(direction) * direction).norm();
      contradicts = off < 0.4 * h && n.dot(point - voxel->centroid.cast<double>()) < -0.5 * behind;
    }
    if (contradicts) agreement.contradicting += s.cells;
  }
  return agreement;
}

}  // namespace vantage
