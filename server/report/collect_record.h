// Reads from a session what its report tells of.
#ifndef VANTAGE_SERVER_REPORT_COLLECT_RECORD_H_
#define VANTAGE_SERVER_REPORT_COLLECT_RECORD_H_

#include "absl/status/statusor.h"
#include "server/report/job_record.h"
#include "server/session/session.h"

namespace vantage::report {

// `model`: of which the report is; without a view where no scan is in it. It takes long. NOT_FOUND:
// the session is closed. Errors as of Session::MeasureCoverage() and PoseAdjuster::Describe().
absl::StatusOr<JobRecord> CollectRecord(session::Session& session,
                                        const session::ModelSnapshot& model);

}  // namespace vantage::report

#endif  // VANTAGE_SERVER_REPORT_COLLECT_RECORD_H_
