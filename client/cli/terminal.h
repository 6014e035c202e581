// A progress line that is rewritten in place; without a terminal, only whole lines are written.
#ifndef VANTAGE_CLIENT_CLI_TERMINAL_H_
#define VANTAGE_CLIENT_CLI_TERMINAL_H_

#include <chrono>
#include <string>

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

// '[########----]' of the given width, `share` in [0, 1].
std::string Bar(double share, int width);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_TERMINAL_H_
