#include <utility>

#include "server/rpc/handlers.h"
#include "server/rpc/lookup.h"

namespace vantage::handlers {

absl::StatusOr<v1::GetSessionResponse> GetSession(const TenantSessions& sessions,
                                                  const v1::GetSessionRequest& request) {
  absl::StatusOr<std::shared_ptr<Session>> session = FindSession(sessions, request.name(), "name");
  if (!session.ok()) return session.status();
  v1::GetSessionResponse response;
  *response.mutable_session() = (*session)->Describe();
  return response;
}

absl::StatusOr<v1::ListSessionsResponse> ListSessions(const TenantSessions& sessions,
                                                      const v1::ListSessionsRequest& request) {
  absl::StatusOr<Page> page = ReadPage(request.page_size(), request.page_token(), "sessions", 50,
                                       1000, "page_size", "page_token");
  if (!page.ok()) return page.status();
  v1::ListSessionsResponse response;
  bool more = false;
  for (const std::shared_ptr<Session>& session : sessions.List(page->skip, page->limit, more)) {
    *response.add_sessions() = session->Describe();
  }
  if (more) response.set_next_page_token(NextPageToken("sessions", page->skip + page->limit));
  return response;
}

}  // namespace vantage::handlers
