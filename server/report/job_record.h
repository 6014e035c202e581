// What a report tells of: a job as it was at one moment, in the messages of the contract and the
// view of its model.
#ifndef VANTAGE_SERVER_REPORT_JOB_RECORD_H_
#define VANTAGE_SERVER_REPORT_JOB_RECORD_H_

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/time/time.h"
#include "core/model/view/planning_view.h"
#include "core/planning/plan/planning_config.h"
#include "core/registration/align/instrument_residuals.h"
#include "vantage/v1/event.pb.h"
#include "vantage/v1/fleet.pb.h"
#include "vantage/v1/model_service.pb.h"
#include "vantage/v1/plan.pb.h"
#include "vantage/v1/pose_graph.pb.h"
#include "vantage/v1/scan.pb.h"
#include "vantage/v1/session.pb.h"

namespace vantage::report {

enum class Language { kEnglish, kGerman };

// How it is written.
struct ReportOptions {
  Language language = Language::kEnglish;
  absl::Duration utc_offset;
  double required_coverage = 0.95;  // share of the attainable surface
};

// Events that a person, or the server at a person's request, decided by.
struct DecisionLog {
  std::vector<v1::SessionEvent> events;        // oldest first
  size_t left_out = 0;                         // decisions before those, since they are too many
  bool compacted = false;                      // the log itself has left out some
  std::map<std::string, std::string> callers;  // who took a claim, by its name
};

// A scanner, by its figures, and what its scans have shown of it.
struct InstrumentRecord {
  v1::ScannerModel scanner;
  registration::InstrumentResiduals shown;
};

struct JobRecord {
  v1::Session session;                // with its rejections
  std::vector<v1::Scan> scans;        // by creation
  std::vector<v1::Scanner> scanners;  // the fleet
  std::vector<v1::Station> pending;   // whose scans have not come
  std::vector<InstrumentRecord> instruments;
  v1::GetCoverageResponse coverage;
  v1::PoseGraph graph;
  v1::Plan plan;  // the last that ended well, basic; without a name: there is none
  DecisionLog decisions;
  // Null while no scan is in the model.
  std::shared_ptr<const model::PlanningView> view;
  planning::PlanningConfig config;                   // in the model's frame
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // of that in the world, m
  absl::Time made;
};

// Whether scans were made by the same instrument at the same setting, as far as noise goes.
inline bool SameScanner(const v1::ScannerModel& a, const v1::ScannerModel& b) {
  return a.id() == b.id() && a.range_noise_m() == b.range_noise_m() &&
         a.range_noise_ppm() == b.range_noise_ppm();
}

}  // namespace vantage::report

#endif  // VANTAGE_SERVER_REPORT_JOB_RECORD_H_
