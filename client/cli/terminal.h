// A progress line that is rewritten in place; without a terminal, only whole lines are written.
#ifndef VANTAGE_CLIENT_CLI_TERMINAL_H_
#define VANTAGE_CLIENT_CLI_TERMINAL_H_

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <string>
#include <thread>

namespace vantage::cli {

class ProgressLine {
 public:
  // Writes to standard error. Without a terminal, `quiet_interval` seconds pass between lines.
  explicit ProgressLine(double quiet_interval = 5);
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void Show(const std::string& text);
  // Removes the line (on a terminal), so that output can follow.
  void Clear();

 private:
  bool terminal_;
  bool shown_ = false;
  std::chrono::duration<double> quiet_interval_;
  std::chrono::steady_clock::time_point next_line_;
};

enum class Paint { kGood, kWarning, kBad };

// The text in its colour where `stream` goes to a terminal, and as it is elsewhere, or where
// NO_COLOR is set.
std::string Painted(const std::string& text, Paint paint, std::FILE* stream);

// '12 s left', '3 min left'.
std::string TimeLeft(double seconds);

// A progress line of something that says nothing until it is done: how long it goes on already,
// each second.
class WaitingLine {
 public:
  // `patience`: seconds for which nothing is shown, of what is mostly done sooner.
  explicit WaitingLine(double quiet_interval = 5, double patience = 0);
  ~WaitingLine();
  WaitingLine(const WaitingLine&) = delete;
  WaitingLine& operator=(const WaitingLine&) = delete;

  // What is waited for from now on. `expected`: for how many seconds, where that is known.
  void Show(const std::string& text, double expected = 0);
  // Removes the line, so that output can follow; Show() begins another.
  void Clear();

 private:
  void Tick();

  std::mutex mutex_;
  std::condition_variable changed_;
  ProgressLine line_;
  std::string text_;
  double expected_ = 0;    // s; 0: not known
  const double patience_;  // s
  std::chrono::steady_clock::time_point since_;
  bool ended_ = false;
  std::thread ticking_;
};

// '[########----]' of the given width, `share` in [0, 1].
std::string Bar(double share, int width);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_TERMINAL_H_
