#include "server/session/rejections.h"

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {

absl::StatusOr<v1::Rejection> Rejections::Create(const v1::Rejection& wanted,
                                                 std::optional<absl::Duration> ttl,
                                                 const RequestKey& key) {
  absl::StatusOr<std::string> name =
      context_.journal().Execute(key, [&](const SessionState& state) -> absl::StatusOr<Draft> {
        if (absl::Status room = context_.CheckLog(); !room.ok()) return room;
        constexpr size_t kMaxRejections = 10'000;
        const absl::Time now = context_.journal().Now();
        if (state.RejectionsAt(conversion::WriteTime(now)).size() >= kMaxRejections) {
          return contract::ErrorWithReason(
              absl::StatusCode::kResourceExhausted, "TOO_MANY_REJECTIONS",
              "the session has too many refused places; use keep-out boxes");
        }
        Draft draft;
        v1::Rejection& rejection = *draft.event.mutable_view_rejected()->mutable_rejection();
        rejection = wanted;
        rejection.set_name(contract::ChildName(
            context_.id(), "rejections", absl::StrCat("rejection-", state.rejection_count + 1)));
        *rejection.mutable_create_time() = conversion::WriteTime(now);
        if (ttl.has_value()) {
          *rejection.mutable_expire_time() = conversion::WriteTime(now + *ttl);
        }
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
