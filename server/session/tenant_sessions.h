// The sessions as one caller sees them: its tenant's, and no trace of others.
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

// A value; `registry` outlives it. What RPCs get instead of the registry, so that none can forget
// to ask whose a session is.
class TenantSessions {
 public:
  // Without a tenant: all sessions, and new ones are nobody's.
  TenantSessions(SessionRegistry& registry, std::optional<std::string> tenant)
      : registry_(registry), tenant_(std::move(tenant)) {}

  absl::StatusOr<std::shared_ptr<Session>> Create(const v1::CreateSessionRequest& request) const {
    return registry_.Create(request, tenant_.value_or(""));
  }
  // NOT_FOUND, in the same words, for those of others and those that don't exist.
  absl::StatusOr<std::shared_ptr<Session>> Find(const std::string& id) const {
    return registry_.Find(id, tenant_);
  }
  std::vector<std::shared_ptr<Session>> List(const SessionPlace& after, size_t limit,
                                             bool& more) const {
    return registry_.List(after, limit, more, tenant_);
  }
  absl::Status Delete(const v1::DeleteSessionRequest& request) const {
    return registry_.Delete(request, tenant_);
  }
  absl::Status CheckTakesWork() const { return registry_.CheckTakesWork(); }

 private:
  SessionRegistry& registry_;
  std::optional<std::string> tenant_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_TENANT_SESSIONS_H_
