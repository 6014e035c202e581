#include "tests/faults/disk_recorder.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

namespace vantage::faults {
namespace {

// What the recorder knows. Never destroyed: files are closed until the very end.
struct Recorder {
  std::recursive_mutex mutex;  // held for a whole call, so that steps are in their true order
  std::string folder;          // absolute, with a '/' at its end; empty: nothing is recorded
  bool recording = false;
  std::vector<DiskStep> steps;
  std::map<std::string, uint64_t> nodes;                 // by path below the folder
  std::map<int, std::pair<uint64_t, std::string>> open;  // by descriptor: node and path
  uint64_t next_node = 1;
  // Faults.
  bool failing = false;
  size_t fail_after = 0;
  size_t fail_times = 0;
  size_t failed = 0;
  int error = 0;
};
Recorder& TheRecorder() {
  static auto* const recorder = new Recorder;
  return *recorder;
}

template <typename Function>
Function* Real(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

// The path below the folder, if it is.
std::optional<std::string> Below(const Recorder& recorder, const char* path) {
  if (recorder.folder.empty() || path == nullptr) return std::nullopt;
  // SQLite writes paths its own way.
  const std::string whole = std::filesystem::path(path).lexically_normal().string();
  if (whole + "/" == recorder.folder) return "";
  if (whole.rfind(recorder.folder, 0) != 0) return std::nullopt;
  return whole.substr(recorder.folder.size());
}

// True when this step must fail.
bool Fails(Recorder& recorder) {
  if (!recorder.failing) return false;
  if (recorder.fail_after > 0) {
    --recorder.fail_after;
    return false;
  }
  if (recorder.fail_times == 0) return false;
  --recorder.fail_times;
  ++recorder.failed;
  errno = recorder.error;
  return true;
}

void Record(Recorder& recorder, DiskStep step) {
  if (recorder.recording) recorder.steps.push_back(std::move(step));
}

int OpenFile(const char* name, int directory, const char* path, int flags, mode_t mode) {
  Recorder& recorder = TheRecorder();
  std::lock_guard<std::recursive_mutex> lock(recorder.mutex);
  const std::optional<std::string> below = Below(recorder, path);
  const bool writes = (flags & O_ACCMODE) != O_RDONLY;
  const bool is_new =
      below.has_value() && (flags & O_CREAT) != 0 && ::access(path, F_OK) != 0 && errno == ENOENT;
  if ((is_new || (below.has_value() && (flags & O_TRUNC) != 0)) && Fails(recorder)) return -1;
  const int fd = directory == AT_FDCWD
                     ? Real<int(const char*, int, ...)>(name)(path, flags, mode)
                     : Real<int(int, const char*, int, ...)>(name)(directory, path, flags, mode);
  if (fd < 0 || !below.has_value()) return fd;
  uint64_t& node = recorder.nodes[*below];
  if (is_new || node == 0) node = *below == "" ? 0 : recorder.next_node++;
  recorder.open[fd] = {node, *below};
  if (is_new) {
    Record(recorder, {DiskStep::Kind::kCreateFile, node, *below, "", 0, ""});
  } else if (writes && (flags & O_TRUNC) != 0) {
    Record(recorder, {DiskStep::Kind::kTruncate, node, *below, "", 0, ""});
  }
  return fd;
}

// Runs `call`, and records `step` of an open file if it succeeds (returns >= 0). -1: a fault.
template <typename Call>
ssize_t OnFile(int fd, DiskStep::Kind kind, uint64_t offset, const void* bytes, size_t size,
               Call call) {
  Recorder& recorder = TheRecorder();
  std::unique_lock<std::recursive_mutex> lock(recorder.mutex);
  const auto known = recorder.open.find(fd);
  if (known == recorder.open.end()) {
    lock.unlock();  // writes of other threads must not wait for this sync
    return call();
  }
  if (Fails(recorder)) return -1;
  const ssize_t done = call();
  if (done < 0) return done;
  DiskStep step{kind, known->second.first, known->second.second, "", offset, ""};
  if (kind == DiskStep::Kind::kWrite) {
    step.bytes.assign(static_cast<const char*>(bytes), static_cast<size_t>(done));
  }
  if (kind == DiskStep::Kind::kSyncFile) {
    struct stat about {};
    if (::fstat(fd, &about) == 0 && S_ISDIR(about.st_mode)) step.kind = DiskStep::Kind::kSyncFolder;
  }
  (void)size;
  Record(recorder, std::move(step));
  return done;
}

}  // namespace

void DiskRecorder::Start(const std::string& folder) {
  Recorder& recorder = TheRecorder();
  std::lock_guard<std::recursive_mutex> lock(recorder.mutex);
  recorder.folder = (std::filesystem::path(folder) / "").lexically_normal().string();
  recorder.recording = true;
  recorder.steps.clear();
  recorder.nodes.clear();
  recorder.open.clear();
  recorder.next_node = 1;
}

std::vector<DiskStep> DiskRecorder::Stop() {
  Recorder& recorder = TheRecorder();
  std::lock_guard<std::recursive_mutex> lock(recorder.mutex);
  recorder.recording = false;
  recorder.folder.clear();
  recorder.open.clear();
  return std::move(recorder.steps);
}

size_t DiskRecorder::Count() {
  Recorder& recorder = TheRecorder();
  std::lock_guard<std::recursive_mutex> lock(recorder.mutex);
  return recorder.steps.size();
}

void DiskRecorder::FailSteps(const std::string& folder, size_t after, int error, size_t times) {
  Recorder& recorder = TheRecorder();
  std::lock_guard<std::recursive_mutex> lock(recorder.mutex);
  recorder.folder = (std::filesystem::path(folder) / "").lexically_normal().string();
  recorder.failing = true;
  recorder.fail_after = after;
  recorder.fail_times = times;
  recorder.failed = 0;
  recorder.error = error;
}

size_t DiskRecorder::Failed() {
  Recorder& recorder = TheRecorder();
  std::lock_guard<std::recursive_mutex> lock(recorder.mutex);
  return recorder.failed;
}

void DiskRecorder::FailNoMore() {
  Recorder& recorder = TheRecorder();
  std::lock_guard<std::recursive_mutex> lock(recorder.mutex);
  recorder.failing = false;
}

}  // namespace vantage::faults

// The C library's own names. What is not below the folder goes straight through.
using vantage::faults::DiskStep;

extern "C" {

int open(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = va_arg(more, mode_t);
  va_end(more);
  return vantage::faults::OpenFile("open", AT_FDCWD, path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  va_list more;
  va_start(more, flags);
  const mode_t mode = va_arg(more, mode_t);
  va_end(more);
  return vantage::faults::OpenFile("open64", AT_FDCWD, path, flags, mode);
}

int close(int fd) {
  vantage::faults::Recorder& recorder = vantage::faults::TheRecorder();
  std::lock_guard<std::recursive_mutex> lock(recorder.mutex);
  recorder.open.erase(fd);
  return vantage::faults::Real<int(int)>("close")(fd);
}

ssize_t write(int fd, const void* bytes, size_t size) {
  const off_t at = ::lseek(fd, 0, SEEK_CUR);
  return vantage::faults::OnFile(
      fd, DiskStep::Kind::kWrite, static_cast<uint64_t>(at < 0 ? 0 : at), bytes, size, [&] {
        return vantage::faults::Real<ssize_t(int, const void*, size_t)>("write")(fd, bytes, size);
      });
}

ssize_t pwrite(int fd, const void* bytes, size_t size, off_t offset) {
  return vantage::faults::OnFile(
      fd, DiskStep::Kind::kWrite, static_cast<uint64_t>(offset), bytes, size, [&] {
        return vantage::faults::Real<ssize_t(int, const void*, size_t, off_t)>("pwrite")(
            fd, bytes, size, offset);
      });
}

ssize_t pwrite64(int fd, const void* bytes, size_t size, off64_t offset) {
  return pwrite(fd, bytes, size, offset);
}

int ftruncate(int fd, off_t size) noexcept {
  return static_cast<int>(vantage::faults::OnFile(
      fd, DiskStep::Kind::kTruncate, static_cast<uint64_t>(size), nullptr, 0,
      [&] { return vantage::faults::Real<int(int, off_t)>("ftruncate")(fd, size); }));
}

int ftruncate64(int fd, off64_t size) noexcept { return ftruncate(fd, size); }

int fsync(int fd) {
  return static_cast<int>(
      vantage::faults::OnFile(fd, DiskStep::Kind::kSyncFile, 0, nullptr, 0,
                              [&] { return vantage::faults::Real<int(int)>("fsync")(fd); }));
}

int fdatasync(int fd) {
  return static_cast<int>(
      vantage::faults::OnFile(fd, DiskStep::Kind::kSyncFile, 0, nullptr, 0,
                              [&] { return vantage::faults::Real<int(int)>("fdatasync")(fd); }));
}

int mkdir(const char* path, mode_t mode) noexcept {
  vantage::faults::Recorder& recorder = vantage::faults::TheRecorder();
  std::lock_guard<std::recursive_mutex> lock(recorder.mutex);
  const auto below = vantage::faults::Below(recorder, path);
  if (below.has_value() && vantage::faults::Fails(recorder)) return -1;
  const int done = vantage::faults::Real<int(const char*, mode_t)>("mkdir")(path, mode);
  if (done == 0 && below.has_value()) {
    recorder.nodes[*below] = recorder.next_node;
    vantage::faults::Record(recorder,
                            {DiskStep::Kind::kMakeFolder, recorder.next_node++, *below, "", 0, ""});
  }
  return done;
}

int rename(const char* from, const char* to) noexcept {
  vantage::faults::Recorder& recorder = vantage::faults::TheRecorder();
  std::lock_guard<std::recursive_mutex> lock(recorder.mutex);
  const auto below = vantage::faults::Below(recorder, from);
  const auto target = vantage::faults::Below(recorder, to);
  if (below.has_value() && vantage::faults::Fails(recorder)) return -1;
  const int done = vantage::faults::Real<int(const char*, const char*)>("rename")(from, to);
  if (done == 0 && below.has_value() && target.has_value()) {
    const uint64_t node = recorder.nodes[*below];
    recorder.nodes[*target] = node;
    recorder.nodes.erase(*below);
    vantage::faults::Record(recorder, {DiskStep::Kind::kRename, node, *below, *target, 0, ""});
  }
  return done;
}

int link(const char* from, const char* to) noexcept {
  vantage::faults::Recorder& recorder = vantage::faults::TheRecorder();
  std::lock_guard<std::recursive_mutex> lock(recorder.mutex);
  const auto below = vantage::faults::Below(recorder, from);
  const auto target = vantage::faults::Below(recorder, to);
  if (target.has_value() && vantage::faults::Fails(recorder)) return -1;
  const int done = vantage::faults::Real<int(const char*, const char*)>("link")(from, to);
  if (done == 0 && below.has_value() && target.has_value()) {
    uint64_t& node = recorder.nodes[*below];
    if (node == 0) node = recorder.next_node++;
    recorder.nodes[*target] = node;
    vantage::faults::Record(recorder, {DiskStep::Kind::kLink, node, *below, *target, 0, ""});
  }
  return done;
}

int unlink(const char* path) noexcept {
  vantage::faults::Recorder& recorder = vantage::faults::TheRecorder();
  std::lock_guard<std::recursive_mutex> lock(recorder.mutex);
  const auto below = vantage::faults::Below(recorder, path);
  if (below.has_value() && vantage::faults::Fails(recorder)) return -1;
  const int done = vantage::faults::Real<int(const char*)>("unlink")(path);
  if (done == 0 && below.has_value()) {
    vantage::faults::Record(recorder,
                            {DiskStep::Kind::kRemove, recorder.nodes[*below], *below, "", 0, ""});
    recorder.nodes.erase(*below);
  }
  return done;
}

}  // extern "C"
