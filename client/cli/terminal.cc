#include "client/cli/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/table.h"

namespace vantage::cli {
namespace {

bool IsTerminal(int descriptor) {
  const char* term = std::getenv("TERM");
  return isatty(descriptor) != 0 && term != nullptr && std::strcmp(term, "dumb") != 0;
}

size_t Columns() {
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) return size.ws_col;
  return 80;
}

}  // namespace

ProgressLine::ProgressLine(double quiet_interval)
    : terminal_(IsTerminal(STDERR_FILENO)),
      quiet_interval_(quiet_interval),
      next_line_(std::chrono::steady_clock::now() +
                 std::chrono::duration_cast<std::chrono::steady_clock::duration>(quiet_interval_)) {
}

ProgressLine::~ProgressLine() { Clear(); }

void ProgressLine::Show(const std::string& text) {
  if (terminal_) {
    std::string line = text;
    const size_t limit = Columns() - 1;
    while (DisplayWidth(line) > limit) line.pop_back();
    std::fprintf(stderr, "\r\033[K%s", line.c_str());
    std::fflush(stderr);
    shown_ = true;
    return;
  }
  const auto now = std::chrono::steady_clock::now();
  if (now < next_line_) return;
  next_line_ =
      now + std::chrono::duration_cast<std::chrono::steady_clock::duration>(quiet_interval_);
  std::fprintf(stderr, "%s\n", text.c_str());
}

void ProgressLine::Clear() {
  if (!terminal_ || !shown_) return;
  std::fprintf(stderr, "\r\033[K");
  std::fflush(stderr);
  shown_ = false;
}

std::string Painted(const std::string& text, Paint paint, std::FILE* stream) {
  const char* plain = std::getenv("NO_COLOR");  // https://no-color.org
  if ((plain != nullptr && *plain != 0) || !IsTerminal(fileno(stream))) return text;
  const char* colour = paint == Paint::kGood ? "32" : paint == Paint::kWarning ? "33" : "31";
  return absl::StrCat("\033[", colour, "m", text, "\033[0m");
}

std::string TimeLeft(double seconds) {
  const double left = std::ceil(seconds);
  return left < 120 ? absl::StrFormat("%.0f s left", left)
                    : absl::StrFormat("%.0f min left", std::ceil(left / 60));
}

WaitingLine::WaitingLine(double quiet_interval, double patience)
    : line_(quiet_interval), patience_(patience), ticking_([this] { Tick(); }) {}

WaitingLine::~WaitingLine() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
  ticking_.join();
}

void WaitingLine::Show(const std::string& text, double expected) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (text != text_) since_ = std::chrono::steady_clock::now();
  text_ = text;
  expected_ = expected;
  if (patience_ == 0) line_.Show(text);
}

void WaitingLine::Clear() {
  const std::lock_guard<std::mutex> lock(mutex_);
  text_.clear();
  line_.Clear();
}

void WaitingLine::Tick() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!changed_.wait_for(lock, std::chrono::seconds(1), [this] { return ended_; })) {
    if (text_.empty()) continue;
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - since_).count();
    if (seconds < patience_) continue;
    line_.Show(absl::StrFormat(
        "%s, %.0f s%s", text_, seconds,
        expected_ > seconds ? absl::StrCat(", ", TimeLeft(expected_ - seconds)) : ""));
  }
}

std::string Bar(double share, int width) {
  const int filled = static_cast<int>(std::lround(std::clamp(share, 0.0, 1.0) * width));
  return "[" + std::string(static_cast<size_t>(filled), '#') +
         std::string(static_cast<size_t>(width - filled), '-') + "]";
}

}  // namespace vantage::cli
