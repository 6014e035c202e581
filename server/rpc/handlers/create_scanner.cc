// The scanners of a fleet.
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

absl::StatusOr<v1::CreateScannerResponse> CreateScanner(const session::TenantSessions& sessions,
                                                        const v1::CreateScannerRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(sessions, request.parent(), "parent");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::StatusOr<v1::Scanner> scanner = (*session)->scanners().Create(request);
  if (!scanner.ok()) return scanner.status();
  v1::CreateScannerResponse response;
  *response.mutable_scanner() = *std::move(scanner);
  return response;
}

absl::StatusOr<v1::ListScannersResponse> ListScanners(const session::TenantSessions& sessions,
                                                      const v1::ListScannersRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindSession(sessions, request.parent(), "parent");
  if (!session.ok()) return session.status();
  const std::string list = absl::StrCat(request.parent(), "/scanners");
  absl::StatusOr<Page> page = ReadPage(request.page_size(), request.page_token(), list, 50, 1000,
                                       "page_size", "page_token");
  if (!page.ok()) return page.status();
  v1::ListScannersResponse response;
  bool more = false;
  absl::StatusOr<std::vector<v1::Scanner>> scanners =
      (*session)->scanners().List(page->after, page->limit, more);
  if (!scanners.ok()) return scanners.status();
  more = FillPage(*std::move(scanners), *response.mutable_scanners()) || more;
  if (more && response.scanners_size() > 0) {
    response.set_next_page_token(NextPageToken(list, response.scanners().rbegin()->name()));
  }
  return response;
}

}  // namespace vantage::rpc::handlers
