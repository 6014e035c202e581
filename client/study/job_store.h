// The records of a study in a folder, one file for each job that is done.
#ifndef VANTAGE_CLIENT_STUDY_JOB_STORE_H_
#define VANTAGE_CLIENT_STUDY_JOB_STORE_H_

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "vantage/study_records/v1/study.pb.h"

namespace vantage::study {

inline constexpr uint32_t kRecordFormat = 4;

// Writes `contents` so that the file is complete or absent, whatever happens meanwhile.
absl::Status WriteWhole(const std::string& path, const std::string& contents);

class JobStore {
 public:
  // Makes the folder where there is none.
  static absl::StatusOr<JobStore> Open(const std::string& folder);

  std::string PathOf(const std::string& scene, const std::string& planner, uint64_t seed) const;

  // Fills in the checksum.
  absl::Status Write(study_records::v1::JobRecord record) const;

  // Nothing where the job has to be done (again): the file is missing, damaged, or of another job,
  // format or settings. `why` says which.
  std::optional<study_records::v1::JobRecord> Read(const std::string& scene,
                                                   const std::string& planner, uint64_t seed,
                                                   const std::string& settings,
                                                   std::string& why) const;

 private:
  explicit JobStore(std::string folder) : folder_(std::move(folder)) {}

  std::string folder_;
};

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_JOB_STORE_H_
