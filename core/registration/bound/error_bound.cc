#include "core/registration/bound/error_bound.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/registration/align/correlation_block.h"
#include "core/registration/align/largest_variance.h"

namespace vantage::registration {
namespace {

constexpr double kChiSquare6At95 = 12.591587;  // quantile of six degrees of freedom
// Half a side that the overlap's box has at least, m: a flat overlap still has a front and a back.
// A voxel of 5 cm to either side; next to any overlap that suffices, which is metres wide, nothing.
constexpr double kMinimumHalfSide = 0.05;
// Normal noise is only known to within a factor of sqrt(2), so information must be twice what the
// noise would feign, plus three standard deviations of that (of a sum of squares).
constexpr double kFeignedFactor = 2.0;
constexpr double kFeignedDeviations = 3.0;
// One constraint that stands for a dozen may be all that seems to hold a direction. Information is
// believed less this many standard deviations of what drawing one in so many does to it: 98 %.
constexpr double kDrawnDeviations = 2.0;

Eigen::Matrix3d Cross(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// One standard deviation of the information along each column of `directions`, from constraints
// that stand for others: a sum over one in w terms, each counted w times, has the variance of its
// terms' squares less one in w of them.
sensor::Vector6d DrawingErrors(std::span<const Constraint> constraints,
                               const Eigen::Vector3d& centroid,
                               const sensor::Matrix6d& directions) {
  sensor::Vector6d variance = sensor::Vector6d::Zero();
  for (const Constraint& c : constraints) {
    if (c.weight <= 1) continue;
    sensor::Vector6d row;
    row << (c.position - centroid).cross(c.normal), c.normal;
    const sensor::Vector6d along = (directions.transpose() * row).cwiseAbs2();
    variance += (1 - 1 / c.weight) * (c.weight / c.variance * along).cwiseAbs2();
  }
  return variance.cwiseSqrt();
}

// Noisy normals tilt the directions without information a little: a slide gets a trace of turning,
// and knowledge of that turn from elsewhere would then seem to stop the slide. Directions that are
// pure slides or turns but for such a trace are made pure. Columns are directions in units of
// displacement.
Eigen::Matrix<double, 6, Eigen::Dynamic> Straighten(
    const Eigen::Matrix<double, 6, Eigen::Dynamic>& open) {
  // Share of a direction, 3 degrees: more than normals noisy to 0.035 rad turn it.
  constexpr double kTrace = 0.05;
  using Directions = Eigen::Matrix<double, 6, Eigen::Dynamic>;
  const auto orthonormal = [](const Directions& m) {
    return Directions(m.householderQr().householderQ() * Eigen::MatrixXd::Identity(6, m.cols()));
  };
  Directions basis = orthonormal(open);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(basis.topRows<3>(), Eigen::ComputeFullV);
  basis = (basis * svd.matrixV()).eval();
  for (int k = 0; k < basis.cols(); ++k) {
    if (basis.col(k).head<3>().norm() < kTrace) basis.col(k).head<3>().setZero();
    if (basis.col(k).tail<3>().norm() < kTrace) basis.col(k).tail<3>().setZero();
  }
  return orthonormal(basis);
}

// What residuals add up to, by block, as a covariance: each by itself, and with those around it, as
// errors are shared across the borders of blocks, too. Nothing where none was observed yet.
std::vector<sensor::Matrix6d> ObservedCovariances(
    std::span<const sensor::Vector6d> by_block,
    const absl::flat_hash_map<uint64_t, size_t>& block_of) {
  sensor::Matrix6d alone = sensor::Matrix6d::Zero();
  for (const sensor::Vector6d& block : by_block) {
    alone.selfadjointView<Eigen::Lower>().rankUpdate(block);
  }
  if (alone.isZero(0)) return {};
  std::vector<uint64_t> keys(by_block.size());
  for (const auto& [key, block] : block_of) keys[block] = key;
  sensor::Matrix6d together = sensor::Matrix6d::Zero();
  double around = 0;
  for (size_t i = 0; i < by_block.size(); ++i) {
    sensor::Vector6d sum = sensor::Vector6d::Zero();
    for (const BlockBeside& beside : BlocksAround(keys[i])) {
      const auto it = block_of.find(beside.block);
      if (it == block_of.end()) continue;
      sum += beside.weight * by_block[it->second];
      around += beside.weight;
    }
    together += by_block[i] * sum.transpose();
  }
  std::vector<sensor::Matrix6d> observed = {alone.selfadjointView<Eigen::Lower>()};
  const double factor = FactorOfSumsAround(static_cast<double>(by_block.size()), around);
  observed.emplace_back(factor * 0.5 * (together + together.transpose()));
  return observed;
}

}  // namespace

OverlapGeometry::OverlapGeometry(std::span<const Constraint> constraints, double normal_sigma,
                                 const RegistrationConfig& config)
    : draws_(config.draws), seed_(config.seed) {
  double total = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Constraint& c : constraints) {
    total += c.weight;
    sum += c.weight * c.position;
    box_.extend(c.position);
  }
  centroid_ = sum / total;
  box_.extend(centroid_ + Eigen::Vector3d::Constant(kMinimumHalfSide));
  box_.extend(centroid_ - Eigen::Vector3d::Constant(kMinimumHalfSide));

