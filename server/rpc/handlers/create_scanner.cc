// The scanners of a fleet.
#include <utility>

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

absl::StatusOr<v1::UpdateScannerResponse> UpdateScanner(const session::TenantSessions& sessions,
                                                        const v1::UpdateScannerRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.scanner().name(), "scanners", "scanner.name");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::StatusOr<v1::Scanner> scanner = (*session)->scanners().Update(request);
  if (!scanner.ok()) return scanner.status();
  v1::UpdateScannerResponse response;
  *response.mutable_scanner() = *std::move(scanner);
  return response;
}

absl::StatusOr<v1::DeleteScannerResponse> DeleteScanner(const session::TenantSessions& sessions,
                                                        const v1::DeleteScannerRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "scanners", "name");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  absl::Status deleted = (*session)->scanners().Delete(
      request.name(), session::RequestKey::Of(request.request_id(), "DeleteScanner", request));
  if (!deleted.ok()) return deleted;
  return v1::DeleteScannerResponse();
}

absl::StatusOr<v1::GetScannerResponse> GetScanner(const session::TenantSessions& sessions,
                                                  const v1::GetScannerRequest& request) {
  absl::StatusOr<std::shared_ptr<session::Session>> session =
      FindParent(sessions, request.name(), "scanners", "name");
  if (!session.ok()) return session.status();
  absl::StatusOr<v1::Scanner> scanner = (*session)->scanners().Get(request.name());
  if (!scanner.ok()) return scanner.status();
  v1::GetScannerResponse response;
  *response.mutable_scanner() = *std::move(scanner);
  return response;
}

absl::StatusOr<v1::ListScannersResponse> ListScanners(const session::TenantSessions& sessions,
                                                      const v1::ListScannersRequest& request) {
  return ListOfSession<v1::ListScannersResponse>(
      sessions, request, "scanners", 1000,
      [](session::Session& session, const std::string& after, size_t limit, bool& more) {
        return session.scanners().List(after, limit, more);
      },
      [](v1::ListScannersResponse& response) { return response.mutable_scanners(); });
}

}  // namespace vantage::rpc::handlers
