#include "tests/support/graph_scenes.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "absl/strings/str_format.h"
#include "core/simulation/random_sequence.h"

namespace vantage::test_support {
namespace {

using registration::PoseGraph;
using registration::ScanLink;
using registration::ScanNode;
using sensor::Matrix6d;
using sensor::Vector6d;

constexpr double kTilt = 0.017;  // rad, a degree

class Gauss {
 public:
  explicit Gauss(uint64_t seed) : seed_(seed) {}
  double operator()() { return simulation::RandomNormal(seed_, next_++, 0); }
  Vector6d Six() {
    Vector6d six;
    for (int k = 0; k < 6; ++k) six[k] = (*this)();
    return six;
  }

 private:
  uint64_t seed_;
  uint64_t next_ = 0;
};

// A place along a rectangle's sides, m from its first corner.
Eigen::Vector3d AlongRectangle(double length, double width, double at) {
  if (at < length) return {at, 0, 0};
  if (at < length + width) return {length, at - length, 0};
  if (at < 2 * length + width) return {2 * length + width - at, width, 0};
  return {0, 2 * (length + width) - at, 0};
}

GraphScene Ring(double length, double width, size_t scans, size_t reach, uint64_t seed) {
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 91);
  GraphScene scene;
  const double step = 2 * (length + width) / static_cast<double>(scans);
  for (size_t i = 0; i < scans; ++i) {
    const Eigen::Vector3d place =
        AlongRectangle(length, width, step * static_cast<double>(i)) +
        Eigen::Vector3d(random.Between(-0.3, 0.3), random.Between(-0.3, 0.3), 1.5);
    scene.truth.push_back(RandomUpright(place, random.Bits()));
    for (size_t next = 1; next <= reach; ++next) {
      const size_t j = (i + next) % scans;
      scene.overlaps.emplace_back(std::min(i, j), std::max(i, j));
    }
  }
  std::sort(scene.overlaps.begin(), scene.overlaps.end());
  scene.overlaps.erase(std::unique(scene.overlaps.begin(), scene.overlaps.end()),
                       scene.overlaps.end());
  return scene;
}

Matrix6d RandomCovariance(const LinkNoise& noise, uint64_t seed) {
  Gauss gauss(seed);
  simulation::RandomSequence random(seed ^ 17);
  Matrix6d mixed;
  for (int k = 0; k < 6; ++k) mixed.col(k) = gauss.Six();
  const Matrix6d axes = mixed.householderQr().householderQ();
  Vector6d scale;
  scale << Eigen::Vector3d::Constant(noise.turn_sigma),
      Eigen::Vector3d::Constant(noise.position_sigma);
  Vector6d spread;
  for (int k = 0; k < 6; ++k) spread[k] = std::pow(random.Between(1, 4), 2);
  const Matrix6d unit = axes * spread.asDiagonal() * axes.transpose();
  const Matrix6d covariance = scale.asDiagonal() * unit * scale.asDiagonal();
  return 0.5 * (covariance + covariance.transpose());
}

Eigen::Isometry3d Moved(const Eigen::Isometry3d& pose, const Vector6d& change) {
  Eigen::Isometry3d moved = pose;
  const double angle = change.head<3>().norm();
  if (angle > 0) {
    moved.linear() =
        Eigen::AngleAxisd(angle, change.head<3>() / angle).toRotationMatrix() * pose.linear();
  }
  moved.translation() += change.tail<3>();
  return moved;
}

}  // namespace

std::string ScanName(size_t index) { return absl::StrFormat("scan-%04d", index); }

Eigen::Isometry3d RandomUpright(const Eigen::Vector3d& place, uint64_t seed) {
  simulation::RandomSequence random(seed);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(place);
  pose.rotate(Eigen::AngleAxisd(random.Between(-3.1, 3.1), Eigen::Vector3d::UnitZ()));
  pose.rotate(Eigen::AngleAxisd(random.Between(-kTilt, kTilt), Eigen::Vector3d::UnitX()));
  pose.rotate(Eigen::AngleAxisd(random.Between(-kTilt, kTilt), Eigen::Vector3d::UnitY()));
  return pose;
}

GraphScene RingCorridorGraph(size_t scans, size_t reach, uint64_t seed) {
  return Ring(60, 40, scans, reach, seed);
}
GraphScene StreetGraph(size_t scans, uint64_t seed) { return Ring(70, 50, scans, 2, seed); }

