// The storeys of a job, and the stations by their numbers, as plans and tables name them.
#ifndef VANTAGE_SERVER_REPORT_STOREYS_H_
#define VANTAGE_SERVER_REPORT_STOREYS_H_

#include <optional>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include "core/model/view/floor_plan.h"
#include "server/report/job_record.h"
#include "server/report/words.h"

namespace vantage::report {

struct ReportStorey {
  int number = 0;
  std::string name;         // as people named it; may be empty
  model::StoreyBand band;   // m, world
  bool floor_known = true;  // else the floor is guessed below the first station
};

// From the lowest up; none while no scan is in the model. The lowest reaches all down, the highest
// all up.
std::vector<ReportStorey> StoreysOf(const JobRecord& job);

// The index of the storey that a scanner at z (m, world) stands in.
size_t StoreyAt(const std::vector<ReportStorey>& storeys, double z);

// 'Storey 1 (attic)'.
std::string StoreyTitle(const ReportStorey& storey, const Words& say);

// A scan as tables and plans know it, by the number that the page gives it, too: by creation. Those
// that were withdrawn have one, and are left out.
struct NumberedScan {
  int number = 0;
  const v1::Scan* scan = nullptr;
};
std::vector<NumberedScan> NumberedScans(const JobRecord& job);
// 0 where there is none of this name.
int NumberOfScan(const std::vector<NumberedScan>& scans, absl::string_view name);
// What people call it: its display name, or its id.
std::string ScanTitle(const v1::Scan& scan);
// Of a scan that may have been withdrawn: 'station 3', or its id.
std::string StationWords(const std::vector<NumberedScan>& scans, absl::string_view name,
                         const Words& say);
// The last part of a resource name.
std::string LastPart(absl::string_view name);

inline bool InModel(const v1::Scan& scan) { return scan.state() == v1::SCAN_STATE_MERGED; }

}  // namespace vantage::report

#endif  // VANTAGE_SERVER_REPORT_STOREYS_H_
