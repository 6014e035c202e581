#include "server/session/prepared_problem.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace vantage::session {

// Figures that differ in a bit differ.
std::string ProblemQuestion::Told() const {
  const sensor::ScannerModel& m = scanner;
  std::string told = absl::StrCat(config.seed, " ");
  for (const double figure :
       {m.azimuth_span, m.elevation_min, m.elevation_max, m.azimuth_step, m.elevation_step,
        m.range_min, m.range_max, m.range_noise, m.range_noise_ppm, m.max_incidence, m.clearance,
        m.positioning_error}) {
    absl::StrAppendFormat(&told, "%a ", figure);
  }
  return absl::StrCat(told, m.name, "\n", written);
}

absl::StatusOr<std::shared_ptr<const planning::PlanningProblem>> PreparedProblem::Of(
    const ProblemQuestion& question, std::shared_ptr<MemoryAccount::Reservation> memory,
    parallel::Parallel& parallel, const parallel::Cancellation& cancelled) {
  const std::string told = question.Told();
  uint64_t forgotten = 0;
  const std::optional<Held> last = Last(forgotten);
  const bool same_view = last.has_value() && last->view == question.view;
  if (same_view && last->question == told) return last->problem;
  auto made =
      planning::PlanningProblem::Prepare({*question.view, question.scanner, question.config,
                                          same_view ? last->problem.get() : nullptr, question.site},
                                         parallel, cancelled);
  if (!made.ok()) return made.status();
  std::optional<Held> before = Held{question.view, told, *made, std::move(memory)};
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (forgotten_ == forgotten) held_.swap(before);
  }
  return made;  // what was held before goes without the lock
}

int64_t PreparedProblem::Forget() {
  std::optional<Held> before;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    held_.swap(before);
    ++forgotten_;
  }
  const bool alone =
      before.has_value() && before->memory != nullptr && before->memory.use_count() == 1;
  return alone ? before->memory->bytes() : 0;
}

std::optional<PreparedProblem::Held> PreparedProblem::Last(uint64_t& forgotten) const {
  std::lock_guard<std::mutex> lock(mutex_);
  forgotten = forgotten_;
  return held_;
}

}  // namespace vantage::session
