#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/conversion/check_request.h"
#include "server/rpc/handlers/handlers.h"
#include "server/rpc/handlers/lookup.h"

namespace vantage::rpc::handlers {

void SetSitePrior(const session::TenantSessions& sessions, const v1::SetSitePriorRequest& request,
                  std::function<void(absl::StatusOr<v1::SetSitePriorResponse>)> done) {
  const auto session = FindForWork(sessions, request);
  if (!session.ok()) return done(session.status());
  session::PriorSource source;
  if (const std::string& other = request.site_prior().source_session(); !other.empty()) {
    const auto found = FindSession(sessions, other, "site_prior.source_session");
    if (!found.ok()) return done(found.status());
    source = {(*found)->model().Current().view, (*found)->origin()};
    if (source.view == nullptr) return done((*found)->model().WhyNone());
  }
  (*session)->site_priors().Set(request, std::move(source), std::move(done));
}

void GetSitePrior(const session::TenantSessions& sessions, const v1::GetSitePriorRequest& request,
                  const std::stop_token& gone,
                  std::function<void(absl::StatusOr<v1::GetSitePriorResponse>)> done) {
  const auto session = FindSession(sessions, request.parent(), "parent");
  if (!session.ok()) return done(session.status());
  (*session)->site_priors().Describe(request, std::move(done), gone);
}

absl::StatusOr<v1::ClearSitePriorResponse> ClearSitePrior(
    const session::TenantSessions& sessions, const v1::ClearSitePriorRequest& request) {
  const auto session = FindSession(sessions, request.parent(), "parent");
  if (!session.ok()) return session.status();
  if (absl::Status valid = conversion::CheckRequest(request); !valid.ok()) return valid;
  if (absl::Status cleared = (*session)->site_priors().Clear(request); !cleared.ok()) {
    return cleared;
  }
  return v1::ClearSitePriorResponse();
}

}  // namespace vantage::rpc::handlers
