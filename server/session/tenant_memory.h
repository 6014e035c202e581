// The server's memory account as one tenant's sessions have it.
#ifndef VANTAGE_SERVER_SESSION_TENANT_MEMORY_H_
#define VANTAGE_SERVER_SESSION_TENANT_MEMORY_H_

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "absl/status/statusor.h"
#include "server/session/memory_account.h"

namespace vantage::session {

// Thread safe.
class TenantMemory {
 public:
  // `account` outlives this; null: there is no limit.
  TenantMemory(MemoryAccount* account, std::string tenant)
      : account_(account), tenant_(std::move(tenant)) {}

  // RESOURCE_EXHAUSTED (MEMORY_SHORT).
  absl::StatusOr<MemoryAccount::Reservation> Reserve(int64_t bytes) const;
  // Of memory that nobody is likely to miss, for what nobody asked for yet; nothing where there is
  // too little.
  std::optional<MemoryAccount::Reservation> ReserveSpare(int64_t bytes) const;
  // Whether anything limits what may be reserved.
  bool Limited() const;
  // The most that can ever be had beside something else, bytes; nothing where there is no limit.
  std::optional<int64_t> Most() const;

 private:
  MemoryAccount* const account_;
  const std::string tenant_;
};

// RESOURCE_EXHAUSTED (MEMORY_SHORT): so many bytes are not free now.
absl::Status MemoryShort(int64_t bytes);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_TENANT_MEMORY_H_
