// The field of nearest elements against a look at every element of the model.
#include "core/registration/align/correspondence_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::registration {
namespace {

constexpr double kReach = 0.5;  // m
constexpr double kCell = 0.1;   // m, two voxels

// True surface that a scan left, for a look at all of it.
struct Element {
  Eigen::Vector3d centroid;
  Eigen::Vector3d normal;
};
std::vector<Element> ElementsOf(const model::PlanningView& model) {
  std::vector<Element> elements;
  model.ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& voxel) {
        if (state != model::VoxelState::kTrueSurface) return;
        elements.push_back({voxel.centroid.cast<double>(), voxel.normal.cast<double>()});
      });
  return elements;
}

// Of the elements that face within 60 degrees of the axis which is nearest to `normal`.
double NearestOfAll(const std::vector<Element>& elements, const Eigen::Vector3d& point,
                    const Eigen::Vector3d& normal) {
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  int largest = 0;
  normal.cwiseAbs().maxCoeff(&largest);
  axis[largest] = normal[largest] < 0 ? -1 : 1;
  double nearest = std::numeric_limits<double>::infinity();
  for (const Element& element : elements) {
    if (element.normal.dot(axis) < 0.5) continue;
    nearest = std::min(nearest, (element.centroid - point).norm());
  }
  return nearest;
}

// The inside of a sphere of 1.5 m, so that there are all normals.
std::shared_ptr<const model::PlanningView> Sphere() {
  ViewBuilder builder(0.05);
  constexpr double kRadius = 1.5;  // m
  constexpr double kStep = 0.02;   // rad
  for (double e = -sensor::kPi / 2; e < sensor::kPi / 2; e += kStep) {
    for (double a = -sensor::kPi; a < sensor::kPi; a += kStep / std::max(0.02, std::cos(e))) {
      const Eigen::Vector3d out(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
      builder.AddSample(0.9 * kRadius * out, kRadius * out, -out);
    }
  }
  return builder.Build();
}

class CorrespondenceFieldTest : public ::testing::Test {
 protected:
  // Somewhere in the sphere's box, which the model's bricks are a little larger than.
  Eigen::Vector3d Anywhere() {
    std::uniform_real_distribution<double> along(-1.55, 1.55);
    return {along(random_), along(random_), along(random_)};
  }
  Eigen::Vector3d Direction() {
    std::normal_distribution<double> gauss(0, 1);
    return Eigen::Vector3d(gauss(random_), gauss(random_), gauss(random_)).normalized();
  }

  const std::shared_ptr<const model::PlanningView> model_ = Sphere();
  const std::vector<Element> elements_ = ElementsOf(*model_);
  std::mt19937_64 random_{11};
  parallel::Serial serial_;
  const Eigen::AlignedBox3d everywhere_{Eigen::Vector3d::Constant(-9),
                                        Eigen::Vector3d::Constant(9)};
};

TEST_F(CorrespondenceFieldTest, HoldsAllTrueSurfaceInTheBox) {
  EXPECT_EQ(CorrespondenceField(*model_, everywhere_, kReach, serial_).elements(),
            elements_.size());
  const Eigen::AlignedBox3d half(Eigen::Vector3d(0, -9, -9), Eigen::Vector3d(9, 9, 9));
  size_t inside = 0;
  for (const Element& element : elements_) inside += half.contains(element.centroid) ? 1 : 0;
  EXPECT_GT(inside, 300u);
  EXPECT_EQ(CorrespondenceField(*model_, half, kReach, serial_).elements(), inside);
}

// A cell answers for all of its points by what is nearest to its middle: that is at most a cell's
// diagonal farther from the point than the nearest of all, and mostly no farther.
TEST_F(CorrespondenceFieldTest, FindsWhatALookAtAllElementsFinds) {
  const CorrespondenceField field(*model_, everywhere_, kReach, serial_);
  int found = 0;
  int nearest = 0;
  for (int k = 0; k < 3000; ++k) {
    const Eigen::Vector3d point = Anywhere();
    const Eigen::Vector3d normal = Direction();
    const double expected = NearestOfAll(elements_, point, normal);
    const SurfaceElement* element = field.Nearest(point.cast<float>(), normal.cast<float>());
    SCOPED_TRACE(testing::Message() << point.transpose() << ", " << normal.transpose());
    if (element == nullptr) {
      EXPECT_GT(expected, kReach - kCell);
      continue;
    }
    ++found;
    const double distance = (element->centroid.cast<double>() - point).norm();
    EXPECT_GE(distance, expected - 1e-5);
    EXPECT_LE(distance, expected + std::sqrt(3) * kCell);
    EXPECT_LE(distance, kReach + (1 + std::sqrt(3)) * kCell);
    nearest += distance <= expected + 0.02 ? 1 : 0;
  }
  EXPECT_GT(found, 500);
  EXPECT_LT(found, 2500);
  EXPECT_GT(nearest, 4 * found / 5);
}

TEST_F(CorrespondenceFieldTest, FindsNothingThatFacesAway) {
  const CorrespondenceField field(*model_, everywhere_, kReach, serial_);
  const Eigen::Vector3f bottom(0.1F, 0.1F, -1.45F);
  const SurfaceElement* below = field.Nearest(bottom, Eigen::Vector3f::UnitZ());
  ASSERT_NE(below, nullptr);
  EXPECT_GT(below->normal.z(), 0.9F);
  EXPECT_EQ(field.Nearest(bottom, -Eigen::Vector3f::UnitZ()), nullptr);
}

TEST_F(CorrespondenceFieldTest, SameForAnyNumberOfThreads) {
  parallel::ThreadPool pool(3);
  const CorrespondenceField one(*model_, everywhere_, kReach, serial_);
  const CorrespondenceField other(*model_, everywhere_, kReach, pool);
  int found = 0;
  for (int k = 0; k < 2000; ++k) {
    const Eigen::Vector3f point = Anywhere().cast<float>();
    const Eigen::Vector3f normal = Direction().cast<float>();
    const SurfaceElement* a = one.Nearest(point, normal);
    const SurfaceElement* b = other.Nearest(point, normal);
    ASSERT_EQ(a == nullptr, b == nullptr);
    if (a == nullptr) continue;
    ++found;
    EXPECT_EQ(a->centroid, b->centroid);
  }
  EXPECT_GT(found, 200);
}

TEST_F(CorrespondenceFieldTest, FindsNothingOutsideOfItsBox) {
  const Eigen::AlignedBox3d away(Eigen::Vector3d(20, 20, 0), Eigen::Vector3d(21, 21, 1));
  for (const Eigen::AlignedBox3d& box : {away, Eigen::AlignedBox3d()}) {
    const CorrespondenceField field(*model_, box, kReach, serial_);
    EXPECT_EQ(field.elements(), 0u);
    EXPECT_EQ(field.Nearest({0, 0, 0}, Eigen::Vector3f::UnitZ()), nullptr);
    EXPECT_EQ(field.Nearest({20.5F, 20.5F, 0.5F}, Eigen::Vector3f::UnitZ()), nullptr);
  }
}

}  // namespace
}  // namespace vantage::registration
