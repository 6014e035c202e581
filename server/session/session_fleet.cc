// A session's scanners and their claims.
#include <algorithm>
#include <chrono>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "server/session/error.h"
#include "server/session/fleet_proto.h"
#include "server/session/from_proto.h"
#include "server/session/names.h"
#include "server/session/plan_inputs.h"
#include "server/session/session.h"
#include "server/session/to_proto.h"

namespace vantage {
namespace {

constexpr char kClaimType[] = "vantage.v1.Claim";
constexpr absl::Duration kDefaultTtl = absl::Minutes(30);
constexpr absl::Duration kRetryAfter = absl::Seconds(1);
constexpr int kAttempts = 8;  // to take a claim while others come and go
// What an alternative to a refused claim may cost.
constexpr double kAlternativeSeconds = 2;
constexpr uint64_t kAlternativeRays = 20'000'000;

absl::Duration TtlOf(bool given, const google::protobuf::Duration& ttl, Violations& violations) {
  if (!given) return kDefaultTtl;
  const absl::Duration asked = absl::Seconds(ttl.seconds()) + absl::Nanoseconds(ttl.nanos());
  if (!(asked >= absl::Seconds(10) && asked <= absl::Hours(24))) {
    violations.Add("ttl",
                   absl::StrCat("is ", absl::FormatDuration(asked), ", must be 10 s to 24 h"));
  }
  return asked;
}

absl::Status Ended(const ClaimRecord& record) {
  return ErrorWithReason(
      absl::StatusCode::kFailedPrecondition, "CLAIM_ENDED",
      absl::StrCat(record.claim.name(), " has ended: ", record.ended, "; claim the view again"),
      {{"ended", record.ended}});
}

}  // namespace

absl::StatusOr<v1::Scanner> Session::AddScanner(const v1::AddScannerRequest& request) {
  Violations violations;
  CheckRequestId(request.request_id(), violations);
  if (!request.has_scanner()) violations.Add("scanner", "is required");
  if (!request.scanner_id().empty() && !IsValidId(request.scanner_id())) {
    violations.Add("scanner_id",
                   "must be 1 to 63 of [a-z0-9-], start with a letter and not end in '-'");
  }
  v1::Session session;
  journal_.Read([&](const SessionState& state) { session = state.session; });
  CheckScanner(request.scanner(), session, "scanner", violations);
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  absl::StatusOr<std::string> name = journal_.Execute(
      RequestKey::Of(request.request_id(), "AddScanner", request),
      [&](const SessionState& state) -> absl::StatusOr<Draft> {
        if (state.scanners.size() >= around_.limits.scanners_per_session) {
          return ErrorWithReason(absl::StatusCode::kResourceExhausted, "TOO_MANY_SCANNERS",
                                 absl::StrCat("the session has ", state.scanners.size(),
                                              " scanners, the most it may"));
        }
        std::string id = request.scanner_id();
        for (size_t n = state.scanners.size() + 1; id.empty(); ++n) {
          const std::string candidate = absl::StrCat("scanner-", n);
          if (state.scanners.count(ChildName(id_, "scanners", candidate)) == 0) id = candidate;
        }
        Draft draft;
        v1::Scanner& scanner = *draft.event.mutable_scanner_added()->mutable_scanner();
        scanner = request.scanner();
        scanner.set_name(ChildName(id_, "scanners", id));
        if (state.scanners.count(scanner.name()) > 0) {
          return ErrorWithReason(absl::StatusCode::kAlreadyExists, "SCANNER_EXISTS",
                                 absl::StrCat(scanner.name(), " exists; choose another id"));
        }
        scanner.clear_last_pose();
        FillDefaults(scanner, state.session);
        *scanner.mutable_create_time() = WriteTime(journal_.Now());
        return draft;
      });
  if (!name.ok()) return name.status();
  v1::Scanner made;
  journal_.Read([&](const SessionState& state) { made = state.scanners.at(*name); });
  return made;
}

std::vector<v1::Scanner> Session::ListScanners(size_t skip, size_t limit, bool& more) const {
  std::vector<v1::Scanner> scanners;
  journal_.Read([&](const SessionState& state) {
    for (size_t i = skip; i < state.scanner_order.size() && scanners.size() < limit; ++i) {
      scanners.push_back(state.scanners.at(state.scanner_order[i]));
    }
    more = skip + scanners.size() < state.scanner_order.size();
  });
  return scanners;
}

std::vector<v1::Claim> Session::ListClaims(size_t skip, size_t limit, bool& more) {
  ExpireClaims();
  const absl::Time now = journal_.Now();
  std::vector<v1::Claim> claims;
  size_t holding = 0;
  journal_.Read([&](const SessionState& state) {
    for (const std::string& name : state.held_claims) {
      const v1::Claim& claim = state.claims.at(name).claim;
      if (ReadTime(claim.expire_time()) <= now) continue;
      if (holding++ >= skip && claims.size() < limit) claims.push_back(claim);
    }
  });
  more = skip + claims.size() < holding;
  return claims;
}

// What claims that hold leave of a view, as things are now.
struct Session::ClaimAttempt {
  std::vector<std::string> held;  // names
  CoveredView covered;
};

absl::StatusOr<Session::ClaimAttempt> Session::MeasureClaim(const PlanInputs& inputs,
                                                            const Eigen::Vector3d& position,
                                                            Parallel& parallel) const {
  ClaimAttempt attempt;
  std::vector<PledgedView> pledged;
  journal_.Read([&](const SessionState& state) {
    const Claims claims = ReadClaims(state.HeldClaims(), origin_);
    for (const ViewClaim& claim : claims.held()) {
      attempt.held.push_back(claim.id);
      pledged.push_back(
          {claim.position,
           ReadFleetScanner(state.scanners.at(claim.scanner), state.session, origin_).model});
    }
  });
  attempt.covered.cover.by_claim.assign(pledged.size(), 0);
  if (pledged.empty() || inputs.model.view == nullptr) return attempt;
  absl::StatusOr<CoveredView> covered = around_.algorithms.measure_cover(
      *inputs.model.view, inputs.scanner, inputs.config, position, pledged, parallel);
  if (!covered.ok()) return covered.status();
  attempt.covered = *std::move(covered);
  return attempt;
}

// The best view that is left for a scanner whose claim was refused, into the error's metadata.
void Session::AddAlternative(const v1::Scanner& scanner, PlanInputs inputs, Parallel& parallel,
                             std::map<std::string, std::string>& metadata) const {
  if (inputs.model.view == nullptr) return;
  journal_.Read([&](const SessionState& state) {
    inputs.fleet.scanners = {ReadFleetScanner(scanner, state.session, origin_)};
    const Claims claims = ReadClaims(state.HeldClaims(), origin_);
    for (const ViewClaim& claim : claims.held()) {
      inputs.fleet.pledged.push_back(
          {claim.position,
           ReadFleetScanner(state.scanners.at(claim.scanner), state.session, origin_).model});
    }
  });
  inputs.config.candidates = 1;
  Budget budget = Budget::Seconds(kAlternativeSeconds);
  budget.work_limit = kAlternativeRays;
  const absl::StatusOr<JointPlan> plan = around_.algorithms.make_joint_plan(
      *inputs.model.view, inputs.fleet, inputs.config, budget, parallel, [](const Plan&) {});
  if (!plan.ok() || plan->plan.views.empty()) {
    metadata["no_alternative"] =
        plan.ok() ? plan->plan.message : std::string(plan.status().message());
    return;
  }
  const RankedView& best = plan->plan.views.front();
  const Eigen::Vector3d at = best.position + origin_;
  metadata["alternative"] = absl::StrFormat("%.3f,%.3f,%.3f", at.x(), at.y(), at.z());
  metadata["alternative_area"] =
      absl::StrFormat("%.2f", best.score / inputs.config.required_density);
}

void Session::ClaimView(const v1::ClaimViewRequest& request,
                        std::function<void(absl::StatusOr<v1::ClaimViewResponse>)> done) {
  Violations violations;
  CheckRequestId(request.request_id(), violations);
  if (!request.has_position()) violations.Add("position", "is required");
  ReadVector(request.position(), "position", violations);
  TtlOf(request.has_ttl(), request.ttl(), violations);
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
  absl::StatusOr<PlanInputs> inputs = PlanInputsFor(scanner.scanner_model_id(), {}, "");
  if (!inputs.ok()) {
    if (ReasonOf(inputs.status()) != "MODEL_EMPTY") return done(inputs.status());
    inputs = PlanInputs();  // before the first scan only places can be taken
  } else if (absl::Status room = ReservePlan(*inputs); !room.ok()) {
    return done(room);
  }
  if (evaluations_.fetch_add(1) >= static_cast<int>(around_.limits.evaluations)) {
    evaluations_.fetch_sub(1);
    return done(Retryable(absl::StatusCode::kResourceExhausted, "TOO_MANY_EVALUATIONS",
                          "too many positions of this session are being evaluated", kRetryAfter));
  }
  RunInteractive([self = shared_from_this(), in = *std::move(inputs), scanner, request,
                  done = std::move(done)](Parallel& parallel) {
    absl::StatusOr<v1::Claim> claim = self->TakeClaim(request, scanner, in, parallel);
    self->evaluations_.fetch_sub(1);
    if (!claim.ok()) return done(claim.status());
    v1::ClaimViewResponse response;
    *response.mutable_claim() = *std::move(claim);
    done(std::move(response));
  });
}

absl::StatusOr<v1::Claim> Session::TakeClaim(const v1::ClaimViewRequest& request,
                                             const v1::Scanner& scanner, const PlanInputs& inputs,
                                             Parallel& parallel) {
  Violations checked;
  const Eigen::Vector3d position = ReadVector(request.position(), "position", checked) - origin_;
  const absl::Duration ttl = TtlOf(request.has_ttl(), request.ttl(), checked);
  const RequestKey key = RequestKey::Of(request.request_id(), "ClaimView", request);
  for (int attempts = 0; attempts < kAttempts; ++attempts) {
    ExpireClaims();
    bool known = false;
    journal_.Read([&](const SessionState& state) { known = state.requests.count(key.id) > 0; });
    absl::StatusOr<ClaimAttempt> attempt = ClaimAttempt();
    if (!known) attempt = MeasureClaim(inputs, position, parallel);
    if (!attempt.ok()) return attempt.status();
    bool again = false;
    std::map<std::string, std::string> refused;
    absl::StatusOr<std::string> name =
        journal_.Execute(key, [&](const SessionState& state) -> absl::StatusOr<Draft> {
          if (state.held_claims != attempt->held) {
            again = true;  // others came or went while this one was measured
            return absl::AbortedError("");
          }
          if (state.claims.size() >= around_.limits.claims_per_session) {
            return ErrorWithReason(absl::StatusCode::kResourceExhausted, "CLAIMS_FULL",
                                   absl::StrCat("the session has had ", state.claims.size(),
                                                " claims, the most it may; open another session"));
          }
          Draft draft;
          v1::Claim& claim = *draft.event.mutable_claim_taken()->mutable_claim();
          claim.set_name(ChildName(id_, "claims", absl::StrCat("claim-", state.claims.size() + 1)));
          claim.set_scanner(scanner.name());
          *claim.mutable_position() = request.position();
          claim.set_plan(request.plan());
          const absl::Time now = journal_.Now();
          *claim.mutable_create_time() = WriteTime(now);
          *claim.mutable_expire_time() = WriteTime(now + ttl);
          Claims claims = ReadClaims(state.HeldClaims(), origin_);
          const ViewClaim wanted{claim.name(), scanner.name(), position, now, now + ttl};
          const ClaimRules rules;
          const absl::Status taken = claims.Take(wanted, attempt->covered.cover, now, rules);
          if (taken.ok()) return draft;
          if (absl::IsFailedPrecondition(taken)) again = true;  // one has expired just now
          if (absl::IsResourceExhausted(taken)) {
            return ErrorWithReason(taken.code(), "TOO_MANY_CLAIMS", taken.message());
          }
          const auto conflict = claims.Conflict(wanted, attempt->covered.cover, rules);
          if (absl::IsAlreadyExists(taken) && conflict.has_value()) {
            const ViewClaim& other = claims.held()[conflict->by];
            refused = {{"claim", other.id},
                       {"scanner", other.scanner},
                       {"covered", absl::StrFormat("%.2f", conflict->covered)},
                       {"same_place", conflict->same_place ? "true" : "false"},
                       {"expires", absl::FormatTime(other.expires, absl::UTCTimeZone())}};
          }
          return taken;
        });
    if (again) continue;
    if (!refused.empty()) {
      const std::string message =
          absl::StrCat(refused["scanner"], " has it: ", name.status().message());
      AddAlternative(scanner, inputs, parallel, refused);
      const auto alternative = refused.find("alternative");
      return ErrorWithReason(
          absl::StatusCode::kAlreadyExists, "CLAIMED",
          alternative == refused.end()
              ? message
              : absl::StrCat(message, "; the best view that is left: ", alternative->second),
          refused);
    }
    if (!name.ok()) return name.status();
    v1::Claim claim;
    journal_.Read([&](const SessionState& state) { claim = state.claims.at(*name).claim; });
    WatchExpiry(claim);
    return claim;
  }
  return Retryable(absl::StatusCode::kResourceExhausted, "CLAIMS_BUSY",
                   "claims of this session come and go too fast; try again", kRetryAfter);
}

absl::StatusOr<v1::Claim> Session::RenewClaim(const v1::RenewClaimRequest& request) {
  Violations violations;
  CheckRequestId(request.request_id(), violations);
  const absl::Duration ttl = TtlOf(request.has_ttl(), request.ttl(), violations);
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  ExpireClaims();
  absl::StatusOr<std::string> name =
      journal_.Execute(RequestKey::Of(request.request_id(), "RenewClaim", request),
                       [&](const SessionState& state) -> absl::StatusOr<Draft> {
                         const auto it = state.claims.find(request.name());
                         if (it == state.claims.end())
                           return ResourceNotFound(kClaimType, request.name());
                         if (!it->second.held()) return Ended(it->second);
                         const absl::Time now = journal_.Now();
                         Claims claims = ReadClaims(state.HeldClaims(), origin_);
                         const absl::Status renewed = claims.Renew(request.name(), now + ttl, now);
                         if (!renewed.ok()) {
                           ClaimRecord expired = it->second;
                           expired.ended = ClaimEndName(ClaimEnd::kExpired);
                           return Ended(expired);
                         }
                         Draft draft;
                         v1::Claim& claim = *draft.event.mutable_claim_renewed()->mutable_claim();
                         claim = it->second.claim;
                         *claim.mutable_expire_time() = WriteTime(now + ttl);
                         return draft;
                       });
  if (!name.ok()) return name.status();
  v1::Claim claim;
  journal_.Read([&](const SessionState& state) { claim = state.claims.at(*name).claim; });
  WatchExpiry(claim);
  return claim;
}

absl::Status Session::ReleaseClaim(const v1::ReleaseClaimRequest& request) {
  Violations violations;
  CheckRequestId(request.request_id(), violations);
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  ExpireClaims();
  return EndClaim(request.name(), ClaimEnd::kReleased, "",
                  RequestKey::Of(request.request_id(), "ReleaseClaim", request));
}

absl::Status Session::EndClaim(const std::string& name, ClaimEnd how, const std::string& scan,
                               const RequestKey& key) {
  return journal_
      .Execute(key,
               [&](const SessionState& state) -> absl::StatusOr<Draft> {
                 const auto it = state.claims.find(name);
                 if (it == state.claims.end()) return ResourceNotFound(kClaimType, name);
                 if (!it->second.held()) return Ended(it->second);
                 Claims claims = ReadClaims(state.HeldClaims(), origin_);
                 const absl::Status ended = claims.End(name, how, journal_.Now());
                 if (!ended.ok()) return ended;
                 Draft draft;
                 v1::ClaimReleasedEvent& event = *draft.event.mutable_claim_released();
                 *event.mutable_claim() = it->second.claim;
                 event.set_reason(ClaimEndName(how));
                 event.set_scan(scan);
                 return draft;
               })
      .status();
}

void Session::ExpireClaims() {
  std::vector<std::string> due;
  const absl::Time now = journal_.Now();
  journal_.Read([&](const SessionState& state) { due = ReadClaims(state.HeldClaims(), origin_).Due(now); });
  for (const std::string& name : due) {
    const absl::Status ended = EndClaim(name, ClaimEnd::kExpired, "", {});
    // Somebody else ended or renewed it: as good.
    if (ended.ok() || absl::IsFailedPrecondition(ended) || absl::IsAborted(ended)) continue;
    around_.log.Warning("a claim past its time could not be ended",
                        {{"claim", name}, {"error", ended.ToString()}});
  }
}

void Session::WatchExpiry(const v1::Claim& claim) {
  const absl::Duration left =
      std::max(ReadTime(claim.expire_time()) - journal_.Now(), absl::ZeroDuration());
  around_.timer.After(absl::ToChronoNanoseconds(left + absl::Milliseconds(5)),
                      [weak = weak_from_this()] {
                        const std::shared_ptr<Session> session = weak.lock();
                        if (session == nullptr || session->closed_) return;
                        session->RunInteractive([session](Parallel&) { session->ExpireClaims(); });
                      });
}

std::string Session::FulfilledClaim(const SessionState& state, const v1::Scan& scan) const {
  const absl::Time now = journal_.Now();
  const Claims claims = ReadClaims(state.HeldClaims(), origin_);
  const ViewClaim* claim = claims.FulfilledBy(
      scan.scanner(), ReadOwnPose(scan.pose(), origin_).translation(), ClaimRules());
  // From a claim past its time it is a scan like any other.
  return claim != nullptr && claims.Holds(*claim, now) ? claim->id : "";
}

void Session::ResumeClaims() {
  ExpireClaims();
  std::vector<v1::Claim> held;
  std::vector<std::pair<std::string, std::string>> fulfilled;
  journal_.Read([&](const SessionState& state) {
    for (const std::string& name : state.held_claims) held.push_back(state.claims.at(name).claim);
    // The server may have stopped between a scan's merge and the end of the claim that it fulfils.
    for (const std::string& name : state.scan_order) {
      const ScanRecord& record = state.scans.at(name);
      if (!record.in_model || !record.scan.has_pose()) continue;
      const std::string claim = FulfilledClaim(state, record.scan);
      if (claim.empty()) continue;
      const absl::Time merged = ReadTime(record.scan.update_time());
      if (merged >= ReadTime(state.claims.at(claim).claim.create_time())) {
        fulfilled.emplace_back(claim, name);
      }
    }
  });
  for (const auto& [claim, scan] : fulfilled) {
    EndClaim(claim, ClaimEnd::kScanArrived, scan, {}).IgnoreError();
  }
  for (const v1::Claim& claim : held) WatchExpiry(claim);
}

absl::Status Session::AddFleet(const v1::CreatePlanRequest& request, PlanInputs& inputs) const {
  constexpr int kMostScanners = 16;
  Violations violations;
  if (request.scanners_size() > kMostScanners) {
    violations.Add("scanners", absl::StrCat("names ", request.scanners_size(), ", at most ",
                                            kMostScanners, " can be planned for together"));
  }
  if (request.scanners_size() > 0 && !request.plan().scanner_model_id().empty()) {
    violations.Add("plan.scanner_model_id",
                   "must be empty where scanners are named: each has its own");
  }
  std::set<std::string> models;
  const absl::Time now = journal_.Now();
  journal_.Read([&](const SessionState& state) {
    for (int i = 0; i < request.scanners_size(); ++i) {
      const std::string& name = request.scanners(i);
      const std::string field = absl::StrCat("scanners[", i, "]");
      const auto it = state.scanners.find(name);
      if (it == state.scanners.end()) {
        violations.Add(field, absl::StrCat("'", name, "' is no scanner of this session"));
      } else if (std::count(inputs.scanners.begin(), inputs.scanners.end(), name) > 0) {
        violations.Add(field, absl::StrCat("'", name, "' is named twice"));
      } else {
        inputs.scanners.push_back(name);
        inputs.fleet.scanners.push_back(ReadFleetScanner(it->second, state.session, origin_));
        v1::ScannerModel model = ModelOf(it->second, state.session);
        model.clear_id();  // by what it can do
        models.insert(model.SerializeAsString());
      }
    }
    const Claims claims = ReadClaims(state.HeldClaims(), origin_);
    for (const ViewClaim& claim : claims.held()) {
      const bool own =
          std::count(inputs.scanners.begin(), inputs.scanners.end(), claim.scanner) > 0;
      if (own || !claims.Holds(claim, now)) continue;
      inputs.claims.push_back(claim.id);
      inputs.fleet.pledged.push_back(
          {claim.position,
           ReadFleetScanner(state.scanners.at(claim.scanner), state.session, origin_).model});
    }
  });
  inputs.scanner_models = std::max<size_t>(1, models.size());
  for (size_t s = 0; s < inputs.fleet.scanners.size(); ++s) {
    const absl::Status possible = inputs.config.Validate(inputs.fleet.scanners[s].model);
    if (!possible.ok()) violations.Add(absl::StrCat("scanners[", s, "]"), possible.message());
  }
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  const bool by_minutes = request.plan().ranking() == v1::RANKING_GAIN_PER_MINUTE;
  if (by_minutes) inputs.fleet.ranking = FleetRanking::kGainPerMinute;
  inputs.joint = by_minutes || !inputs.fleet.scanners.empty() || !inputs.fleet.pledged.empty();
  if (inputs.joint && inputs.fleet.scanners.empty()) {
    inputs.fleet.scanners.emplace_back().model = inputs.scanner;
  }
  return absl::OkStatus();
}

}  // namespace vantage
