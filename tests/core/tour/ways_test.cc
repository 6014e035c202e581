// Ways to places whose floor nobody has seen, past walls that are known.
#include "core/tour/ways.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/tour/ordering.h"
#include "tests/support/closed_form_view.h"

namespace vantage::tour {
namespace {

using Eigen::Vector3d;

// Two rooms of 3 x 4 m with a wall between them that has a doorway, or none. Of the second nothing
// is known below 0.4 m.
class TwoRooms {
 public:
  explicit TwoRooms(bool doorway, bool wall_known = true) {
    test_support::ClosedFormScene scene;
    scene.extent = Eigen::AlignedBox3d(Vector3d(-0.1, -0.1, -0.1), Vector3d(6.2, 4.1, 2.8));
    scene.solid = [doorway](const Vector3d& p) {
      const bool inside =
          p.x() > 0 && p.x() < 6.1 && p.y() > 0 && p.y() < 4 && p.z() > 0 && p.z() < 2.7;
      const bool way = doorway && p.y() > 3 && p.z() < 2;
      return !inside || (p.x() > 3 && p.x() < 3.1 && !way);
    };
    scene.known = [wall_known](const Vector3d& p) {
      if (!wall_known && p.x() > 2.8 && p.x() < 3.3) return false;
      return p.x() < 3.05 || p.z() > 0.4;
    };
    scene.stations = {test_support::MakeStation({1.0, 0.8, 1.5})};
    view_ = std::make_unique<model::PlanningView>(test_support::BuildView(scene));
    problem_ = planning::PlanningProblem::Prepare({*view_, scanner_, config_}, serial_).value();
  }
  double Length(const Vector3d& from, const Vector3d& to) {
    Ways ways(*problem_);
    const double length = ways.Between({&from, 1}, {&to, 1}, {}, serial_)[0][0];
    const std::vector<Vector3d> way = ways.Way(from, to);
    along_ = 0;
    for (size_t i = 1; i < way.size(); ++i) along_ += (way[i] - way[i - 1]).head<2>().norm();
    return length;
  }
  // m, of the way that Length() was asked for, by its corners.
  double along() const { return along_; }

 private:
  parallel::Serial serial_;
  sensor::ScannerModel scanner_;
  planning::PlanningConfig config_;
  std::unique_ptr<model::PlanningView> view_;
  std::shared_ptr<const planning::PlanningProblem> problem_;
  double along_ = 0;
};

const Vector3d kHere(2.4, 0.8, 1.5);
const Vector3d kNextDoor(3.8, 0.8, 1.5);
constexpr double kApart = 1.4;  // m, through the wall

TEST(WaysTest, LeadThroughAKnownDoorwayToFloorThatWasNotSeen) {
  TwoRooms rooms(true);
  // By the doorway's post, at half a footprint from it.
  const double rope = 2 * Vector3d(0.65, 2.2, 0).norm();
  const double length = rooms.Length(kHere, kNextDoor);
  EXPECT_GT(length, rope);
  EXPECT_LT(length, rope + 1.5);
  EXPECT_NEAR(rooms.along(), length, 0.3);
  // Nothing is in the way there, but nobody knows what else is.
  EXPECT_NEAR(rooms.Length({2.0, 3.5, 1.5}, {4.0, 3.5, 1.5}), 3, 0.2);
}

TEST(WaysTest, OverFloorThatWasSeenTheyAreAsTheyAre) {
  TwoRooms rooms(true);
  EXPECT_NEAR(rooms.Length({1.0, 0.8, 1.5}, {1.0, 2.8, 1.5}), 2, 0.2);
}

TEST(WaysTest, WhereNoneIsKnownHalfAsMuchAgainAsTheStraightLine) {
  EXPECT_NEAR(TwoRooms(false).Length(kHere, kNextDoor), 1.5 * kApart, 1e-9);
  EXPECT_NEAR(TwoRooms(true, false).Length(kHere, kNextDoor), 1.5 * kApart, 0.2);
}

}  // namespace
}  // namespace vantage::tour
