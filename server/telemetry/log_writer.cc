#include "server/telemetry/log_writer.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

namespace vantage::telemetry {
namespace {

// A pipe that poll() calls writable has room for so many bytes, so that such a write does not
// block.
constexpr size_t kPiece = 4096;
// How long the thread waits for room before it looks whether the process ends.
constexpr int kPollMs = 100;

std::string LostLine(int64_t count) {
  return absl::StrFormat(
      "{\"time\":\"%s\",\"level\":\"warning\",\"message\":\"log lines were lost: whoever reads "
      "them was too slow or away\",\"count\":%d}\n",
      absl::FormatTime("%Y-%m-%dT%H:%M:%E6SZ", absl::Now(), absl::UTCTimeZone()), count);
}

}  // namespace

struct LogWriter::Shared {
  Shared(int descriptor, size_t most) : file(descriptor), most_waiting(most) {}

  // Writes until it is told to end and nothing is left, or nobody reads.
  void Run();
  // What could not be written of the bytes, since nobody reads any more or the process ends.
  absl::string_view WriteAll(absl::string_view bytes);
  bool Ends() {
    const std::lock_guard<std::mutex> lock(mutex);
    return Late();
  }
  // Nobody waits for what is left any more.
  bool Late() const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex) {
    return ends && std::chrono::steady_clock::now() > end_by;
  }

  const int file;
  const size_t most_waiting;
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<std::string> waiting ABSL_GUARDED_BY(mutex);
  size_t waiting_bytes ABSL_GUARDED_BY(mutex) = 0;
  int64_t lost ABSL_GUARDED_BY(mutex) = 0;
  bool ends ABSL_GUARDED_BY(mutex) = false;
  std::chrono::steady_clock::time_point end_by ABSL_GUARDED_BY(mutex);
  bool done ABSL_GUARDED_BY(mutex) = false;
};

absl::string_view LogWriter::Shared::WriteAll(absl::string_view bytes) {
  while (!bytes.empty()) {
    pollfd waiter = {file, POLLOUT, 0};
    const int ready = poll(&waiter, 1, kPollMs);
    if (ready < 0 && errno != EINTR) return bytes;
    if (ready <= 0) {
      if (Ends()) return bytes;
      continue;
    }
    const size_t size = std::min(bytes.size(), kPiece);
    ssize_t written = send(file, bytes.data(), size, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (written < 0 && errno == ENOTSOCK) written = write(file, bytes.data(), size);
    if (written < 0) {
      if (errno == EINTR || errno == EAGAIN) continue;
      return bytes;
    }
    bytes.remove_prefix(static_cast<size_t>(written));
  }
  return bytes;
}

void LogWriter::Shared::Run() {
  int64_t said = 0;  // of the lines that were lost
  while (true) {
    std::string lines;  // a piece at a time, if so many wait
    int64_t lost_so_far = 0;
    {
      std::unique_lock<std::mutex> lock(mutex);
      changed.wait(lock, [this] { return ends || !waiting.empty(); });
      if (waiting.empty() || Late()) break;
      do {
        lines += waiting.front();
        waiting.pop_front();
      } while (!waiting.empty() && lines.size() + waiting.front().size() <= kPiece);
      waiting_bytes -= lines.size();
      lost_so_far = lost;
    }
    if (lost_so_far > said && WriteAll(LostLine(lost_so_far - said)).empty()) said = lost_so_far;
    const absl::string_view rest = WriteAll(lines);
    if (rest.empty()) continue;
    const std::lock_guard<std::mutex> lock(mutex);
    lost += std::count(rest.begin(), rest.end(), '\n');
  }
  const std::lock_guard<std::mutex> lock(mutex);
  done = true;
  changed.notify_all();
}

LogWriter::LogWriter(int file, size_t most_waiting)
    : shared_(std::make_shared<Shared>(file, most_waiting)) {
  std::thread([shared = shared_] { shared->Run(); }).detach();
}

LogWriter::~LogWriter() {
  std::unique_lock<std::mutex> lock(shared_->mutex);
  shared_->ends = true;
  shared_->end_by = std::chrono::steady_clock::now() + kPatience;
  shared_->changed.notify_all();
  shared_->changed.wait_until(lock, shared_->end_by, [this] { return shared_->done; });
}

void LogWriter::Write(absl::string_view line) {
  const std::lock_guard<std::mutex> lock(shared_->mutex);
  if (shared_->waiting_bytes + line.size() + 1 > shared_->most_waiting) {
    ++shared_->lost;
    return;
  }
  std::string& added = shared_->waiting.emplace_back(line);
  added += '\n';
  shared_->waiting_bytes += added.size();
  shared_->changed.notify_all();
}

int64_t LogWriter::lost() const {
  const std::lock_guard<std::mutex> lock(shared_->mutex);
  return shared_->lost;
}

}  // namespace vantage::telemetry
