#include "server/session/link_surfaces.h"

#include <cstdint>
#include <optional>
#include <utility>

namespace vantage::session {

LinkSurfaces::Surface LinkSurfaces::Find(const std::string& sha256) const {
  const auto it = kept_.find(sha256);
  return it == kept_.end() ? nullptr : it->second.surface;
}

void LinkSurfaces::Keep(const std::string& sha256, const Surface& surface, MemoryAccount* memory,
                        const std::string& tenant) {
  MemoryAccount::Reservation reservation;
  if (memory != nullptr) {
    std::optional<MemoryAccount::Reservation> spare =
        memory->TakeSpare(tenant, static_cast<int64_t>(surface->MemoryBytes()));
    if (!spare.has_value()) return;
    reservation = *std::move(spare);
  }
  kept_.insert_or_assign(sha256, Kept{surface, std::move(reservation)});
}

}  // namespace vantage::session
