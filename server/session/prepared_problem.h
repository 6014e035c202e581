// The planning problem that a session prepared last: steps A to C of whoever asks the same of the
// same model are done.
#ifndef VANTAGE_SERVER_SESSION_PREPARED_PROBLEM_H_
#define VANTAGE_SERVER_SESSION_PREPARED_PROBLEM_H_

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/parallel/parallel.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/problem/planning_problem.h"
#include "core/sensor/scanner_model.h"
#include "server/session/memory_account.h"

namespace vantage::session {

// What a problem is a function of.
struct ProblemQuestion {
  std::shared_ptr<const model::PlanningView> view;
  sensor::ScannerModel scanner;
  planning::PlanningConfig config;
  std::string written;  // all that `config` was read from, but its seed: tells configurations apart
  // What a prior of the site shows of this view; null where none is used. `written` tells priors
  // apart.
  std::shared_ptr<const planning::ExpectedSite> site = nullptr;

  // The question but for its view: different for any two that differ.
  std::string Told() const;
};

// Thread safe.
class PreparedProblem {
 public:
  // The problem that was prepared last, if it is this one, or else this one, made from what both
  // have in common; it is the same either way. `memory` (null: nothing is limited) is what was
  // reserved for it; it is kept while the problem is. The caller keeps the view. Errors as of
  // PlanningProblem::Prepare().
  absl::StatusOr<std::shared_ptr<const planning::PlanningProblem>> Of(
      const ProblemQuestion& question, std::shared_ptr<MemoryAccount::Reservation> memory,
      parallel::Parallel& parallel, const parallel::Cancellation& cancelled);

  // Lets go of it, and of what is being made; whoever plans with it keeps it. Returns the bytes
  // that this gives back.
  int64_t Forget();

 private:
  struct Held {
    std::shared_ptr<const model::PlanningView> view;
    std::string question;
    std::shared_ptr<const planning::PlanningProblem> problem;  // refers to the view
    std::shared_ptr<MemoryAccount::Reservation> memory;
  };
  std::optional<Held> Last(uint64_t& forgotten) const;

  mutable std::mutex mutex_;
  std::optional<Held> held_ ABSL_GUARDED_BY(mutex_);
  uint64_t forgotten_ ABSL_GUARDED_BY(mutex_) = 0;  // how often
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_PREPARED_PROBLEM_H_