  sensor::Matrix6d h = sensor::Matrix6d::Zero();
  double m0 = 0;  // moments of position, weighted by information
  Eigen::Vector3d m1 = Eigen::Vector3d::Zero();
  Eigen::Matrix3d m2 = Eigen::Matrix3d::Zero();
  absl::flat_hash_map<uint64_t, size_t> block_of;
  // What the residuals of a block share, in units of one sigma of what is configured (or 1 mm).
  const double correlated = config.correlated_sigma * config.correlated_sigma;
  const double shared_unit = correlated > 0 ? correlated : 1e-6;
  const auto shared_sigmas = [&](const Constraint& c) {
    return std::sqrt((correlated + c.shared_variance) / shared_unit);
  };
  // Per block: g_b in these units, and the same with the residuals as they are. In order of first
  // appearance, so that sums stay deterministic.
  struct Block {
    sensor::Vector6d expected = sensor::Vector6d::Zero();
    sensor::Vector6d observed = sensor::Vector6d::Zero();
  };
  std::vector<Block> blocks;
  uint64_t last_key = ~uint64_t{0};
  size_t last_block = 0;
  for (const Constraint& c : constraints) {
    if (!(c.weight > 0)) continue;
    const Eigen::Vector3d p = c.position - centroid_;
    const double w = c.weight / c.variance;
    sensor::Vector6d row;
    row << p.cross(c.normal), c.normal;
    h.selfadjointView<Eigen::Lower>().rankUpdate(row, w);
    m0 += w;
    m1 += w * p;
    m2.selfadjointView<Eigen::Lower>().rankUpdate(p, w);
    const uint64_t key = CorrelationBlock(c.position, c.normal, config.correlation_length);
    if (key != last_key) {  // neighbours come one after another
      const auto [it, fresh] = block_of.try_emplace(key, blocks.size());
      if (fresh) blocks.emplace_back();
      last_key = key;
      last_block = it->second;
    }
    blocks[last_block].expected += (w * shared_sigmas(c)) * row;
    blocks[last_block].observed += (w * c.residual) * row;
  }
  h = sensor::Matrix6d(h.selfadjointView<Eigen::Lower>());
  m2 = Eigen::Matrix3d(m2.selfadjointView<Eigen::Lower>());

  // A noisy normal n + d, d of variance s^2 in the tangent plane, adds on average
  // s^2 (F - J^T J) / sigma^2 to the information, F being that of all three axes at the point.
  sensor::Matrix6d full;
  full.topLeftCorner<3, 3>() = Eigen::Matrix3d::Identity() * m2.trace() - m2;
  full.topRightCorner<3, 3>() = Cross(m1);
  full.bottomLeftCorner<3, 3>() = Cross(m1).transpose();
  full.bottomRightCorner<3, 3>() = Eigen::Matrix3d::Identity() * m0;
  sensor::Matrix6d feigned = normal_sigma * normal_sigma * (full - h);
  // Collinear points leave `feigned` singular, so a ridge far below any significant value is added.
  const double extent = box_.diagonal().squaredNorm();
  sensor::Vector6d ridge;
  ridge << Eigen::Vector3d::Constant(extent), Eigen::Vector3d::Ones();
  feigned.diagonal() += 1e-9 * m0 * ridge;

