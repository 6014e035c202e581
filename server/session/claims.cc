#include "server/session/claims.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/check_request.h"
#include "server/conversion/fleet_proto.h"
#include "server/conversion/to_proto.h"
#include "server/session/asked_evaluation.h"
#include "server/session/either_stop.h"
#include "server/session/pledged_views.h"

namespace vantage::session {
namespace {

constexpr char kClaimType[] = "vantage/Claim";
constexpr absl::Duration kRetryClaimAfter = absl::Seconds(1);
constexpr int kAttempts = 8;  // to take a claim while other claims are taken and ended
// The budget for an alternative to a refused claim.
constexpr double kAlternativeSeconds = 2;
constexpr uint64_t kAlternativeRays = 20'000'000;

absl::Status Ended(const ClaimRecord& record) {
  return contract::ErrorWithReason(
      absl::StatusCode::kFailedPrecondition, "CLAIM_ENDED",
      absl::StrCat(record.claim.name(), " has ended: ", conversion::Words(record.end_reason),
                   "; claim the view again"),
      {{"ended", v1::ClaimEndReason_Name(record.end_reason)}});
}

// A claim that was taken while callers were not told apart is everybody's.
absl::Status CheckMay(const ClaimRecord& record, const Asker& asker) {
  const bool own = record.caller.empty() || asker.caller.empty() || asker.caller == record.caller;
  if (own || asker.administers) return absl::OkStatus();
  return contract::ErrorWithReason(
      absl::StatusCode::kPermissionDenied, "CLAIM_OF_ANOTHER",
      absl::StrCat(record.claim.name(), " was taken by '", record.caller,
                   "': only that caller, or an administrator, may renew or release it; ask them, "
                   "or wait until it expires"),
      {{"caller", record.caller}});
}

}  // namespace

Claims::Claims(SessionContext& context, ModelMemory& model)
    : context_(context),
      journal_(context.journal()),
      dependencies_(context.dependencies()),
      model_(model) {}

void Claims::Take(const v1::ClaimViewRequest& request,
                  std::function<void(absl::StatusOr<v1::ClaimViewResponse>)> done,
                  const std::string& caller, const std::stop_token& gone) {
  contract::Violations violations;
  v1::Scanner scanner;
  bool plan_known = true;
  journal_.Read([&](const SessionState& state) {
    const auto it = state.scanners.find(request.scanner());
    if (it != state.scanners.end()) scanner = it->second;
    plan_known = request.plan().empty() || state.plans.count(request.plan()) > 0;
  });
  if (scanner.name().empty()) {
    violations.Add("scanner", absl::StrCat("'", request.scanner(),
                                           "' is no scanner of this session; add it first"));
  }
  if (!plan_known) {
    violations.Add("plan", absl::StrCat("'", request.plan(), "' is no plan of this session"));
  }
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return done(valid);
  absl::StatusOr<PlanInputs> inputs =
      ReadPlanInputs(context_, model_, scanner.scanner_model_id(), {}, "");
  if (!inputs.ok()) {
    if (contract::ReasonOf(inputs.status()) != "MODEL_EMPTY") return done(inputs.status());
    inputs = PlanInputs();  // before the first scan only the place of a claim can conflict
  } else if (absl::Status room = ReserveMemory(model_, *inputs); !room.ok()) {
    return done(room);
  }
  std::shared_ptr<Evaluation> evaluation = model_.BeginEvaluation();
  if (evaluation == nullptr) {
    return done(contract::Retryable(absl::StatusCode::kResourceExhausted, "TOO_MANY_EVALUATIONS",
                                    "too many positions of this session are being evaluated",
                                    kRetryClaimAfter));
  }
  RunAsked<v1::ClaimViewResponse>(
      context_, std::move(evaluation), std::move(done),
      [this, in = *std::move(inputs), scanner, request, caller,
       gone](parallel::Parallel& parallel) -> absl::StatusOr<v1::ClaimViewResponse> {
        const EitherStop stop(gone, stop_.get_token());
        absl::StatusOr<v1::Claim> claim =
            TakeNow(request, caller, scanner, in, parallel, stop.token());
        if (absl::IsCancelled(claim.status())) {
          return gone.stop_requested() ? claim.status() : context_.Dropped();
        }
        if (!claim.ok()) return claim.status();
        v1::ClaimViewResponse response;
        *response.mutable_claim() = *std::move(claim);
        return response;
      });
}

absl::StatusOr<v1::Claim> Claims::Renew(const std::string& name, absl::Duration ttl,
                                        const RequestKey& key, const Asker& asker) {
  Expire();
  absl::StatusOr<std::string> logged =
      journal_.Execute(key, [&](const SessionState& state) -> absl::StatusOr<Draft> {
        if (absl::Status room = context_.CheckLog(); !room.ok()) return room;
        const auto it = state.claims.find(name);
        if (it == state.claims.end()) return contract::ResourceNotFound(kClaimType, name);
        if (absl::Status may = CheckMay(it->second, asker); !may.ok()) return may;
        if (!it->second.held()) return Ended(it->second);
        const absl::Time now = journal_.Now();
        fleet::Claims claims = conversion::ReadClaims(state.HeldClaims(), context_.origin());
        const absl::Status renewed = claims.Renew(name, now + ttl, now);
        if (!renewed.ok()) {
          ClaimRecord expired = it->second;
          expired.end_reason = v1::CLAIM_END_REASON_EXPIRED;
          return Ended(expired);
        }
        Draft draft;
        v1::Claim& claim = *draft.event.mutable_claim_renewed()->mutable_claim();
        claim = it->second.claim;
        *claim.mutable_expire_time() = conversion::WriteTime(now + ttl);
        return draft;
      });
  if (!logged.ok()) return logged.status();
  v1::Claim claim;
  journal_.Read([&](const SessionState& state) { claim = state.claims.at(*logged).claim; });
  WatchExpiry(claim);
  return claim;
}

absl::Status Claims::Release(const std::string& name, const RequestKey& key, const Asker& asker) {
  Expire();
  return End(name, fleet::ClaimEnd::kReleased, "", key, &asker);
}

absl::StatusOr<v1::GetClaimResponse> Claims::Get(const std::string& name) {
  Expire();
  absl::StatusOr<v1::GetClaimResponse> found = contract::ResourceNotFound(kClaimType, name);
  journal_.Read([&](const SessionState& state) {
    const auto it = state.claims.find(name);
    if (it == state.claims.end()) return;
    found.emplace();
    *found->mutable_claim() = it->second.claim;
    found->set_end_reason(it->second.end_reason);
  });
  return found;
}

absl::StatusOr<std::vector<v1::Claim>> Claims::List(absl::string_view after, size_t limit,
                                                    bool& more,
                                                    const v1::ListClaimsRequest& filter) {
  Expire();
  const absl::Time now = journal_.Now();
  std::vector<v1::Claim> claims;
  bool known = true;
  more = false;
  journal_.Read([&](const SessionState& state) {
    // The last claim of the previous page may have ended since, so its number is used.
    known = after.empty() || state.claims.count(std::string(after)) > 0;
    if (!known) return;
    // Claims are numbered in the order in which they are taken.
    const int64_t last = contract::NumberOf(after);
    for (const std::string& name : state.held_claims) {
      const v1::Claim& claim = state.claims.at(name).claim;
      if (conversion::ReadTime(claim.expire_time()) <= now || contract::NumberOf(name) <= last)
        continue;
      if (!filter.scanner().empty() && claim.scanner() != filter.scanner()) continue;
      if (claims.size() == limit) {
        more = true;
        return;
      }
      claims.push_back(claim);
    }
  });
  if (!known) return contract::UnknownPageToken();
  return claims;
}

void Claims::Expire() {
  std::vector<std::string> due;
  const absl::Time now = journal_.Now();
  journal_.Read([&](const SessionState& state) {
    due = conversion::ReadClaims(state.HeldClaims(), context_.origin()).Due(now);
  });
  for (const std::string& name : due) {
    const absl::Status ended = End(name, fleet::ClaimEnd::kExpired, "", {});
    // Another call ended or renewed it, which is as good.
    if (ended.ok() || absl::IsFailedPrecondition(ended) || absl::IsAborted(ended)) continue;
    dependencies_.log.Warning("a claim past its time could not be ended",
                              {{"claim", name}, {"error", ended.ToString()}});
  }
}

void Claims::Resume() {
  Expire();
  std::vector<v1::Claim> held;
  std::vector<std::pair<std::string, std::string>> fulfilled;
  journal_.Read([&](const SessionState& state) {
    for (const std::string& name : state.held_claims) held.push_back(state.claims.at(name).claim);
    // The server may have stopped after a scan's merge and before the end of the claim that the
    // scan fulfils.
    for (const std::string& name : state.scan_order) {
      const ScanRecord& record = state.scans.at(name);
      if (!record.in_model || !record.scan.has_pose()) continue;
      const std::string claim = FulfilledBy(state, record.scan);
      if (claim.empty()) continue;
      const absl::Time merged = conversion::ReadTime(record.scan.update_time());
      if (merged >= conversion::ReadTime(state.claims.at(claim).claim.create_time())) {
        fulfilled.emplace_back(claim, name);
      }
    }
  });
  for (const auto& [claim, scan] : fulfilled) {
    Fulfil(claim, scan).IgnoreError();
  }
  for (const v1::Claim& claim : held) WatchExpiry(claim);
}

std::string Claims::FulfilledBy(const SessionState& state, const v1::Scan& scan) const {
  const absl::Time now = journal_.Now();
  const fleet::Claims claims = conversion::ReadClaims(state.HeldClaims(), context_.origin());
  const Eigen::Isometry3d T_model_scan = conversion::ReadOwnPose(scan.pose(), context_.origin());
  const Eigen::Vector3d front = T_model_scan.linear().col(0);
  const fleet::ViewClaim* claim =
      claims.FulfilledBy(scan.scanner(), T_model_scan.translation(), fleet::ClaimRules(),
                         std::atan2(front.y(), front.x()));
  // A scan from an expired claim fulfils nothing.
  return claim != nullptr && claims.IsActive(*claim, now) ? claim->id : "";
}

absl::Status Claims::Fulfil(const std::string& claim, const std::string& scan) {
  return End(claim, fleet::ClaimEnd::kScanArrived, scan, {});
}

absl::StatusOr<Claims::Attempt> Claims::Measure(const PlanInputs& inputs,
                                                const Eigen::Vector3d& position,
                                                std::optional<double> heading,
                                                parallel::Parallel& parallel,
                                                const parallel::Cancellation& cancelled) const {
  Attempt attempt;
  std::vector<fleet::PledgedView> claimed;
  std::vector<fleet::PledgedView> made;
  journal_.Read([&](const SessionState& state) {
    attempt.held = state.held_claims;
    claimed = ClaimedViews(state, context_.origin());
    made = PendingViews(state, context_.origin());
  });
  attempt.covered.cover.by_claim.assign(claimed.size(), 0);
  if (cancelled.Requested()) return absl::CancelledError("claim");
  if (claimed.empty() || inputs.model.view == nullptr) return attempt;
  absl::StatusOr<SiteOfPlan> prior = SiteOf(model_, inputs, cancelled);
  if (!prior.ok()) return prior.status();
  absl::StatusOr<fleet::CoveredView> covered = dependencies_.algorithms.measure_cover(
      *inputs.model.view, inputs.scanner, inputs.config, position, claimed, parallel, heading, made,
      std::move(prior->site));
  if (!covered.ok()) return covered.status();
  if (cancelled.Requested()) return absl::CancelledError("claim");
  attempt.covered = *std::move(covered);
  return attempt;
}

// The best remaining view for a scanner whose claim was refused.
void Claims::AddAlternative(const v1::Scanner& scanner, PlanInputs inputs,
                            parallel::Parallel& parallel, const std::stop_token& stopped,
                            v1::ClaimConflict& conflict) const {
  if (inputs.model.view == nullptr) return;
  journal_.Read([&](const SessionState& state) {
    inputs.fleet.scanners = {
        conversion::ReadFleetMember(scanner, state.session, context_.origin())};
    inputs.fleet.pledged = ClaimedViews(state, context_.origin());
    const std::vector<fleet::PledgedView> made = PendingViews(state, context_.origin());
    inputs.fleet.pledged.insert(inputs.fleet.pledged.end(), made.begin(), made.end());
  });
  inputs.config.candidates = 1;
  const absl::StatusOr<SiteOfPlan> prior = SiteOf(model_, inputs, parallel::Cancellation(stopped));
  if (!prior.ok()) {
    conflict.set_no_alternative_message(std::string(prior.status().message()));
    return;
  }
  inputs.fleet.site = prior->site;
  parallel::Budget budget = parallel::Budget::Seconds(kAlternativeSeconds);
  budget.work_limit = kAlternativeRays;
  budget.cancelled = stopped;
  const absl::StatusOr<fleet::JointPlan> plan =
      dependencies_.algorithms.make_joint_plan(*inputs.model.view, inputs.fleet, inputs.config,
                                               budget, parallel, [](const planning::Plan&) {});
  if (!plan.ok() || plan->plan.views.empty()) {
    conflict.set_no_alternative_message(plan.ok() ? plan->plan.message
                                                  : std::string(plan.status().message()));
    return;
  }
  const planning::RankedView& best = plan->plan.views.front();
  *conflict.mutable_alternative()->mutable_position() =
      conversion::WriteVector(best.position + context_.origin());
  if (best.heading.has_value()) conflict.mutable_alternative()->set_heading_rad(*best.heading);
  if (best.model_gain.has_value()) {
    conflict.mutable_alternative()->set_model_gain_m2(*best.model_gain);
  }
  if (best.storey.has_value()) {
    *conflict.mutable_alternative()->mutable_storey() =
        conversion::WriteStorey(*best.storey, context_.origin());
    conflict.mutable_alternative()->set_floor_measured(best.floor_measured);
  }
}

absl::StatusOr<v1::Claim> Claims::TakeNow(const v1::ClaimViewRequest& request,
                                          const std::string& caller, const v1::Scanner& scanner,
                                          const PlanInputs& inputs, parallel::Parallel& parallel,
                                          const std::stop_token& stopped) {
  const Eigen::Vector3d position =
      conversion::ReadOwnVector(request.position()) - context_.origin();
  const absl::Duration ttl = conversion::ReadTtl(request);
  // Where the scanner turns all around, its heading says nothing.
  sensor::ScannerModel model;
  journal_.Read([&](const SessionState& state) {
    model = conversion::ReadFleetMember(scanner, state.session, context_.origin()).model;
  });
  std::optional<double> heading;
  if (request.has_heading_rad() && !model.TurnsAllAround()) {
    heading = request.heading_rad();
  }
  const RequestKey key = RequestKey::Of(request.request_id(), "ClaimView", request);
  for (int attempts = 0; attempts < kAttempts; ++attempts) {
    Expire();
    bool known = false;
    journal_.Read([&](const SessionState& state) { known = state.requests.count(key.id) > 0; });
    absl::StatusOr<Attempt> attempt = Attempt();
    if (!known) {
      attempt = Measure(inputs, position, heading, parallel, parallel::Cancellation(stopped));
    }
    if (!attempt.ok()) return attempt.status();
    bool again = false;
    v1::ClaimConflict refused;
    absl::StatusOr<std::string> name =
        journal_.Execute(key, [&](const SessionState& state) -> absl::StatusOr<Draft> {
          if (state.scanners.count(scanner.name()) == 0) {
            return contract::ResourceNotFound("vantage/Scanner", scanner.name());
          }
          if (state.held_claims != attempt->held) {
            again = true;  // claims were taken or ended while this one was evaluated
            return absl::AbortedError("");
          }
          if (state.claims.size() >= dependencies_.limits.claims_per_session) {
            return contract::ErrorWithReason(
                absl::StatusCode::kResourceExhausted, "CLAIMS_FULL",
                absl::StrCat("the session has had ", state.claims.size(),
                             " claims, the most it may; open another session"));
          }
          Draft draft;
          draft.caller = caller;
          v1::Claim& claim = *draft.event.mutable_claim_taken()->mutable_claim();
          claim.set_name(contract::ChildName(context_.id(), "claims",
                                             absl::StrCat("claim-", state.claims.size() + 1)));
          claim.set_scanner(scanner.name());
          *claim.mutable_position() = request.position();
          claim.set_plan(request.plan());
          if (heading.has_value()) {
            claim.set_heading_rad(*heading);
            claim.set_azimuth_span_rad(model.azimuth_span);
          }
          const absl::Time now = journal_.Now();
          *claim.mutable_create_time() = conversion::WriteTime(now);
          *claim.mutable_expire_time() = conversion::WriteTime(now + ttl);
          fleet::Claims claims = conversion::ReadClaims(state.HeldClaims(), context_.origin());
          const fleet::ViewClaim wanted{claim.name(), scanner.name(), position,          now,
                                        now + ttl,    heading,        model.azimuth_span};
          const fleet::ClaimRules rules;
          const absl::Status taken = claims.Take(wanted, attempt->covered.cover, now, rules);
          if (taken.ok()) return draft;
          if (absl::IsFailedPrecondition(taken)) again = true;  // a claim has just expired
          if (absl::IsResourceExhausted(taken)) {
            return contract::ErrorWithReason(taken.code(), "TOO_MANY_CLAIMS", taken.message());
          }
          const auto conflict = claims.Conflict(wanted, attempt->covered.cover, rules);
          if (absl::IsAlreadyExists(taken) && conflict.has_value()) {
            const fleet::ViewClaim& other = claims.held()[conflict->by];
            refused.set_claim(other.id);
            refused.set_scanner(other.scanner);
            *refused.mutable_expire_time() = conversion::WriteTime(other.expires);
            refused.set_covered_share(conflict->covered);
            refused.set_same_place(conflict->same_place);
          }
          return taken;
        });
    if (again) continue;
    if (!refused.claim().empty()) {
      std::string message = absl::StrCat(refused.scanner(), " has it: ", name.status().message());
      AddAlternative(scanner, inputs, parallel, stopped, refused);
      if (refused.has_alternative()) {
        const v1::Vector3& at = refused.alternative().position();
        absl::StrAppendFormat(&message, "; the best view that is left: %.3f,%.3f,%.3f", at.x(),
                              at.y(), at.z());
      }
      absl::Status claimed =
          contract::ErrorWithReason(absl::StatusCode::kAlreadyExists, "CLAIMED", message,
                                    {{"claim", refused.claim()}, {"scanner", refused.scanner()}});
      contract::AddDetail(claimed, refused);
      return claimed;
    }
    if (!name.ok()) return name.status();
    v1::Claim claim;
    journal_.Read([&](const SessionState& state) { claim = state.claims.at(*name).claim; });
    WatchExpiry(claim);
    return claim;
  }
  return contract::Retryable(absl::StatusCode::kResourceExhausted, "CLAIMS_BUSY",
                             "claims of this session come and go too fast; try again",
                             kRetryClaimAfter);
}

absl::Status Claims::End(const std::string& name, fleet::ClaimEnd how, const std::string& scan,
                         const RequestKey& key, const Asker* asker) {
  return journal_
      .Execute(key,
               [&](const SessionState& state) -> absl::StatusOr<Draft> {
                 const auto it = state.claims.find(name);
                 if (it == state.claims.end()) return contract::ResourceNotFound(kClaimType, name);
                 if (asker != nullptr) {
                   if (absl::Status may = CheckMay(it->second, *asker); !may.ok()) return may;
                 }
                 if (!it->second.held()) return Ended(it->second);
                 fleet::Claims claims =
                     conversion::ReadClaims(state.HeldClaims(), context_.origin());
                 const absl::Status ended = claims.End(name, how, journal_.Now());
                 if (!ended.ok()) return ended;
                 Draft draft;
                 v1::ClaimEndedEvent& event = *draft.event.mutable_claim_ended();
                 *event.mutable_claim() = it->second.claim;
                 event.set_end_reason(conversion::WriteClaimEnd(how));
                 event.set_scan(scan);
                 return draft;
               })
      .status();
}

void Claims::WatchExpiry(const v1::Claim& claim) {
  const absl::Duration left =
      std::max(conversion::ReadTime(claim.expire_time()) - journal_.Now(), absl::ZeroDuration());
  context_.After(absl::ToChronoNanoseconds(left + absl::Milliseconds(5)), [this] {
    if (context_.closed()) return;
    context_.RunInteractive([this](parallel::Parallel&) { Expire(); });
  });
}

}  // namespace vantage::session
