#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::GetScanResponse> GetScan(const session::TenantSessions& sessions,
                                            const v1::GetScanRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "scans", "name");
  if (!session.ok()) return session.status();
  absl::StatusOr<v1::Scan> scan = (*session)->scans().Get(request.name());
  if (!scan.ok()) return scan.status();
  v1::GetScanResponse response;
  *response.mutable_scan() = *std::move(scan);
  return response;
}

absl::StatusOr<v1::ListScansResponse> ListScans(const session::TenantSessions& sessions,
                                                const v1::ListScansRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(sessions, request.parent(), "parent");
  if (!session.ok()) return session.status();
  const std::string list = absl::StrCat(request.parent(), "/scans");
  absl::StatusOr<Page> page = ReadPage(request.page_size(), request.page_token(), list, 50, 1000,
                                       "page_size", "page_token");
  if (!page.ok()) return page.status();
  v1::ListScansResponse response;
  bool more = false;
  absl::StatusOr<std::vector<v1::Scan>> scans =
      (*session)->scans().List(page->after, page->limit, more);
  if (!scans.ok()) return scans.status();
  more = FillPage(*std::move(scans), *response.mutable_scans()) || more;
  if (more && response.scans_size() > 0) {
    response.set_next_page_token(NextPageToken(list, response.scans().rbegin()->name()));
  }
  return response;
}

}  // namespace vantage::rpc::handlers
