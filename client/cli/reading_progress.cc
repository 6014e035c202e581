#include "client/cli/reading_progress.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/pace.h"
#include "client/cli/terminal.h"

namespace vantage::cli {

struct ReadingProgress::State {
  std::string name;
  ProgressLine line;
  Pace pace;
};

ReadingProgress::ReadingProgress(const std::string& name) : state_(std::make_shared<State>()) {
  state_->name = name;
}

std::function<void(uint64_t, uint64_t)> ReadingProgress::Watch() const {
  return [state = state_](uint64_t position, uint64_t size) {
    state->line.Show(
        absl::StrCat("reading ", state->name, ": ",
                     state->pace.Of(static_cast<double>(position), static_cast<double>(size))));
  };
}

void ReadingProgress::Clear() const { state_->line.Clear(); }

}  // namespace vantage::cli
