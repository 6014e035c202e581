#include <utility>

#include "server/rpc/handlers.h"
#include "server/rpc/lookup.h"

namespace vantage::handlers {

absl::StatusOr<v1::GetScanResponse> GetScan(const TenantSessions& sessions,
                                            const v1::GetScanRequest& request) {
  absl::StatusOr<std::shared_ptr<Session>> session =
      FindParent(sessions, request.name(), "scans", "name");
  if (!session.ok()) return session.status();
  absl::StatusOr<v1::Scan> scan = (*session)->GetScan(request.name());
  if (!scan.ok()) return scan.status();
  v1::GetScanResponse response;
  *response.mutable_scan() = *std::move(scan);
  return response;
}

absl::StatusOr<v1::ListScansResponse> ListScans(const TenantSessions& sessions,
                                                const v1::ListScansRequest& request) {
  absl::StatusOr<std::shared_ptr<Session>> session =
      FindSession(sessions, request.parent(), "parent");
  if (!session.ok()) return session.status();
  absl::StatusOr<Page> page = ReadPage(request.page_size(), request.page_token(), "scans", 50, 1000,
                                       "page_size", "page_token");
  if (!page.ok()) return page.status();
  v1::ListScansResponse response;
  bool more = false;
  for (v1::Scan& scan : (*session)->ListScans(page->skip, page->limit, more)) {
    *response.add_scans() = std::move(scan);
  }
  if (more) response.set_next_page_token(NextPageToken("scans", page->skip + page->limit));
  return response;
}

}  // namespace vantage::handlers
