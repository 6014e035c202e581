// Directions that too little holds, on planes whose counts are known.
#include "core/registration/graph/lone_holds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace vantage::registration {
namespace {

using Eigen::Vector3d;

// A square grid of `count` patches of 20 cm around `middle`, facing along `normal` (unit).
void AddPlane(const Vector3d& middle, const Vector3d& normal, int count,
              std::vector<Constraint>& constraints) {
  const Vector3d u = normal.unitOrthogonal();
  const Vector3d v = normal.cross(u);
  const int side = static_cast<int>(std::ceil(std::sqrt(count)));
  for (int i = 0; i < count; ++i) {
    const int column = i % side - side / 2;
    const int row = i / side - side / 2;
    const Vector3d at = middle + 0.2 * column * u + 0.2 * row * v;
    constraints.push_back({at, normal, 1e-6, 1.0, 0.0});
  }
}

std::vector<Constraint> Corridor() {
  std::vector<Constraint> constraints;
  AddPlane({0, 0, 0}, Vector3d::UnitZ(), 300, constraints);
  AddPlane({0, 1, 1}, -Vector3d::UnitY(), 200, constraints);
  AddPlane({0, -1, 1}, Vector3d::UnitY(), 200, constraints);
  return constraints;
}

size_t Kept(const std::vector<Constraint>& constraints) {
  size_t kept = 0;
  for (const Constraint& c : constraints) kept += c.weight > 0 ? 1 : 0;
  return kept;
}

TEST(LoneHolds, OfACorridorAreTheFewThatFaceAlongIt) {
  std::vector<Constraint> constraints = Corridor();
  const size_t walls = constraints.size();
  AddPlane({3, 0.5, 1}, -Vector3d::UnitX(), 13, constraints);
  EXPECT_EQ(ReleaseLoneHolds(constraints, 40), 13u);
  for (size_t i = 0; i < constraints.size(); ++i) {
    EXPECT_EQ(constraints[i].weight, i < walls ? 1 : 0) << i;
  }
  EXPECT_EQ(ReleaseLoneHolds(constraints, 40), 0u);
}

TEST(LoneHolds, EnoughSurfaceHolds) {
  std::vector<Constraint> constraints = Corridor();
  AddPlane({3, 0.5, 1}, -Vector3d::UnitX(), 45, constraints);
  EXPECT_EQ(ReleaseLoneHolds(constraints, 40), 0u);
  EXPECT_EQ(Kept(constraints), constraints.size());
}

// In several places as well as in one.
TEST(LoneHolds, FewInManyPlacesHold) {
  std::vector<Constraint> constraints = Corridor();
  for (int i = 0; i < 5; ++i) AddPlane({i - 2.0, 0.8, 1}, -Vector3d::UnitX(), 9, constraints);
  EXPECT_EQ(ReleaseLoneHolds(constraints, 40), 0u);
}

// Walls that are nearly parallel hold a slide along them by their number.
TEST(LoneHolds, ATaperedCorridorHoldsByAllItHas) {
  std::vector<Constraint> constraints;
  AddPlane({0, 0, 0}, Vector3d::UnitZ(), 300, constraints);
  AddPlane({0, 1, 1}, Vector3d(0.3, -1, 0).normalized(), 400, constraints);
  AddPlane({0, -1, 1}, Vector3d(0.3, 1, 0).normalized(), 400, constraints);
  AddPlane({3, 0.5, 1}, -Vector3d::UnitX(), 13, constraints);
  EXPECT_EQ(ReleaseLoneHolds(constraints, 40), 0u);
}

TEST(LoneHolds, NothingIsNoHold) {
  std::vector<Constraint> none;
  EXPECT_EQ(ReleaseLoneHolds(none, 40), 0u);
  std::vector<Constraint> one = {{Vector3d::Zero(), Vector3d::UnitX(), 1e-6, 1.0, 0.0}};
  EXPECT_EQ(ReleaseLoneHolds(one, 40), 0u);
}

}  // namespace
}  // namespace vantage::registration
