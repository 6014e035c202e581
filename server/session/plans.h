// A session's plans, from their start to their logged results, and what-ifs.
#ifndef VANTAGE_SERVER_SESSION_PLANS_H_
#define VANTAGE_SERVER_SESSION_PLANS_H_

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/session/claims.h"
#include "server/session/model_memory.h"
#include "server/session/plan_inputs.h"
#include "server/session/plan_run.h"
#include "server/session/preparation.h"
#include "server/session/session_context.h"
#include "vantage/v1/plan_service.pb.h"

namespace vantage::session {

// Thread safe.
class Plans {
 public:
  // Plans whose details are stored count for the account.
  Plans(SessionContext& context, ModelMemory& model, Claims& claims, Preparation& preparation);

  // Takes the request as it came: its plan's message is what the log stores, and is completed here.
  absl::StatusOr<v1::Plan> Create(const v1::CreatePlanRequest& request);
  absl::StatusOr<v1::Plan> Get(const std::string& name) const;
  // The result with patches and map of scores. FAILED_PRECONDITION (PLAN_DETAIL_RELEASED) when
  // these were released.
  absl::StatusOr<v1::PlanResult> GetFullResult(const std::string& name) const;
  // In pages, as in Scans::List().
  absl::StatusOr<std::vector<v1::Plan>> List(
      absl::string_view after, size_t limit, bool& more,
      const v1::ListPlansRequest& filter = v1::ListPlansRequest()) const;
  // The request is remembered with the end of the plan; one that finds it ended has no effect, and
  // needs not to be.
  absl::StatusOr<v1::Plan> Cancel(const std::string& name, const RequestKey& key = {});
  // FAILED_PRECONDITION (PLAN_RUNNING): it has not ended.
  absl::Status Delete(const std::string& name, const RequestKey& key);
  // Null when it is not running.
  std::shared_ptr<PlanRun> FindRun(const std::string& name) const;
  // Runs on the planning pool; `done` is called exactly once, there or (on refusal) here. For who
  // has gone nothing is prepared.
  void EvaluateView(const v1::EvaluateViewRequest& request,
                    std::function<void(absl::StatusOr<v1::EvaluateViewResponse>)> done,
                    const std::stop_token& gone = {});

  // After a restart: ends the plans that were running when the server stopped.
  void EndInterrupted();
  // Stops the running plans; they end soon.
  void Stop(PlanRun::StopReason reason);
  // Plans that are queued, running, or ended and not logged yet.
  size_t Running() const;
  // True when none is queued or running.
  bool Rest() const;

  // Blobs that hold details.
  std::vector<std::string> Blobs() const;
  // Called when the session is closed. Returns all of them; the caller releases them.
  std::vector<std::string> TakeBlobs();

 private:
  void Submit(const std::shared_ptr<PlanRun>& run, const PlanInputs& inputs, absl::Time submitted);
  void Run(const std::shared_ptr<PlanRun>& run, const PlanInputs& inputs, absl::Time submitted,
           parallel::Parallel& parallel);
  void End(const std::shared_ptr<PlanRun>& run, v1::Plan plan,
           const std::shared_ptr<const v1::PlanResult>& full);
  void EndLater(const std::shared_ptr<PlanRun>& run, const v1::Plan& plan,
                const std::shared_ptr<const v1::PlanResult>& full, const absl::Status& why);

  SessionContext& context_;
  Journal& journal_;
  const SessionDependencies& dependencies_;
  ModelMemory& model_;
  Claims& claims_;
  Preparation& preparation_;

  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<PlanRun>> runs_ ABSL_GUARDED_BY(mutex_);
  std::vector<std::string> full_results_ ABSL_GUARDED_BY(mutex_);  // blobs held, oldest first
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_PLANS_H_
