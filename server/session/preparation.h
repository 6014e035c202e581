// Prepares the problem of the next plan when the model has changed, before anybody asks
// (algorithm.md section 6, 'Always an answer').
#ifndef VANTAGE_SERVER_SESSION_PREPARATION_H_
#define VANTAGE_SERVER_SESSION_PREPARATION_H_

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "server/session/model_memory.h"
#include "server/session/plan_inputs.h"
#include "server/session/session_context.h"
#include "vantage/v1/plan_service.pb.h"

namespace vantage::session {

// The next plan is taken to ask for what the last one did; before the first, for what a plan asks
// that says nothing. Nothing is prepared where other work waits or little memory is free, nor for
// plans that have no use for it (of fleets, around claims, with a choice of settings). Thread safe.
class Preparation {
 public:
  Preparation(SessionContext& context, ModelMemory& model);

  // What the next plan is taken to ask for.
  void Expect(const v1::CreatePlanRequest& request);
  // To be called when the model has changed: begins to prepare, in a job of its own, once no scan
  // waits to change it again.
  void Begin();
  // To be called before the model changes, and when the session has to come to rest: what is being
  // prepared ends soon.
  void Stop();
  // Whether nothing is being prepared.
  bool Rests() const;
  // Calls `submit`, which submits a job that needs the problem of these inputs: at once, or, while
  // that very problem is being prepared, when that has ended. Another that is being prepared is
  // stopped.
  void WhenPrepared(const PlanInputs& inputs, std::function<void()> submit);

 private:
  struct UnderWay {
    std::string told;  // ProblemQuestion::Told()
    std::shared_ptr<const model::PlanningView> view;
    std::stop_source stop;
    std::vector<std::function<void()>> waiting;
  };
  // Inputs of the plan that is expected, with their memory; nothing where it is not to be prepared.
  std::optional<PlanInputs> ReadInputs();
  void Run(const std::shared_ptr<UnderWay>& own, const PlanInputs& inputs,
           parallel::Parallel& parallel);
  // Nothing is under way any more; whoever waited goes on.
  void End(UnderWay& own);

  SessionContext& context_;
  ModelMemory& model_;

  mutable std::mutex mutex_;
  v1::CreatePlanRequest expected_ ABSL_GUARDED_BY(mutex_);
  std::shared_ptr<UnderWay> under_way_ ABSL_GUARDED_BY(mutex_);  // null: nothing
  bool again_ ABSL_GUARDED_BY(mutex_) = false;  // the model changed while that had not ended
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_PREPARATION_H_
