// Finding what a request names, and pages of lists.
#ifndef VANTAGE_SERVER_RPC_HANDLERS_LOOKUP_H_
#define VANTAGE_SERVER_RPC_HANDLERS_LOOKUP_H_

#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "server/conversion/check_request.h"
#include "server/session/tenant_sessions.h"

namespace vantage::rpc {

// The session named 'sessions/{session}' in `field`.
absl::StatusOr<std::shared_ptr<session::Session>> FindSession(
    const session::TenantSessions& sessions, const std::string& name, absl::string_view field);
// The session that 'sessions/{session}/{collection}/{id}' in `field` belongs to.
absl::StatusOr<std::shared_ptr<session::Session>> FindParent(
    const session::TenantSessions& sessions, const std::string& name, absl::string_view collection,
    absl::string_view field);

// The session in which `request` asks for work, in its field `parent`, once the request is checked
// and sessions take work.
template <typename Request>
absl::StatusOr<std::shared_ptr<session::Session>> FindForWork(
    const session::TenantSessions& sessions, const Request& request) {
  absl::Status open = sessions.CheckTakesWork();
  if (!open.ok()) return open;
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(sessions, request.parent(), "parent");
  if (!session.ok()) return session.status();
  absl::Status valid = conversion::CheckRequest(request);
  if (!valid.ok()) return valid;
  return session;
}

// A page of a list in order of creation. Tokens name the entry after which the next page begins:
// scans, plans, scanners and claims by name, which stand for the same place as long as their
// session lives (SessionState), sessions by id and time of creation, since they can be deleted.
struct Page {
  std::string after;  // names the entry after which it begins; empty: it is the first
  size_t limit = 50;
};
// `size` 0 is `default_size`, and more than `max_size` is `max_size`; INVALID_ARGUMENT for a
// negative one, or for a token of another list than `list`. The list itself checks that it has an
// entry of that name.
absl::StatusOr<Page> ReadPage(int size, const std::string& token, absl::string_view list,
                              int default_size, int max_size, absl::string_view size_field,
                              absl::string_view token_field);
// A page ends where it would come to more bytes than this, however many entries were asked for;
// clients receive 4 MiB at most unless they say otherwise.
inline constexpr size_t kPageBytes = size_t{3} << 20;

// Moves entries into a page, in order, as long as they fit: the first always, since a message that
// was taken can be given. True when some are left over.
template <typename Entry, typename Entries>
bool FillPage(std::vector<Entry>&& from, Entries& page) {
  size_t bytes = 0;
  for (Entry& entry : from) {
    bytes += entry.ByteSizeLong();
    if (!page.empty() && bytes > kPageBytes) return true;
    *page.Add() = std::move(entry);
  }
  return false;
}

// The token of the page that begins after the entry `last`, which is a name that the list can find
// again.
std::string NextPageToken(absl::string_view list, absl::string_view last);

// Answers a request for a page of what a session has of a kind ("scans"), `most` entries at most,
// 50 where the request does not say. `list(session, after, limit, more)` returns the entries,
// `field(response)` is where they go.
template <typename Response, typename Request, typename List, typename Field>
absl::StatusOr<Response> ListOfSession(const session::TenantSessions& sessions,
                                       const Request& request, absl::string_view kind, int most,
                                       List list, Field field) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(sessions, request.parent(), "parent");
  if (!session.ok()) return session.status();
  const std::string name = absl::StrCat(request.parent(), "/", kind);
  absl::StatusOr<Page> page = ReadPage(request.page_size(), request.page_token(), name, 50, most,
                                       "page_size", "page_token");
  if (!page.ok()) return page.status();
  bool more = false;
  auto listed = list(**session, page->after, page->limit, more);
  if (!listed.ok()) return listed.status();
  Response response;
  auto& entries = *field(response);
  more = FillPage(*std::move(listed), entries) || more;
  if (more && !entries.empty()) {
    response.set_next_page_token(NextPageToken(name, entries.rbegin()->name()));
  }
  return response;
}

}  // namespace vantage::rpc

#endif  // VANTAGE_SERVER_RPC_HANDLERS_LOOKUP_H_
