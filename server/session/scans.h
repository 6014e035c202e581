// A session's scans, as people see and decide on them. Their whole state is in the log;
// ScanReconciler acts on it.
#ifndef VANTAGE_SERVER_SESSION_SCANS_H_
#define VANTAGE_SERVER_SESSION_SCANS_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "core/sensor/range_image.h"
#include "server/session/scan_reconciler.h"
#include "server/session/session_context.h"
#include "vantage/v1/scan_service.pb.h"

namespace vantage::session {

// Thread safe: the log's locks are all that it needs.
class Scans {
 public:
  Scans(SessionContext& context, ScanReconciler& reconciler);

  absl::StatusOr<v1::Scan> Get(const std::string& name) const;
  // Created after the one of the name `after` (empty: all), at most `limit`; `more` says whether
  // others follow. So in the other lists. INVALID_ARGUMENT naming `page_token` where there has
  // never been one of that name.
  absl::StatusOr<std::vector<v1::Scan>> List(
      absl::string_view after, size_t limit, bool& more,
      const v1::ListScansRequest& filter = v1::ListScansRequest()) const;
  // Which pose of a scan in doubt is right, as a person says.
  struct ChosenPose {
    int rival_pose = 0;  // as aligned, or of the others that its registration names, from 1; >= 0
    bool proposed = false;  // that of Scan.pose_proposal, instead
    std::string etag = {};  // of the scan as it was seen; empty: as it is
  };
  // Merges a doubtful or failed scan there. FAILED_PRECONDITION (SCAN_STATE) for others; so below.
  // INVALID_ARGUMENT naming `rival_pose` where there are not so many, or `proposed` where nothing
  // is. ABORTED (ETAG_STALE): it has other poses by now than when it was seen.
  absl::StatusOr<v1::Scan> Accept(const std::string& name, const ChosenPose& chosen,
                                  const RequestKey& key);
  // Aligns the scan anew from the prior, or merges it where the prior says. The message of the
  // prior is what the log stores.
  absl::StatusOr<v1::Scan> SetPose(const std::string& name, const v1::PosePrior& prior, bool as_is,
                                   const RequestKey& key);
  struct Withdrawn {
    v1::Scan scan;
    // Scans that were aligned to a model that held it, by name.
    std::vector<std::string> dependents;
  };
  absl::StatusOr<Withdrawn> Withdraw(const std::string& name, const RequestKey& key);
  // With intensity and colour, where it has them. Errors as of session::LoadImage().
  absl::StatusOr<sensor::RangeImage> LoadImage(const std::string& name) const;

  // Number of scans that were received and are neither merged nor refused.
  int Pending() const;
  // Erases the data of scans that were withdrawn before that time, by the time seen, and for which
  // `sure` says so. Returns how many. `release` releases the snapshots of log entries before a
  // number, which may hold their part of the model; while it says false, their scans stay.
  absl::StatusOr<int> EraseWithdrawn(absl::Duration before,
                                     absl::FunctionRef<bool(const std::string& scan)> sure,
                                     absl::FunctionRef<bool(uint64_t sequence)> release);

 private:
  // Adds what the log does not have.
  void Complete(v1::Scan& scan) const;

  SessionContext& context_;
  Journal& journal_;
  ScanReconciler& reconciler_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SCANS_H_
