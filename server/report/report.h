// The report of a job, for who ordered the survey: one HTML file, made part by part, so that memory
// holds the record of the job and one part.
#ifndef VANTAGE_SERVER_REPORT_REPORT_H_
#define VANTAGE_SERVER_REPORT_REPORT_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/report/job_record.h"
#include "server/report/requirements.h"
#include "server/report/storeys.h"
#include "server/session/session.h"
#include "vantage/v1/model_service.pb.h"

namespace vantage::report {

// Not thread safe.
class Report {
 public:
  // INVALID_ARGUMENT: a language that there is not. FAILED_PRECONDITION, DATA_LOSS and others: the
  // session has a model that cannot be had now (ModelMemory::WhyNone()); a session without scans
  // has a report. RESOURCE_EXHAUSTED: too many exports of the session are under way.
  static absl::StatusOr<std::unique_ptr<Report>> Create(std::shared_ptr<session::Session> session,
                                                        const v1::ExportReportRequest& request);

  ~Report();
  Report(const Report&) = delete;
  Report& operator=(const Report&) = delete;

  // The next part, in order; empty at the end. It takes long, so call it on a pool.
  absl::StatusOr<std::string> Next();

  int64_t total_size() const { return 0; }  // parts are made as they are asked for
  uint64_t model_version() const { return model_.version; }
  const std::string& file_name() const { return file_name_; }
  session::Session& session() const { return *session_; }

 private:
  Report(std::shared_ptr<session::Session> session, ReportOptions options);

  const std::shared_ptr<session::Session> session_;
  const ReportOptions options_;
  session::ModelSnapshot model_;
  const std::string file_name_;
  // From the first part on.
  session::MemoryAccount::Reservation room_;
  JobRecord record_;
  std::vector<ReportStorey> storeys_;
  Standing standing_;
  size_t part_ = 0;
  bool counted_ = false;  // it is counted among the session's exports
};

}  // namespace vantage::report

#endif  // VANTAGE_SERVER_REPORT_REPORT_H_
