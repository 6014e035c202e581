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

absl::StatusOr<std::vector<v1::Rejection>> Rejections::List(absl::string_view after, size_t limit,
                                                            bool& more) const {
  std::vector<v1::Rejection> rejections;
  absl::StatusOr<int64_t> last = 0;
  more = false;
  const absl::Time now = context_.journal().Now();
  context_.journal().Read([&](const SessionState& state) {
    last = NumberAfter(after, state.rejection_count);
    if (!last.ok()) return;
    for (const v1::Rejection* rejection : state.RejectionsAt(conversion::WriteTime(now))) {
      if (contract::NumberOf(rejection->name()) <= *last) continue;
      if (rejections.size() == limit) {
        more = true;
        return;
      }
      rejections.push_back(*rejection);
    }
  });
  if (!last.ok()) return last.status();
  return rejections;
}

absl::Status Rejections::Delete(const std::string& name, const RequestKey& key) {
  return context_.journal()
      .Execute(key,
               [&](const SessionState& state) -> absl::StatusOr<Draft> {
                 const absl::Time now = context_.journal().Now();
                 for (const v1::Rejection* known : state.RejectionsAt(conversion::WriteTime(now))) {
                   if (known->name() != name) continue;
                   Draft draft;
                   *draft.event.mutable_rejection_deleted()->mutable_rejection() = *known;
                   return draft;
                 }
                 return contract::ResourceNotFound("vantage/Rejection", name);
               })
      .status();
}

}  // namespace vantage::session
