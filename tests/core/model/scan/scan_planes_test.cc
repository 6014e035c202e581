// The planes of a room, where they are by construction, at three scanners.
#include "core/model/scan/scan_planes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/support/three_scanners.h"

namespace vantage::model {
namespace {

constexpr double kDiscontinuity = 0.14;  // rad
const Eigen::Vector3d kRoom(5.2, 4.4, 2.5);
const Eigen::Vector3d kAt(2.1, 1.9, 1.4);

// One of the six sides of the room, and what a scan without noise sees of it.
struct Side {
  int axis = 0;
  bool high = false;
  double area = 0;                      // m^2
  std::vector<Eigen::Vector3d> points;  // m, world

  Eigen::Vector3d normal() const { return (high ? -1.0 : 1.0) * Eigen::Vector3d::Unit(axis); }
  double Off(const Eigen::Vector3d& point) const {
    return std::abs(point[axis] - (high ? kRoom[axis] : 0.0));
  }
};

class ScanPlanesTest : public testing::TestWithParam<test_support::ScannerCase> {
 protected:
  ScanPlanesTest()
      : scanner_(test_support::Sector(GetParam(), sensor::Radians(130), sensor::Radians(60))) {
    pose_.translate(kAt);
    pose_.rotate(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()));
    const simulation::SimulatedScanner room(simulation::BoxRoom(kRoom).mesh);
    truth_ = room.Scan(scanner_, pose_, simulation::ScanFaults::None(), 5, serial_);
    simulation::ScanFaults noise = simulation::ScanFaults::None();
    noise.range_noise = true;
    image_ = room.Scan(scanner_, pose_, noise, 5, serial_);
    for (int axis = 0; axis < 3; ++axis) {
      for (const bool high : {false, true}) sides_.push_back({axis, high, 0, {}});
    }
    for (int c = 0; c < truth_.columns(); ++c) {
      for (int r = 0; r < truth_.rows(); ++r) {
        const double range = static_cast<double>(truth_.at(c, r));
        const Eigen::Vector3d ray = pose_.linear() * truth_.Direction(c, r);
        const Eigen::Vector3d point = kAt + range * ray;
        for (Side& side : sides_) {
          if (side.Off(point) > 1e-4) continue;
          const double steradian = scanner_.azimuth_step * scanner_.elevation_step *
                                   std::cos(truth_.elevation[static_cast<size_t>(r)]);
          side.area += steradian * range * range / -side.normal().dot(ray);
          side.points.push_back(point);
        }
      }
    }
  }

  RangeSurface Surface() { return {image_, scanner_, kDiscontinuity, serial_}; }

  parallel::Serial serial_;
  sensor::ScannerModel scanner_;
  Eigen::Isometry3d pose_ = Eigen::Isometry3d::Identity();
  sensor::RangeImage truth_;
  sensor::RangeImage image_;
  std::vector<Side> sides_;
};

// Each side once, whole, and as near as noise and the number of cells allow.
TEST_P(ScanPlanesTest, EachSideOfARoomIsOnePlane) {
  const std::vector<ScanPlane> planes = FindScanPlanes(Surface(), 16, serial_);
  size_t large = 0;
  for (const Side& side : sides_) {
    if (side.area < 1) continue;
    ++large;
    size_t found = 0;
    for (const ScanPlane& plane : planes) {
      const Eigen::Vector3d normal = pose_.linear() * plane.normal;
      if (normal.dot(side.normal()) < 0.9) continue;
      ++found;
      // Less its rim, where cells have no normal.
      EXPECT_LE(plane.area, 1.1 * side.area);
      EXPECT_GE(plane.area, 0.5 * side.area);
      double squared = 0;
      for (const Eigen::Vector3d& point : side.points) {
        const double off = normal.dot(point - kAt) + plane.distance;
        squared += off * off;
      }
      // Three parameters of a plane, each held by all its cells; five sigma.
      const double cells = static_cast<double>(plane.cells.size());
      constexpr double kRounding = 2e-5;  // m: cells are kept in single precision
      EXPECT_LE(std::sqrt(squared / static_cast<double>(side.points.size())),
                5 * GetParam().noise * std::sqrt(3 / cells) + kRounding);
    }
    EXPECT_EQ(found, 1u) << "axis " << side.axis << (side.high ? ", high" : ", low");
  }
  ASSERT_GE(large, 4u);
  EXPECT_EQ(planes.size(), large);
}

// Away from the room's edges nearly every cell has a normal, and it is the side's. At an edge there
// is none that belongs to neither side.
TEST_P(ScanPlanesTest, NormalsAreThoseOfTheSideAndStopAtItsEdges) {
  constexpr double kBaseline = 0.12;  // m, on either side of a cell
  const RangeSurface surface = Surface();
  size_t inside = 0;
  size_t flat = 0;
  size_t wrong = 0;
  size_t askew = 0;
  const int stride = std::max(1, surface.columns() / 200);
  for (int c = 0; c < surface.columns(); c += stride) {
    for (int r = 0; r < surface.rows(); r += stride) {
      const Eigen::Vector3d direction = pose_.linear() * surface.Direction(c, r);
      const double range = static_cast<double>(truth_.at(c, r));
      const Eigen::Vector3d point = kAt + range * direction;
      const Side* side = nullptr;
      double edge = 10;  // m, to the nearest other side
      for (const Side& s : sides_) {
        if (s.Off(point) < 1e-4) {
          side = &s;
        } else {
          edge = std::min(edge, s.Off(point));
        }
      }
      const double cosine = -side->normal().dot(direction);
      const double apart = std::max(kBaseline, range * GetParam().step);
      // Half-way to the border of the image there is nothing to look at either.
      const bool bordered = c < surface.columns() / 8 || c > surface.columns() * 7 / 8 ||
                            r < surface.rows() / 8 || r > surface.rows() * 7 / 8;
      if (bordered || cosine < 0.35) continue;
      const Eigen::Vector3d normal = pose_.linear() * NormalAround(surface, c, r);
      // Neighbours lie along the image, and a side seen at an angle has them farther apart.
      if (edge < 1.5 * apart / cosine) {
        if (edge < 0.5 * kBaseline && !normal.isZero()) askew += normal.dot(side->normal()) < 0.8;
        continue;
      }
      ++inside;
      if (normal.isZero()) continue;
      ++flat;
      // Two ends of a baseline on either side, at four sigma, both ways.
      const double angle = std::acos(std::min(1.0, normal.dot(side->normal())));
      wrong += angle > 4 * GetParam().noise / apart + sensor::Radians(0.2) ? 1 : 0;
    }
  }
  ASSERT_GT(inside, 1000u);
  EXPECT_GE(flat, inside * 97 / 100);
  EXPECT_LE(wrong, inside / 200);
  EXPECT_LE(askew, inside / 1000);
}

INSTANTIATE_TEST_SUITE_P(ThreeScanners, ScanPlanesTest,
                         testing::ValuesIn(test_support::kThreeScanners));

}  // namespace
}  // namespace vantage::model
