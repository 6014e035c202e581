#include "client/cli/pace.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/report.h"

namespace vantage::cli {
namespace {

constexpr std::chrono::seconds kLookedBack{10};
constexpr std::chrono::milliseconds kLeast{500};  // below that a pace is chance

std::string TimeLeft(double seconds) {
  const double left = std::ceil(seconds);
  return left < 120 ? absl::StrFormat("%.0f s left", left)
                    : absl::StrFormat("%.0f min left", std::ceil(left / 60));
}

}  // namespace

std::string Pace::Of(double done, double total, Clock::time_point now) {
  if (!reached_.empty() && done < reached_.back().done) reached_.clear();
  reached_.push_back({now, done});
  while (reached_.size() > 2 && now - reached_[1].when >= kLookedBack) reached_.pop_front();
  std::string text = absl::StrCat(Bytes(done), " of ", Bytes(total));
  const Reached& first = reached_.front();
  if (now - first.when < kLeast || !(done > first.done)) return text;
  const double rate = (done - first.done) / std::chrono::duration<double>(now - first.when).count();
  absl::StrAppend(&text, ", ", Bytes(rate), "/s");
  if (total > done) absl::StrAppend(&text, ", ", TimeLeft((total - done) / rate));
  return text;
}

}  // namespace vantage::cli
