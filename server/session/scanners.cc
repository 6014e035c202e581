#include "server/session/scanners.h"

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/fleet_proto.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {

absl::StatusOr<v1::Scanner> Scanners::Create(const v1::CreateScannerRequest& request) {
  absl::StatusOr<std::string> name = context_.journal().Execute(
      RequestKey::Of(request.request_id(), "CreateScanner", request),
      [&](const SessionState& state) -> absl::StatusOr<Draft> {
        if (state.scanners.size() >= context_.dependencies().limits.scanners_per_session) {
          return contract::ErrorWithReason(absl::StatusCode::kResourceExhausted,
                                           "TOO_MANY_SCANNERS",
                                           absl::StrCat("the session has ", state.scanners.size(),
                                                        " scanners, the most it may"));
        }
        std::string id = request.scanner_id();
        for (size_t n = state.scanners.size() + 1; id.empty(); ++n) {
          const std::string candidate = absl::StrCat("scanner-", n);
          if (state.scanners.count(contract::ChildName(context_.id(), "scanners", candidate)) == 0)
            id = candidate;
        }
        const std::string& model = request.scanner().scanner_model_id();
        if (!model.empty() && conversion::FindModel(model, state.session) == nullptr) {
          return contract::InvalidField(
              "scanner.scanner_model_id",
              absl::StrCat("'", model, "' is none of the session's scanner models"));
        }
        Draft draft;
        v1::Scanner& scanner = *draft.event.mutable_scanner_created()->mutable_scanner();
        scanner = request.scanner();
        scanner.set_name(contract::ChildName(context_.id(), "scanners", id));
        if (state.scanners.count(scanner.name()) > 0) {
          return contract::ErrorWithReason(
              absl::StatusCode::kAlreadyExists, "SCANNER_EXISTS",
              absl::StrCat(scanner.name(), " exists; choose another id"));
        }
        scanner.clear_last_pose();
        conversion::FillDefaults(scanner, state.session);
        *scanner.mutable_create_time() = conversion::WriteTime(context_.journal().Now());
        return draft;
      });
  if (!name.ok()) return name.status();
  v1::Scanner made;
  context_.journal().Read([&](const SessionState& state) { made = state.scanners.at(*name); });
  return made;
}

absl::StatusOr<v1::Scanner> Scanners::Get(const std::string& name) const {
  absl::StatusOr<v1::Scanner> scanner = contract::ResourceNotFound("vantage/Scanner", name);
  context_.journal().Read([&](const SessionState& state) {
    const auto it = state.scanners.find(name);
    if (it != state.scanners.end()) scanner = it->second;
  });
  return scanner;
}

absl::StatusOr<std::vector<v1::Scanner>> Scanners::List(absl::string_view after, size_t limit,
                                                        bool& more) const {
  std::vector<v1::Scanner> scanners;
  absl::StatusOr<size_t> begin = 0;
  context_.journal().Read([&](const SessionState& state) {
    begin = PlaceAfter(state.scanner_order, after);
    if (!begin.ok()) return;
    for (size_t i = *begin; i < state.scanner_order.size() && scanners.size() < limit; ++i) {
      scanners.push_back(state.scanners.at(state.scanner_order[i]));
    }
    more = *begin + scanners.size() < state.scanner_order.size();
  });
  if (!begin.ok()) return begin.status();
  return scanners;
}

}  // namespace vantage::session
