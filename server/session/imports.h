// The archives that are coming in.
#ifndef VANTAGE_SERVER_SESSION_IMPORTS_H_
#define VANTAGE_SERVER_SESSION_IMPORTS_H_

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <string>
#include <utility>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server/session/session_import.h"
#include "vantage/v1/session_service.pb.h"

namespace vantage::session {

// Thread safe: pieces of one import are taken one at a time. An import lives as long as the
// process, or until nothing came of it for an hour; what it stored goes with it.
class Imports {
 public:
  explicit Imports(const SessionDependencies& dependencies);

  // What a piece came to.
  struct Taken {
    int64_t next_offset = 0;
    // Of the piece that makes the archive whole: all that is needed to make the session of it.
    std::shared_ptr<SessionImport> whole;
  };
  // Takes a piece for `tenant`; the first begins the import. OUT_OF_RANGE (IMPORT_GAP): a piece
  // before it is missing. DATA_LOSS (PIECE_DAMAGED): send it again. RESOURCE_EXHAUSTED
  // (TOO_MANY_IMPORTS). After any other error the import is over, as after the last piece.
  absl::StatusOr<Taken> Take(const v1::ImportSessionRequest& request, const std::string& tenant,
                             const std::shared_ptr<TenantAccount>& account);
  // Forgets those of which nothing came for too long.
  void Expire();

 private:
  struct Import {
    Import(SessionImport::Asked asked, std::string spools, std::shared_ptr<TenantAccount> account,
           const SessionDependencies& dependencies)
        : session(std::make_shared<SessionImport>(std::move(asked), std::move(spools),
                                                  std::move(account), dependencies)) {}
    std::mutex mutex;
    std::shared_ptr<SessionImport> session ABSL_GUARDED_BY(mutex);
    int64_t next_offset ABSL_GUARDED_BY(mutex) = 0;
    absl::Duration last_piece;  // by the time seen; guarded by Imports::mutex_
  };
  using Key = std::pair<std::string, std::string>;  // tenant and request_id

  absl::StatusOr<std::shared_ptr<Import>> Find(const v1::ImportSessionRequest& request,
                                               const Key& key,
                                               const std::shared_ptr<TenantAccount>& account);
  // Lets go of those that were idle for so long, and returns them: they end without the lock.
  std::map<Key, std::shared_ptr<Import>> TakeIdle(absl::Duration idle)
      ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const SessionDependencies& dependencies_;
  std::mutex mutex_;
  std::map<Key, std::shared_ptr<Import>> imports_ ABSL_GUARDED_BY(mutex_);
  std::mt19937_64 random_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_IMPORTS_H_
