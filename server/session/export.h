// A file made from a session, part by part: whole models at once, registered scans one scan at a
// time, so that memory holds one part.
#ifndef VANTAGE_SERVER_SESSION_EXPORT_H_
#define VANTAGE_SERVER_SESSION_EXPORT_H_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "server/session/archive_writer.h"
#include "server/session/scans_e57.h"
#include "server/session/session.h"
#include "vantage/v1/model_service.pb.h"

namespace vantage::session {

// Not thread safe.
class Export {
 public:
  // Checks the request and fixes what is exported: later changes of the session have no effect.
  // FAILED_PRECONDITION: nothing to export. RESOURCE_EXHAUSTED: too many
  // exports of the session are under way.
  static absl::StatusOr<std::unique_ptr<Export>> Create(std::shared_ptr<Session> session,
                                                        const v1::ExportModelRequest& request);

  ~Export();
  Export(const Export&) = delete;
  Export& operator=(const Export&) = delete;

  // The next part, in order; empty at the end. It takes long, so call it on a pool.
  absl::StatusOr<std::string> Next();

  // 0 until it is known.
  int64_t total_size() const { return total_size_; }
  uint64_t model_version() const { return model_.version; }
  const std::string& file_name() const { return file_name_; }
  Session& session() const { return *session_; }

 private:
  Export(std::shared_ptr<Session> session, v1::ExportFormat format);
  absl::Status ChooseScans(const v1::ExportModelRequest& request);

  const std::shared_ptr<Session> session_;
  const v1::ExportFormat format_;
  ModelSnapshot model_;
  std::string file_name_;
  int64_t total_size_ = 0;
  std::vector<v1::Scan> scans_;
  sensor::AppearanceKinds appearance_;  // that any of them has
  std::optional<ScansE57> e57_;         // of them
  std::optional<ArchiveWriter> archive_;
  std::string plan_;
  size_t part_ = 0;
  bool counted_ = false;  // it is counted among the session's exports
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_EXPORT_H_
