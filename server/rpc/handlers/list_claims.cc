// The claims of a session.
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::ListClaimsResponse> ListClaims(const session::TenantSessions& sessions,
                                                  const v1::ListClaimsRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(sessions, request.parent(), "parent");
  if (!session.ok()) return session.status();
  const std::string list = absl::StrCat(request.parent(), "/claims");
  absl::StatusOr<Page> page = ReadPage(request.page_size(), request.page_token(), list, 50, 1000,
                                       "page_size", "page_token");
  if (!page.ok()) return page.status();
  v1::ListClaimsResponse response;
  bool more = false;
  absl::StatusOr<std::vector<v1::Claim>> claims =
      (*session)->claims().List(page->after, page->limit, more);
  if (!claims.ok()) return claims.status();
  more = FillPage(*std::move(claims), *response.mutable_claims()) || more;
  if (more && response.claims_size() > 0) {
    response.set_next_page_token(NextPageToken(list, response.claims().rbegin()->name()));
  }
  return response;
}

}  // namespace vantage::rpc::handlers