  // In the basis V with V^T feigned V = I and V^T H V = diag(lambda): lambda is how many times more
  // information there is than the noise alone would show.
  const Eigen::GeneralizedSelfAdjointEigenSolver<sensor::Matrix6d> solver(h, feigned);
  const sensor::Matrix6d& v = solver.eigenvectors();
  const sensor::Matrix6d v_inverse = v.transpose() * feigned;
  const double threshold =
      kFeignedFactor +
      kFeignedDeviations * std::sqrt(2.0 / static_cast<double>(std::max<size_t>(1, blocks.size())));
  sensor::Vector6d genuine;
  sensor::Vector6d keep;
  const sensor::Vector6d drawn = DrawingErrors(constraints, centroid_, v);
  for (int k = 0; k < 6; ++k) {
    const double lambda = solver.eigenvalues()[k];
    genuine[k] = lambda - kDrawnDeviations * drawn[k] > threshold ? lambda - 1.0 : 0.0;
    keep[k] = genuine[k] > 0 ? 1.0 : 0.0;
    constrained_ += keep[k] > 0 ? 1 : 0;
  }
  information_ = v_inverse.transpose() * genuine.asDiagonal() * v_inverse;
  sensor::Matrix6d project = v_inverse.transpose() * keep.asDiagonal() * v.transpose();
  if (constrained_ < 6) {
    sensor::Vector6d scale;  // to metres at the overlap's edge
    scale << Eigen::Vector3d::Constant(0.5 * std::sqrt(extent)), Eigen::Vector3d::Ones();
    Eigen::Matrix<double, 6, Eigen::Dynamic> open(6, 6 - constrained_);
    int column = 0;
    for (int k = 0; k < 6; ++k) {
      if (keep[k] == 0) open.col(column++) = scale.asDiagonal() * v.col(k);
    }
    const Eigen::Matrix<double, 6, Eigen::Dynamic> straight = Straighten(open);
    const sensor::Matrix6d rest = sensor::Matrix6d::Identity() - straight * straight.transpose();
    const sensor::Matrix6d drop = scale.asDiagonal() * rest * scale.cwiseInverse().asDiagonal();
    information_ = (drop * information_ * drop.transpose()).eval();
    project = (drop * project).eval();
  }
  std::vector<sensor::Vector6d> shown_by_block;
  shown_by_block.reserve(blocks.size());
  for (const Block& block : blocks) {
    correlated_.selfadjointView<Eigen::Lower>().rankUpdate(
        sensor::Vector6d(project * block.expected), shared_unit);
    shown_by_block.push_back(project * block.observed);
  }
  correlated_ = sensor::Matrix6d(correlated_.selfadjointView<Eigen::Lower>());
  // The residuals as they add up (cluster-robust covariance) hold independent and shared errors as
  // they are. Where they show more than both are configured to, that replaces both.
  for (const sensor::Matrix6d& observed : ObservedCovariances(shown_by_block, block_of)) {
    sensor::Matrix6d configured = information_ + correlated_;
    configured.diagonal() += 1e-9 * m0 * ridge;
    const Eigen::GeneralizedSelfAdjointEigenSolver<sensor::Matrix6d> shown(observed, configured);
    const sensor::Matrix6d back = shown.eigenvectors().transpose() * configured;
    const sensor::Vector6d excess = (shown.eigenvalues().array() - 1.0).max(0.0);
    correlated_ += back.transpose() * excess.asDiagonal() * back;
  }
}

Eigen::Matrix<double, 3, 6> OverlapGeometry::Displacement(const Eigen::Vector3d& point) const {
  Eigen::Matrix<double, 3, 6> g;
  g.leftCols<3>() = -Cross(point - centroid_);
  g.rightCols<3>().setIdentity();
  return g;
}

sensor::Matrix6d OverlapGeometry::Open() const {
  constexpr double kNone = 1e-9;   // of the largest information: rounding
  constexpr double kFirmly = 100;  // times the largest
  sensor::Vector6d scale;          // to metres at the overlap's edge
  scale << Eigen::Vector3d::Constant(0.5 * box_.diagonal().norm()), Eigen::Vector3d::Ones();
  const sensor::Matrix6d in_metres =
      scale.cwiseInverse().asDiagonal() * information_ * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<sensor::Matrix6d> solver(in_metres);
  const double largest = solver.eigenvalues()[5];
  sensor::Matrix6d open = sensor::Matrix6d::Zero();
  for (int k = 0; k < 6; ++k) {
    if (solver.eigenvalues()[k] > kNone * largest) continue;
    const sensor::Vector6d direction = scale.asDiagonal() * solver.eigenvectors().col(k);
    open += kFirmly * largest * direction * direction.transpose();
  }
  return open;
}

ErrorBound OverlapGeometry::Bound(const sensor::Matrix6d& known) const {
  std::array<Eigen::Matrix<double, 3, 6>, 8> corners;
  sensor::Matrix6d mean = sensor::Matrix6d::Zero();
  for (int i = 0; i < 8; ++i) {
    corners[i] = Displacement(box_.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i)));
    mean += corners[i].transpose() * corners[i] / 8.0;
  }
  const sensor::Matrix6d vague = mean / (kUnconstrained * kUnconstrained);
  // In units of corner displacement the six directions are comparable and the solve is well scaled.
  const Eigen::SelfAdjointEigenSolver<sensor::Matrix6d> units(mean);
  const sensor::Matrix6d to_units = units.operatorSqrt();
  const sensor::Matrix6d from_units = units.operatorInverseSqrt();
  const sensor::Matrix6d total = from_units * (information_ + known + vague) * from_units;
  const sensor::Matrix6d inverse =
      from_units * total.ldlt().solve(sensor::Matrix6d::Identity()) * from_units;

  ErrorBound result;
  result.covariance = inverse + inverse * correlated_ * inverse;
  result.covariance = (0.5 * (result.covariance + result.covariance.transpose())).eval();

  const Eigen::SelfAdjointEigenSolver<sensor::Matrix6d> spread(to_units * result.covariance *
                                                               to_units);
  const sensor::Vector6d variances = spread.eigenvalues().cwiseMax(0.0);
  result.strength = variances[5] > 0 ? std::sqrt(variances[0] / variances[5]) : 0.0;
  result.weakest = from_units * spread.eigenvectors().col(5);
  // A sign that does not depend on the solver: the largest component is positive.
  int largest = 0;
  result.weakest.cwiseAbs().maxCoeff(&largest);
  if (result.weakest[largest] < 0) result.weakest = -result.weakest;

  double lambda_max = 0;
  for (const auto& g : corners) {
    const Eigen::Matrix3d c = g * result.covariance * g.transpose();
    lambda_max = std::max(lambda_max, LargestVariance(c));
  }
  result.rigorous = std::sqrt(kChiSquare6At95 * lambda_max);

  const sensor::Matrix6d root =
      from_units * spread.eigenvectors() * variances.cwiseSqrt().asDiagonal();
  std::mt19937_64 generator(seed_);
  std::normal_distribution<double> gauss;
  std::vector<double> largest_moves(static_cast<size_t>(draws_));
  for (double& move : largest_moves) {
    sensor::Vector6d z;
    for (int k = 0; k < 6; ++k) z[k] = gauss(generator);
    const sensor::Vector6d xi = root * z;
    double squared = 0;
    for (const auto& g : corners) squared = std::max(squared, (g * xi).squaredNorm());
    move = std::sqrt(squared);
  }
  const auto rank =
      static_cast<size_t>(std::ceil(0.95 * static_cast<double>(largest_moves.size())) - 1);
  std::nth_element(largest_moves.begin(), largest_moves.begin() + static_cast<ptrdiff_t>(rank),
                   largest_moves.end());
  result.bound = largest_moves[rank];
  return result;
}

sensor::Matrix6d OverlapGeometry::FromPoseCovariance(
    const sensor::Matrix6d& covariance, const Eigen::Vector3d& scanner_position) const {
  sensor::Matrix6d move =
      sensor::Matrix6d::Identity();  // pose change about the centroid -> about the scanner
  move.bottomLeftCorner<3, 3>() = -Cross(scanner_position - centroid_);
  const sensor::Matrix6d information = covariance.ldlt().solve(sensor::Matrix6d::Identity());
  return move.transpose() * information * move;
}

sensor::Matrix6d OverlapGeometry::FromTargets(std::span<const TargetTie> targets) const {
  sensor::Matrix6d information = sensor::Matrix6d::Zero();
  for (const TargetTie& target : targets) {
    const Eigen::Matrix<double, 3, 6> moves = Displacement(target.in_world);
    information += moves.transpose() * moves / (target.sigma * target.sigma);
  }
  return information;
}

sensor::Matrix6d LevelInformation(double sigma) {
  sensor::Matrix6d information = sensor::Matrix6d::Zero();
  information(0, 0) = information(1, 1) = 1.0 / (sigma * sigma);
  return information;
}

}  // namespace vantage::registration
