// When a job sees the rooms of a scene and when it goes into them, by the truth.
#ifndef VANTAGE_CLIENT_STUDY_ROOM_WATCH_H_
#define VANTAGE_CLIENT_STUDY_ROOM_WATCH_H_

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "client/simulated_job/site.h"
#include "core/sensor/scanner_model.h"
#include "core/simulation/simulated_scanner.h"
#include "vantage/study_records/v1/study.pb.h"

namespace vantage::study {

// Somebody who stands in a doorway is in neither of its rooms. Knows nothing of scenes without a
// floor plan.
class RoomWatch {
 public:
  // References are kept; `tracer` is of the site's mesh.
  RoomWatch(const simulated_job::Site& site, const simulation::SimulatedScanner& tracer,
            const sensor::ScannerModel& scanner);

  // Lists the rooms in a record, before the first scan.
  void Begin(study_records::v1::JobRecord& record) const;
  // Notes scan `number`, which joined the model and was made at `at` (m, scene frame), in a record
  // that was begun.
  void Note(const Eigen::Vector3d& at, int number, study_records::v1::JobRecord& record) const;

 private:
  bool Inside(const Eigen::Vector3d& at, size_t room) const;
  bool SeesDoorOf(const Eigen::Vector3d& at, size_t room) const;
  bool SeesFloor(const Eigen::Vector3d& at, const simulation::SceneDoorway& doorway) const;

  const simulated_job::Site& site_;
  const simulation::SimulatedScanner& tracer_;
  const sensor::ScannerModel& scanner_;
  std::vector<std::vector<size_t>> doors_;  // of each room, into Site::doorways
};

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_ROOM_WATCH_H_