GraphScene ThreeStoreysGraph(size_t per_storey, uint64_t seed) {
  constexpr double kHeight = 3.1;  // m, from floor to floor
  constexpr double kNear = 5.0;    // m
  simulation::RandomSequence random(simulation::MixBits(seed) ^ 92);
  GraphScene scene;
  std::vector<size_t> first;
  for (size_t storey = 0; storey < 3; ++storey) {
    if (storey > 0) {
      const size_t landing = scene.truth.size();
      scene.truth.push_back(RandomUpright(
          {-1.5, 0, kHeight * (static_cast<double>(storey) - 0.5) + 1.5}, random.Bits()));
      scene.overlaps.emplace_back(first.back(), landing);
      scene.overlaps.emplace_back(landing, landing + 1);
    }
    const size_t begin = scene.truth.size();
    first.push_back(begin);
    for (size_t i = 0; i < per_storey; ++i) {
      const size_t pair = i / 2;
      const auto column = static_cast<double>(pair);
      const auto row = static_cast<double>(i % 2);
      scene.truth.push_back(RandomUpright(
          {3.5 * column + random.Between(-0.3, 0.3), 3.5 * row + random.Between(-0.3, 0.3),
           kHeight * static_cast<double>(storey) + 1.5},
          random.Bits()));
      for (size_t j = begin; j + 1 < scene.truth.size(); ++j) {
        const double apart =
            (scene.truth[j].translation() - scene.truth.back().translation()).norm();
        if (apart < kNear) scene.overlaps.emplace_back(j, scene.truth.size() - 1);
      }
    }
  }
  std::sort(scene.overlaps.begin(), scene.overlaps.end());
  return scene;
}

std::vector<ScanNode> NodesOf(const GraphScene& scene) {
  std::vector<ScanNode> nodes(scene.truth.size());
  for (size_t i = 0; i < nodes.size(); ++i) {
    nodes[i].id = ScanName(i);
    nodes[i].T_world_scan = scene.truth[i];
    nodes[i].fixed = i == 0;
  }
  return nodes;
}

std::vector<ScanLink> LinksOf(const GraphScene& scene, const LinkNoise& noise, uint64_t seed) {
  std::vector<ScanLink> links;
  for (size_t l = 0; l < scene.overlaps.size(); ++l) {
    const auto [a, b] = scene.overlaps[l];
    const uint64_t own = simulation::RandomBits(seed, l, 1);
    const Matrix6d covariance = RandomCovariance(noise, own);
    ScanLink link;
    link.a = ScanName(a);
    link.b = ScanName(b);
    link.origin = noise.origin;
    link.T_a_b = scene.truth[a].inverse(Eigen::Isometry) * scene.truth[b];
    if (noise.drawn) {
      const Eigen::LLT<Matrix6d> root(covariance);
      link.T_a_b = Moved(link.T_a_b, root.matrixL() * Gauss(own ^ 5).Six());
    }
    const Vector6d scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
    const Matrix6d unit = scale.asDiagonal() * covariance * scale.asDiagonal();
    const Matrix6d information = scale.asDiagonal() * unit.inverse() * scale.asDiagonal();
    link.information = 0.5 * (information + information.transpose());
    links.push_back(std::move(link));
  }
  return links;
}

PoseGraph NoisyGraph(const GraphScene& scene, const LinkNoise& noise, uint64_t seed) {
  std::vector<ScanNode> nodes = NodesOf(scene);
  std::vector<ScanLink> links = LinksOf(scene, noise, seed);
  for (size_t l = 0; l < links.size(); ++l) {
    const auto [a, b] = scene.overlaps[l];
    if (b == a + 1) nodes[b].T_world_scan = nodes[a].T_world_scan * links[l].T_a_b;
  }
  return PoseGraph::Create(std::move(nodes), std::move(links)).value();
}

Vector6d PoseError(const Eigen::Isometry3d& truth, const Eigen::Isometry3d& pose) {
  const Eigen::AngleAxisd turn(pose.linear() * truth.linear().transpose());
  Vector6d error;
  error << turn.angle() * turn.axis(), pose.translation() - truth.translation();
  return error;
}

}  // namespace vantage::test_support
