#include "client/study/room_watch.h"

#include <algorithm>
#include <cmath>

namespace vantage::study {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kIntoRoom = 0.35;   // m from the middle of a doorway: past half of any wall
constexpr double kOverFloor = 0.02;  // m, of the points of a doorway's floor that are looked for
constexpr double kShares[] = {-0.25, 0, 0.25};  // of a doorway's width, where these points lie

}  // namespace

RoomWatch::RoomWatch(const simulated_job::Site& site, const simulation::SimulatedScanner& tracer,
                     const sensor::ScannerModel& scanner)
    : site_(site), tracer_(tracer), scanner_(scanner), doors_(site.rooms.size()) {
  for (size_t d = 0; d < site.doorways.size(); ++d) {
    const simulation::SceneDoorway& doorway = site.doorways[d];
    const Vector2d across(-doorway.along.y(), doorway.along.x());
    for (size_t i = 0; i < site.rooms.size(); ++i) {
      const Eigen::AlignedBox2d& inside = site.rooms[i].inside;
      if (inside.contains(Vector2d(doorway.middle + kIntoRoom * across)) ||
          inside.contains(Vector2d(doorway.middle - kIntoRoom * across))) {
        doors_[i].push_back(d);
      }
    }
  }
}

void RoomWatch::Begin(study_records::v1::JobRecord& record) const {
  for (const simulation::Room& room : site_.rooms) record.add_rooms()->set_name(room.name);
}

void RoomWatch::Note(const Vector3d& at, int number, study_records::v1::JobRecord& record) const {
  for (size_t i = 0; i < site_.rooms.size(); ++i) {
    study_records::v1::RoomRecord& room = *record.mutable_rooms(static_cast<int>(i));
    if (!room.has_entered() && Inside(at, i)) room.set_entered(number);
    // Nobody waited for what is first seen from inside.
    if (!room.has_seen() && !room.has_entered() && SeesDoorOf(at, i)) room.set_seen(number);
  }
}

bool RoomWatch::Inside(const Vector3d& at, size_t room) const {
  return site_.rooms[room].inside.contains(Vector2d(at.head<2>()));
}

bool RoomWatch::SeesDoorOf(const Vector3d& at, size_t room) const {
  return std::any_of(doors_[room].begin(), doors_[room].end(),
                     [&](size_t door) { return SeesFloor(at, site_.doorways[door]); });
}

bool RoomWatch::SeesFloor(const Vector3d& at, const simulation::SceneDoorway& doorway) const {
  return std::any_of(std::begin(kShares), std::end(kShares), [&](double share) {
    Vector3d point;
    point.head<2>() = doorway.middle + share * doorway.width * doorway.along;
    point.z() = site_.floor_height + kOverFloor;
    const Vector3d ray = point - at;
    const double elevation = std::atan2(ray.z(), ray.head<2>().norm());
    return ray.norm() <= scanner_.range_max && elevation >= scanner_.elevation_min &&
           tracer_.Visible(at, point);
  });
}

}  // namespace vantage::study
