// A session's claims: views that one scanner has reserved until its scan arrives, the claim is
// released, or it expires. Their whole state is in the log.
#ifndef VANTAGE_SERVER_SESSION_CLAIMS_H_
#define VANTAGE_SERVER_SESSION_CLAIMS_H_

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "core/fleet/claim_cover.h"
#include "core/fleet/claims.h"
#include "server/session/journal.h"
#include "server/session/model_memory.h"
#include "server/session/plan_inputs.h"
#include "server/session/session_context.h"
#include "vantage/v1/error.pb.h"
#include "vantage/v1/fleet_service.pb.h"

namespace vantage::session {

// Who asks for something that belongs to somebody.
struct Asker {
  std::string caller;        // empty: callers are not told apart
  bool administers = false;  // may do what others' is, too
};

// Thread safe; it needs no locks but the log's.
class Claims {
 public:
  Claims(SessionContext& context, ModelMemory& model);

  // Runs on the planning pool; `done` is called exactly once, there or (on refusal) here. Takes
  // the request as it came: the log stores its position, and whether there are the scanner and the
  // plan that it names is known here. The claim is `caller`'s, who is empty where callers are not
  // told apart. Nothing is taken for who has gone before it was measured.
  void Take(const v1::ClaimViewRequest& request,
            std::function<void(absl::StatusOr<v1::ClaimViewResponse>)> done,
            const std::string& caller = "", const std::stop_token& gone = {});
  // Ends what is being measured: it is not taken.
  void Stop() { stop_.request_stop(); }
  // From now on it holds for `ttl`. NOT_FOUND; FAILED_PRECONDITION (CLAIM_ENDED); PERMISSION_DENIED
  // (CLAIM_OF_ANOTHER): another caller took it, and `asker` is no administrator; so below.
  absl::StatusOr<v1::Claim> Renew(const std::string& name, absl::Duration ttl,
                                  const RequestKey& key, const Asker& asker = {});
  absl::Status Release(const std::string& name, const RequestKey& key, const Asker& asker = {});
  // Any that was ever taken. NOT_FOUND.
  absl::StatusOr<v1::GetClaimResponse> Get(const std::string& name);
  // The claims that are held, in pages as in Scans::List().
  absl::StatusOr<std::vector<v1::Claim>> List(
      absl::string_view after, size_t limit, bool& more,
      const v1::ListClaimsRequest& filter = v1::ListClaimsRequest());

  // Logs the end of claims that have expired.
  void Expire();
  // After a restart: ends the claims that expired meanwhile, and sets timers for the others.
  void Resume();
  // The claim that a scan with a pose fulfils, by name; empty: none.
  std::string FulfilledBy(const SessionState& state, const v1::Scan& scan) const;
  // Ends a claim whose scan was merged.
  absl::Status Fulfil(const std::string& claim, const std::string& scan);

 private:
  // What the held claims leave of a view at present.
  struct Attempt {
    std::vector<std::string> held;  // names
    fleet::CoveredView covered;
  };
  absl::StatusOr<Attempt> Measure(const PlanInputs& inputs, const Eigen::Vector3d& position,
                                  std::optional<double> heading, parallel::Parallel& parallel,
                                  const parallel::Cancellation& cancelled) const;
  void AddAlternative(const v1::Scanner& scanner, PlanInputs inputs, parallel::Parallel& parallel,
                      const std::stop_token& stopped, v1::ClaimConflict& conflict) const;
  absl::StatusOr<v1::Claim> TakeNow(const v1::ClaimViewRequest& request, const std::string& caller,
                                    const v1::Scanner& scanner, const PlanInputs& inputs,
                                    parallel::Parallel& parallel, const std::stop_token& stopped);
  // `asker`: null where the server itself ends it.
  absl::Status End(const std::string& name, fleet::ClaimEnd how, const std::string& scan,
                   const RequestKey& key, const Asker* asker = nullptr);
  void WatchExpiry(const v1::Claim& claim);

  SessionContext& context_;
  Journal& journal_;
  const SessionDependencies& dependencies_;
  ModelMemory& model_;
  std::stop_source stop_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_CLAIMS_H_
