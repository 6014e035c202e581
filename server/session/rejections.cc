#include "server/session/rejections.h"

#include "absl/strings/str_cat.h"
#include "absl/time/time.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {
namespace {

constexpr double kDefaultRejectionRadius = 0.5;  // m
constexpr size_t kMaxReason = 500;

}  // namespace

absl::StatusOr<v1::Rejection> Rejections::Create(const v1::RejectViewRequest& request) {
  contract::Violations violations;
  conversion::CheckRequestId(request.request_id(), violations);
  if (!request.has_position()) violations.Add("position", "is required");
  conversion::ReadVector(request.position(), "position", violations);
  const double radius = request.has_radius_m() ? request.radius_m() : kDefaultRejectionRadius;
  if (!(radius > 0 && radius <= 100)) {
    violations.Add("radius_m", absl::StrCat("is ", radius, " m, must be in (0, 100]"));
  }
  conversion::CheckText(request.reason(), kMaxReason, "reason", violations);
  constexpr double kTenYears = 10 * 366 * 86400.0;
  const double ttl = conversion::ReadDuration(request.ttl());
  if (request.has_ttl() && !(ttl >= 1 && ttl <= kTenYears)) {
    violations.Add("ttl", absl::StrCat("is ", ttl, " s, must be 1 s to 10 years"));
  }
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  absl::StatusOr<std::string> name = context_.journal().Execute(
      RequestKey::Of(request.request_id(), "RejectView", request),
      [&](const SessionState& state) -> absl::StatusOr<Draft> {
        constexpr size_t kMaxRejections = 10'000;
        const absl::Time now = context_.journal().Now();
        if (state.RejectionsAt(conversion::WriteTime(now)).size() >= kMaxRejections) {
          return contract::ErrorWithReason(
              absl::StatusCode::kResourceExhausted, "TOO_MANY_REJECTIONS",
              "the session has too many refused places; use keep-out boxes");
        }
        Draft draft;
        v1::Rejection& rejection = *draft.event.mutable_view_rejected()->mutable_rejection();
        rejection.set_name(contract::ChildName(
            context_.id(), "rejections", absl::StrCat("rejection-", state.rejection_count + 1)));
        *rejection.mutable_position() = request.position();
        rejection.set_radius_m(radius);
        rejection.set_reason(request.reason());
        *rejection.mutable_create_time() = conversion::WriteTime(now);
        if (request.has_ttl())
          *rejection.mutable_expire_time() = conversion::WriteTime(now + absl::Seconds(ttl));
        return draft;
      });
  if (!name.ok()) return name.status();
  v1::Rejection made;
  context_.journal().Read([&](const SessionState& state) {
    for (const v1::Rejection& rejection : state.rejections) {
      if (rejection.name() == *name) made = rejection;
    }
  });
  return made;
}

}  // namespace vantage::session
