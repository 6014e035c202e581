#include "client/study/job_store.h"

#include <fcntl.h>
#include <google/protobuf/util/json_util.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "client/library/error.h"
#include "client/study/scene_list.h"
#include "core/bytes/checksum.h"

namespace vantage::study {
namespace {

// The message has no map fields, so its bytes are a function of its contents.
uint32_t ChecksumOf(study_records::v1::JobRecord record) {
  record.clear_checksum();
  return bytes::Crc32c(record.SerializeAsString());
}

absl::Status CannotWrite(const std::string& path) {
  return client::WithFix(
      absl::PermissionDeniedError(absl::StrCat("cannot write ", path, ": ", std::strerror(errno))),
      "name another folder with --output");
}

}  // namespace

absl::Status WriteWhole(const std::string& path, const std::string& contents) {
  const std::string temporary = absl::StrCat(path, ".", ::getpid(), ".new");
  const int file = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file < 0) return CannotWrite(temporary);
  size_t written = 0;
  while (written < contents.size()) {
    const ssize_t n = ::write(file, contents.data() + written, contents.size() - written);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    written += static_cast<size_t>(n);
  }
  const bool whole = written == contents.size() && ::fsync(file) == 0;
  const bool closed = ::close(file) == 0;
  if (!whole || !closed || std::rename(temporary.c_str(), path.c_str()) != 0) {
    absl::Status failed = CannotWrite(path);
    ::unlink(temporary.c_str());
    return failed;
  }
  return absl::OkStatus();
}

absl::StatusOr<JobStore> JobStore::Open(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::path(folder) / "jobs", error);
  if (error) {
    return client::WithFix(absl::PermissionDeniedError(absl::StrCat("cannot make the folder ",
                                                                    folder, ": ", error.message())),
                           "name another one with --output");
  }
  return JobStore(folder);
}

std::string JobStore::PathOf(const std::string& scene, const std::string& planner,
                             uint64_t seed) const {
  return absl::StrCat(folder_, "/jobs/", JobName(scene), "_", planner, "_", seed, ".json");
}

absl::Status JobStore::Write(study_records::v1::JobRecord record) const {
  record.set_checksum(ChecksumOf(record));
  google::protobuf::util::JsonPrintOptions options;
  options.add_whitespace = true;
  std::string json;
  if (!google::protobuf::util::MessageToJsonString(record, &json, options).ok()) {
    return absl::InternalError("a job's record could not be written as JSON");
  }
  return WriteWhole(PathOf(record.scene(), record.planner(), record.seed()), json);
}

std::optional<study_records::v1::JobRecord> JobStore::Read(const std::string& scene,
                                                           const std::string& planner,
                                                           uint64_t seed,
                                                           const std::string& settings,
                                                           std::string& why) const {
  why.clear();
  std::ifstream file(PathOf(scene, planner, seed), std::ios::binary);
  if (!file) {
    why = "not done";
    return std::nullopt;
  }
  std::ostringstream text;
  text << file.rdbuf();
  study_records::v1::JobRecord record;
  if (!google::protobuf::util::JsonStringToMessage(text.str(), &record).ok()) {
    why = "damaged";
  } else if (record.format_version() != kRecordFormat) {
    why = "of another format";
  } else if (record.checksum() != ChecksumOf(record)) {
    why = "damaged";
  } else if (record.scene() != scene || record.planner() != planner || record.seed() != seed) {
    why = "of another job";
  } else if (record.settings() != settings) {
    why = "made with other settings";
  }
  if (!why.empty()) return std::nullopt;
  return record;
}

}  // namespace vantage::study
