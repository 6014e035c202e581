// A study as one HTML page that needs nothing else.
#ifndef VANTAGE_CLIENT_STUDY_PAGE_H_
#define VANTAGE_CLIENT_STUDY_PAGE_H_

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "client/simulated_job/site.h"
#include "vantage/study_records/v1/study.pb.h"

namespace vantage::study {

using PlanSegments = std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>>;  // m

// Where a horizontal plane at `height` (m, scene frame) cuts the mesh.
PlanSegments CutMesh(const simulation::TriangleMesh& mesh, double height);

// A scene seen from above.
struct FloorPlanDrawing {
  std::string scene;
  PlanSegments walls;      // cut high
  PlanSegments furniture;  // cut low
  int most_scans = 0;      // that a job in it may take
};
FloorPlanDrawing DrawFloorPlan(const simulated_job::Site& site, int most_scans);

std::string StudyPage(const study_records::v1::Table& table,
                      const std::vector<study_records::v1::JobRecord>& records,
                      const std::vector<FloorPlanDrawing>& scenes, double goal);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_PAGE_H_
