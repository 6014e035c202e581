// Which of a session's scans have lost their range images, as far as is known.
#ifndef VANTAGE_SERVER_SESSION_LOST_SCANS_H_
#define VANTAGE_SERVER_SESSION_LOST_SCANS_H_

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "vantage/v1/scan.pb.h"
#include "vantage/v1/session.pb.h"

namespace vantage::session {

// Thread safe.
class LostScans {
 public:
  // What reading a scan's data came to: DATA_LOSS marks it as lost, OK takes that back, and
  // anything else says nothing.
  void Note(const std::string& scan, const absl::Status& read);
  bool Has(const std::string& scan) const;
  // Says it in a scan that a client gets, and in a session.
  void Describe(v1::Scan& scan) const;
  void Describe(v1::Session& session) const;

 private:
  mutable std::mutex mutex_;
  std::map<std::string, std::string> why_ ABSL_GUARDED_BY(mutex_);  // by name
};

// DATA_LOSS (DATA_LOST): the model cannot be made without these scans. Their names are in the
// metadata `scans`, too.
absl::Status ModelLacks(const std::string& session, const std::vector<std::string>& scans);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_LOST_SCANS_H_
