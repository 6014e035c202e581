#include "server/session/lost_scans.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "server/contract/error.h"

namespace vantage::session {
namespace {

constexpr size_t kMaxNamed = 100;

// The numbers of names rise with their length first: scan-9 comes before scan-10.
bool NumberedBefore(const std::string& a, const std::string& b) {
  return a.size() != b.size() ? a.size() < b.size() : a < b;
}

}  // namespace

void LostScans::Note(const std::string& scan, const absl::Status& read) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (read.ok()) why_.erase(scan);
  if (absl::IsDataLoss(read)) why_[scan] = std::string(read.message());
}

bool LostScans::Has(const std::string& scan) const {
  std::lock_guard<std::mutex> lock(mutex_);
  return why_.count(scan) != 0;
}

void LostScans::Describe(v1::Scan& scan) const {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto lost = why_.find(scan.name());
  if (lost == why_.end() || scan.state() == v1::SCAN_STATE_WITHDRAWN) return;
  scan.set_data_lost(true);
  if (scan.state_message().empty()) scan.set_state_message(lost->second);
}

void LostScans::Describe(v1::Session& session) const {
  std::vector<std::string> names;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [name, why] : why_) names.push_back(name);
  }
  std::sort(names.begin(), names.end(), NumberedBefore);
  names.resize(std::min(names.size(), kMaxNamed));
  for (std::string& name : names) session.add_lost_scans(std::move(name));
}

absl::Status ModelLacks(const std::string& session, const std::vector<std::string>& scans) {
  std::vector<std::string> named(
      scans.begin(),
      scans.begin() + static_cast<std::ptrdiff_t>(std::min(scans.size(), kMaxNamed)));
  return contract::ErrorWithReason(
      absl::StatusCode::kDataLoss, "DATA_LOST",
      absl::StrCat("the model of ", session, " cannot be made: the data of ",
                   absl::StrJoin(named, ", "), scans.size() > named.size() ? " and others" : "",
                   " are lost; have its operator restore them "
                   "from a backup, or withdraw the scans (WithdrawScan) and go on without"),
      {{"scans", absl::StrJoin(named, ",")}});
}

}  // namespace vantage::session
