// Reading the file that an upload brought: in a process of its own, set-up by set-up, each of which
// becomes a scan as if its range image had been sent.
#ifndef VANTAGE_SERVER_SESSION_FILE_READING_H_
#define VANTAGE_SERVER_SESSION_FILE_READING_H_

#include <chrono>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/sensor/confined_scan_file.h"
#include "server/session/file_readings.h"
#include "server/session/scan_intake.h"
#include "server/session/scan_reconciler.h"
#include "server/session/session_context.h"
#include "server/session/upload.h"

namespace vantage::session {

// Of one upload. Used by one thread at a time.
class FileReading {
 public:
  // All outlive it.
  FileReading(SessionContext& context, ScanReconciler& reconciler, ScanIntake& intake,
              std::shared_ptr<Upload> upload)
      : context_(context),
        dependencies_(context.dependencies()),
        reconciler_(reconciler),
        intake_(intake),
        upload_(std::move(upload)),
        asked_(upload_->Describe()) {}

  enum class Outcome {
    kRead,     // to the end; some scans came of it
    kFailed,   // no scan comes of it: see why()
    kLater,    // it waits for something: see why()
    kGivenUp,  // somebody ended it
  };
  // Goes on after the set-ups that are scans already.
  Outcome Run(const FileReadings::GivenUp& given_up);
  // With a reason (upload.proto, state_reason).
  const absl::Status& why() const { return why_; }
  // After kRead: what of it is no scan, and what else somebody should know.
  std::string Notes() const;
  // After kLater.
  static constexpr std::chrono::milliseconds kAgain{2000};

 private:
  Outcome Read(const FileReadings::GivenUp& given_up);
  absl::StatusOr<sensor::ConfinedScanFile> Open(const FileReadings::GivenUp& given_up,
                                                sensor::FileRefusal& refusal);
  // Reads and sends one set-up. OK also where it is refused, of which it takes note.
  absl::Status ReadSetup(sensor::ConfinedScanFile& file, size_t setup);
  // What is known of a set-up's scan.
  v1::Upload Describe(const sensor::ConfinedScanFile& file, size_t setup,
                      const sensor::ImportedScan& scan) const;
  // Stores a range image as the pieces of an upload.
  absl::StatusOr<Upload::Content> Store(const sensor::RangeImage& image, size_t setup);
  // OK, or what it has to wait for, or ABORTED: the upload has ended.
  absl::Status Receive(const ScanIntake::Arrival& arrival);
  std::string NameOf(const std::vector<std::string>& setups, size_t setup) const;
  // Whether a set-up is a scan already, and how many are.
  bool IsScan(size_t setup) const;
  size_t Scans() const;
  // What has to end or become free before the next scan can come; OK: nothing.
  absl::Status CheckRoom() const;
  void Refuse(const std::string& name, const absl::Status& why);
  void Note(const std::string& name, const std::string& what);
  Outcome Fail(absl::StatusCode code, const std::string& reason, absl::string_view message);
  Outcome Later(const absl::Status& why);

  SessionContext& context_;
  const SessionDependencies& dependencies_;
  ScanReconciler& reconciler_;
  ScanIntake& intake_;
  const std::shared_ptr<Upload> upload_;
  const v1::Upload asked_;
  absl::Status why_;
  std::vector<std::string> notes_;
  std::set<size_t> refused_;    // set-ups
  absl::Status first_refusal_;  // of a set-up
  int deaths_ = 0;              // of readers that were ended from outside
  bool waited_ = false;         // for scans that were to be merged
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_FILE_READING_H_
