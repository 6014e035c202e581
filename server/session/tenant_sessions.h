// The sessions of one caller's tenant; those of other tenants do not show.
#ifndef VANTAGE_SERVER_SESSION_TENANT_SESSIONS_H_
#define VANTAGE_SERVER_SESSION_TENANT_SESSIONS_H_

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "server/session/session_registry.h"

namespace vantage::session {

// A value; `registry` outlives it. RPCs get it instead of the registry, so that none can forget to
// check the tenant of a session.
class TenantSessions {
 public:
  // Without a tenant: all sessions, and new ones belong to no tenant. `asker`: the caller.
  TenantSessions(SessionRegistry& registry, std::optional<std::string> tenant, Asker asker = {})
      : registry_(registry), tenant_(std::move(tenant)), asker_(std::move(asker)) {}

  absl::StatusOr<std::shared_ptr<Session>> Create(const v1::CreateSessionRequest& request) const {
    return registry_.Create(request, tenant_.value_or(""));
  }
  absl::StatusOr<v1::ImportSessionResponse> Import(const v1::ImportSessionRequest& request) const {
    return registry_.Import(request, tenant_.value_or(""));
  }
  // NOT_FOUND, with the same message, for sessions of other tenants and for sessions that do not
  // exist.
  absl::StatusOr<std::shared_ptr<Session>> Find(const std::string& id) const {
    return registry_.Find(id, tenant_);
  }
  std::vector<std::shared_ptr<Session>> List(const SessionPlace& after, size_t limit, bool& more,
                                             const v1::ListSessionsRequest& filter) const {
    return registry_.List(after, limit, more, tenant_, filter);
  }
  // Returns when it was deleted.
  absl::StatusOr<absl::Time> Delete(const std::string& id, const std::string& request_id) const {
    return registry_.Delete(id, request_id, tenant_);
  }
  absl::Status CheckTakesWork() const { return registry_.CheckTakesWork(); }
  const Asker& asker() const { return asker_; }
  const contract::Limits& limits() const { return registry_.dependencies().limits; }

 private:
  SessionRegistry& registry_;
  std::optional<std::string> tenant_;
  Asker asker_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_TENANT_SESSIONS_H_
