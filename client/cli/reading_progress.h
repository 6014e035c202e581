// Says how far the reading of a large file is.
#ifndef VANTAGE_CLIENT_CLI_READING_PROGRESS_H_
#define VANTAGE_CLIENT_CLI_READING_PROGRESS_H_

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace vantage::cli {

// Copies are the same.
class ReadingProgress {
 public:
  // `name`: of what is read, for people.
  explicit ReadingProgress(const std::string& name);

  // For what reads: to be called with how far it is, and with the size of the file.
  std::function<void(uint64_t position, uint64_t size)> Watch() const;
  // Removes the line, so that output can follow.
  void Clear() const;

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_READING_PROGRESS_H_
