#include "server/report/storeys.h"

#include <limits>

#include "absl/strings/str_cat.h"

namespace vantage::report {
namespace {

// A tripod's height over the floor, m, where no level floor is known.
constexpr double kTripod = 1.5;
// A scanner lower than this over a floor stands on the one below, m.
constexpr double kLeastOverFloor = 0.3;

}  // namespace

std::vector<ReportStorey> StoreysOf(const JobRecord& job) {
  std::vector<ReportStorey> storeys;
  if (job.view == nullptr) return storeys;
  for (const v1::Storey& storey : job.coverage.storeys()) {
    if (!storey.has_floor_z_m()) continue;
    storeys.push_back({storey.number(), storey.name(), {storey.floor_z_m(), 0}, true});
  }
  if (storeys.empty()) {
    double z = job.origin.z();
    for (const v1::Scan& scan : job.scans) {
      if (!InModel(scan)) continue;
      z = scan.pose().translation().z();
      break;
    }
    storeys.push_back({0, "", {z - kTripod, 0}, false});
  }
  for (size_t i = 0; i < storeys.size(); ++i) {
    storeys[i].band.top = i + 1 < storeys.size() ? storeys[i + 1].band.floor
                                                 : std::numeric_limits<double>::infinity();
  }
  return storeys;
}

size_t StoreyAt(const std::vector<ReportStorey>& storeys, double z) {
  size_t at = 0;
  while (at + 1 < storeys.size() && z >= storeys[at + 1].band.floor + kLeastOverFloor) ++at;
  return at;
}

std::string StoreyTitle(const ReportStorey& storey, const Words& say) {
  return storey.name.empty() ? say(Text::kStorey, storey.number)
                             : say(Text::kStoreyNamed, storey.number, storey.name);
}

std::vector<NumberedScan> NumberedScans(const JobRecord& job) {
  std::vector<NumberedScan> scans;
  for (size_t i = 0; i < job.scans.size(); ++i) {
    if (job.scans[i].state() == v1::SCAN_STATE_WITHDRAWN) continue;
    scans.push_back({static_cast<int>(i) + 1, &job.scans[i]});
  }
  return scans;
}

int NumberOfScan(const std::vector<NumberedScan>& scans, absl::string_view name) {
  for (const NumberedScan& scan : scans) {
    if (scan.scan->name() == name) return scan.number;
  }
  return 0;
}

std::string LastPart(absl::string_view name) {
  const size_t slash = name.rfind('/');
  return std::string(slash == absl::string_view::npos ? name : name.substr(slash + 1));
}

std::string ScanTitle(const v1::Scan& scan) {
  return scan.display_name().empty() ? LastPart(scan.name()) : scan.display_name();
}

std::string StationWords(const std::vector<NumberedScan>& scans, absl::string_view name,
                         const Words& say) {
  const int number = NumberOfScan(scans, name);
  return number > 0 ? say(Text::kStation, number) : LastPart(name);
}

}  // namespace vantage::report
