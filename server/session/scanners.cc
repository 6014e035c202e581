#include "server/session/scanners.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "google/protobuf/util/field_mask_util.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/fleet_proto.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {
namespace {

constexpr char kScannerType[] = "vantage/Scanner";

// What of the session would be nobody's without the scanner, in words; empty: nothing.
std::string UserOf(const SessionState& state, const std::string& scanner) {
  for (const std::string& name : state.held_claims) {
    if (state.claims.at(name).claim.scanner() == scanner) {
      return absl::StrCat("it holds ", name, "; release that first");
    }
  }
  for (const auto& [name, station] : state.stations) {
    if (station.scanner() == scanner) {
      return absl::StrCat(name, " waits for its scan; send that, or delete the station, first");
    }
  }
  for (const auto& [name, upload] : state.uploads) {
    if (upload.scanner() == scanner &&
        (upload.state() == v1::UPLOAD_STATE_OPEN || upload.state() == v1::UPLOAD_STATE_READING)) {
      return absl::StrCat(name, " is under way; finish or abort it first");
    }
  }
  return "";
}

}  // namespace

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
        // Those that were deleted stay known, so that pages and scans that name them mean what they
        // meant.
        if (state.scanner_order.size() >= context_.dependencies().limits.scanners_ever) {
          return contract::ErrorWithReason(
              absl::StatusCode::kResourceExhausted, "TOO_MANY_SCANNERS",
              absl::StrCat("the session has had ", state.scanner_order.size(),
                           " scanners, the most it may; change one that it has"));
        }
        const auto taken = [&](const std::string& candidate) {
          return std::find(state.scanner_order.begin(), state.scanner_order.end(), candidate) !=
                 state.scanner_order.end();
        };
        std::string id = request.scanner_id();
        for (size_t n = state.scanner_order.size() + 1; id.empty(); ++n) {
          const std::string numbered = absl::StrCat("scanner-", n);
          if (!taken(contract::ChildName(context_.id(), "scanners", numbered))) id = numbered;
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
        if (taken(scanner.name())) {
          return contract::ErrorWithReason(
              absl::StatusCode::kAlreadyExists, "SCANNER_EXISTS",
              absl::StrCat(scanner.name(),
                           state.scanners.count(scanner.name()) > 0
                               ? " exists"
                               : " was deleted, and its id is not given again",
                           "; choose another id"));
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

absl::StatusOr<v1::Scanner> Scanners::Update(const v1::UpdateScannerRequest& request) {
  const std::string& name = request.scanner().name();
  const absl::StatusOr<std::string> updated = context_.journal().Execute(
      RequestKey::Of(request.request_id(), "UpdateScanner", request),
      [&](const SessionState& state) -> absl::StatusOr<Draft> {
        if (absl::Status room = context_.CheckLog(); !room.ok()) return room;
        const auto it = state.scanners.find(name);
        if (it == state.scanners.end()) return contract::ResourceNotFound(kScannerType, name);
        v1::Scanner next = it->second;
        google::protobuf::util::FieldMaskUtil::MergeOptions whole;
        whole.set_replace_message_fields(true);
        whole.set_replace_repeated_fields(true);
        google::protobuf::util::FieldMaskUtil::MergeMessageTo(request.scanner(),
                                                              request.update_mask(), whole, &next);
        const std::string& model = next.scanner_model_id();
        if (!model.empty() && conversion::FindModel(model, state.session) == nullptr) {
          return contract::InvalidField(
              "scanner.scanner_model_id",
              absl::StrCat("'", model, "' is none of the session's scanner models"));
        }
        conversion::FillDefaults(next, state.session);
        Draft draft;
        *draft.event.mutable_scanner_updated()->mutable_scanner() = std::move(next);
        return draft;
      });
  if (!updated.ok()) return updated.status();
  return Get(name);
}

absl::Status Scanners::Delete(const std::string& name, const RequestKey& key) {
  return context_.journal()
      .Execute(key,
               [&](const SessionState& state) -> absl::StatusOr<Draft> {
                 const auto it = state.scanners.find(name);
                 if (it == state.scanners.end()) {
                   return contract::ResourceNotFound(kScannerType, name);
                 }
                 const std::string user = UserOf(state, name);
                 if (!user.empty()) {
                   return contract::ErrorWithReason(absl::StatusCode::kFailedPrecondition,
                                                    "SCANNER_IN_USE",
                                                    absl::StrCat(name, " stays: ", user));
                 }
                 Draft draft;
                 *draft.event.mutable_scanner_deleted()->mutable_scanner() = it->second;
                 return draft;
               })
      .status();
}

absl::StatusOr<v1::Scanner> Scanners::Get(const std::string& name) const {
  absl::StatusOr<v1::Scanner> scanner = contract::ResourceNotFound(kScannerType, name);
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
    more = false;
    for (size_t i = *begin; i < state.scanner_order.size() && !more; ++i) {
      const auto scanner = state.scanners.find(state.scanner_order[i]);
      if (scanner == state.scanners.end()) continue;  // it was deleted
      more = scanners.size() == limit;
      if (!more) scanners.push_back(scanner->second);
    }
  });
  if (!begin.ok()) return begin.status();
  return scanners;
}

}  // namespace vantage::session
