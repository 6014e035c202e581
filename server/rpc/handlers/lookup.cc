#include "server/rpc/handlers/lookup.h"

#include <algorithm>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"

namespace vantage::rpc {

absl::StatusOr<std::shared_ptr<session::Session>> FindSession(
    const session::TenantSessions& sessions, const std::string& name, absl::string_view field) {
  absl::StatusOr<std::string> id = contract::ParseSessionName(name, field);
  if (!id.ok()) return id.status();
  return sessions.Find(*id);
}

absl::StatusOr<std::shared_ptr<session::Session>> FindParent(
    const session::TenantSessions& sessions, const std::string& name, absl::string_view collection,
    absl::string_view field) {
  absl::StatusOr<contract::ChildId> child = contract::ParseChildName(name, collection, field);
  if (!child.ok()) return child.status();
  return sessions.Find(child->session);
}

absl::StatusOr<Page> ReadPage(int size, const std::string& token, absl::string_view list,
                              int default_size, int max_size, absl::string_view size_field,
                              absl::string_view token_field) {
  contract::Violations violations;
  Page page;
  if (size < 0) violations.Add(size_field, absl::StrCat("is ", size, ", must not be negative"));
  page.limit = static_cast<size_t>(size == 0 ? default_size : std::clamp(size, 0, max_size));
  if (!token.empty()) {
    std::string text;
    absl::string_view rest;
    if (absl::WebSafeBase64Unescape(token, &text)) rest = text;
    if (!absl::ConsumePrefix(&rest, list) || !absl::ConsumePrefix(&rest, "\n") || rest.empty()) {
      violations.Add(token_field, "is none that this list gave; begin without one");
    }
    page.after = std::string(rest);
  }
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  return page;
}

std::string NextPageToken(absl::string_view list, absl::string_view last) {
  return absl::WebSafeBase64Escape(absl::StrCat(list, "\n", last));
}

}  // namespace vantage::rpc
