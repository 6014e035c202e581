#include "server/rpc/lookup.h"

#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "server/session/error.h"
#include "server/session/names.h"

namespace vantage {

absl::StatusOr<std::shared_ptr<Session>> FindSession(const TenantSessions& sessions,
                                                     const std::string& name,
                                                     absl::string_view field) {
  absl::StatusOr<std::string> id = ParseSessionName(name, field);
  if (!id.ok()) return id.status();
  return sessions.Find(*id);
}

absl::StatusOr<std::shared_ptr<Session>> FindParent(const TenantSessions& sessions,
                                                    const std::string& name,
                                                    absl::string_view collection,
                                                    absl::string_view field) {
  absl::StatusOr<ChildId> child = ParseChildName(name, collection, field);
  if (!child.ok()) return child.status();
  return sessions.Find(child->session);
}

absl::StatusOr<Page> ReadPage(int size, const std::string& token, absl::string_view list,
                              int default_size, int max_size, absl::string_view size_field,
                              absl::string_view token_field) {
  Violations violations;
  Page page;
  if (size < 0 || size > max_size) {
    violations.Add(size_field, absl::StrCat("is ", size, ", must be in [0, ", max_size, "]"));
  }
  page.limit = static_cast<size_t>(size == 0 ? default_size : size);
  if (!token.empty()) {
    std::string text;
    uint64_t skip = 0;
    std::vector<absl::string_view> parts;
    if (absl::WebSafeBase64Unescape(token, &text)) parts = absl::StrSplit(text, ':');
    if (parts.size() != 2 || parts[0] != list || !absl::SimpleAtoi(parts[1], &skip)) {
      violations.Add(token_field, "is none that this list gave; begin without one");
    }
    page.skip = skip;
  }
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  return page;
}

std::string NextPageToken(absl::string_view list, size_t skip) {
  return absl::WebSafeBase64Escape(absl::StrCat(list, ":", skip));
}

}  // namespace vantage
