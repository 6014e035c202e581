#include "client/cli/pace.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/report.h"
#include "client/cli/terminal.h"

namespace vantage::cli {
namespace {

constexpr std::chrono::seconds kLookedBack{10};
constexpr std::chrono::milliseconds kLeast{500};  // below that a pace is chance

}  // namespace

std::string Pace::Of(double done, double total, Clock::time_point now) {
  if (!reached_.empty() && done < reached_.back().done) reached_.clear();
  reached_.push_back({now, done});
  while (reached_.size() > 2 && now - reached_[1].when >= kLookedBack) reached_.pop_front();
  std::string text = Bytes(done);
  if (total > 0) absl::StrAppend(&text, " of ", Bytes(total));
  const Reached& first = reached_.front();
  if (now - first.when < kLeast || !(done > first.done)) return text;
  const double rate = (done - first.done) / std::chrono::duration<double>(now - first.when).count();
  absl::StrAppend(&text, ", ", Bytes(rate), "/s");
  if (total > done) absl::StrAppend(&text, ", ", TimeLeft((total - done) / rate));
  return text;
}

}  // namespace vantage::cli
