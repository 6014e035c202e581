// The fleet's RPCs all answer that a later release brings them.
#include "server/rpc/handlers.h"
#include "server/session/error.h"

namespace vantage::handlers {
namespace {

absl::Status Fleet() { return NotInThisRelease("fleet"); }

}  // namespace

absl::StatusOr<v1::AddScannerResponse> AddScanner(SessionRegistry&, const v1::AddScannerRequest&) {
  return Fleet();
}

absl::StatusOr<v1::ListScannersResponse> ListScanners(SessionRegistry&,
                                                      const v1::ListScannersRequest&) {
  return Fleet();
}

absl::StatusOr<v1::ClaimViewResponse> ClaimView(SessionRegistry&, const v1::ClaimViewRequest&) {
  return Fleet();
}

absl::StatusOr<v1::ReleaseClaimResponse> ReleaseClaim(SessionRegistry&,
                                                      const v1::ReleaseClaimRequest&) {
  return Fleet();
}

absl::StatusOr<v1::ListClaimsResponse> ListClaims(SessionRegistry&, const v1::ListClaimsRequest&) {
  return Fleet();
}

}  // namespace vantage::handlers
