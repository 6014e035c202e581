#include "server/session/tenant_memory.h"

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"

namespace vantage::session {
namespace {

constexpr absl::Duration kRetryMemoryAfter = absl::Seconds(5);

}  // namespace

absl::Status MemoryShort(int64_t bytes) {
  return contract::Retryable(absl::StatusCode::kResourceExhausted, "MEMORY_SHORT",
                             absl::StrCat("this needs some ", bytes >> 20,
                                          " MiB, and the server's memory is taken; try again"),
                             kRetryMemoryAfter);
}

absl::StatusOr<MemoryAccount::Reservation> TenantMemory::Reserve(int64_t bytes) const {
  if (account_ == nullptr) return MemoryAccount::Reservation();
  std::optional<MemoryAccount::Reservation> reservation = account_->Take(tenant_, bytes);
  if (reservation.has_value()) return *std::move(reservation);
  return MemoryShort(bytes);
}

std::optional<MemoryAccount::Reservation> TenantMemory::ReserveSpare(int64_t bytes) const {
  if (account_ == nullptr) return MemoryAccount::Reservation();
  return account_->TakeSpare(tenant_, bytes);
}

bool TenantMemory::Limited() const { return account_ != nullptr && account_->budget() > 0; }

std::optional<int64_t> TenantMemory::Most() const {
  if (!Limited()) return std::nullopt;
  return account_->Most(tenant_);
}

}  // namespace vantage::session
