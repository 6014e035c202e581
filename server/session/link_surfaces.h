// What is kept of a session's scans to link others to them. Each is less than a megabyte; where the
// server has no memory to spare for it, it is made anew from the stored scan.
#ifndef VANTAGE_SERVER_SESSION_LINK_SURFACES_H_
#define VANTAGE_SERVER_SESSION_LINK_SURFACES_H_

#include <map>
#include <memory>
#include <string>

#include "core/registration/graph/link.h"
#include "server/session/memory_account.h"

namespace vantage::session {

// Used on the strand.
class LinkSurfaces {
 public:
  using Surface = std::shared_ptr<const registration::LinkSurface>;

  // That of these samples of a scan, by the SHA-256 of its range image; null: it is not kept.
  Surface Find(const std::string& sha256) const;
  // Keeps it, if there is memory to spare. `memory` may be null: no limit.
  void Keep(const std::string& sha256, const Surface& surface, MemoryAccount* memory,
            const std::string& tenant);
  void Drop(const std::string& sha256) { kept_.erase(sha256); }
  void Clear() { kept_.clear(); }

 private:
  struct Kept {
    Surface surface;
    MemoryAccount::Reservation reservation;
  };
  std::map<std::string, Kept> kept_;
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_LINK_SURFACES_H_
