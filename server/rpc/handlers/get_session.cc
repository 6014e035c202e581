#include <string>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/time/time.h"
#include "server/contract/error.h"
#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {
namespace {

// The session after which a page begins: its id, and its time of creation in case it was deleted
// meanwhile.
bool ReadPlace(const std::string& text, session::SessionPlace& place) {
  const std::vector<std::string> parts = absl::StrSplit(text, ':');
  int64_t created = 0;
  if (parts.size() != 2 || !absl::SimpleAtoi(parts[1], &created)) return false;
  place = {parts[0], absl::FromUnixNanos(created)};
  return true;
}

}  // namespace

absl::StatusOr<v1::GetSessionResponse> GetSession(const session::TenantSessions& sessions,
                                                  const v1::GetSessionRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(sessions, request.name(), "name");
  if (!session.ok()) return session.status();
  v1::GetSessionResponse response;
  *response.mutable_session() = (*session)->DescribeWithRejections();
  return response;
}

absl::StatusOr<v1::ListSessionsResponse> ListSessions(const session::TenantSessions& sessions,
                                                      const v1::ListSessionsRequest& request) {
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::StatusOr<Page> page = ReadPage(request.page_size(), request.page_token(), "sessions", 50,
                                       1000, "page_size", "page_token");
  if (!page.ok()) return page.status();
  session::SessionPlace after;
  if (!page->after.empty() && !ReadPlace(page->after, after)) {
    return contract::UnknownPageToken();
  }
  v1::ListSessionsResponse response;
  bool more = false;
  const std::vector<std::shared_ptr<session::Session>> listed =
      sessions.List(after, page->limit, more, request);
  size_t bytes = 0;
  std::string last;
  for (const std::shared_ptr<session::Session>& session : listed) {
    v1::Session described = session->Describe();
    bytes += described.ByteSizeLong();
    if (!last.empty() && bytes > kPageBytes) {
      more = true;
      break;
    }
    *response.add_sessions() = std::move(described);
    last = absl::StrCat(session->id(), ":", absl::ToUnixNanos(session->created()));
  }
  if (more && !last.empty()) response.set_next_page_token(NextPageToken("sessions", last));
  return response;
}

}  // namespace vantage::rpc::handlers
