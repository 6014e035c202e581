#include "server/session/imports.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "server/contract/error.h"

namespace vantage::session {
namespace {

constexpr absl::Duration kForgetAfter = absl::Hours(1);
// One that was idle for so long gives way to a new one.
constexpr absl::Duration kGivesWay = absl::Minutes(10);

absl::Status Gap(int64_t begins, int64_t expected) {
  return contract::ErrorWithReason(
      absl::StatusCode::kOutOfRange, "IMPORT_GAP",
      expected == 0
          ? std::string("nothing is known of what came before this piece; send the archive from "
                        "its beginning")
          : absl::StrCat("the piece begins at ", begins, ", expected is ", expected),
      {{"next_offset", absl::StrCat(expected)}});
}

}  // namespace

Imports::Imports(const SessionDependencies& dependencies)
    : dependencies_(dependencies), random_(std::random_device{}()) {}

std::map<Imports::Key, std::shared_ptr<Imports::Import>> Imports::TakeIdle(absl::Duration idle) {
  std::map<Key, std::shared_ptr<Import>> gone;
  const absl::Duration before = dependencies_.seen->Now() - idle;
  for (auto it = imports_.begin(); it != imports_.end();) {
    if (it->second->last_piece > before) {
      ++it;
    } else {
      gone.insert(*it);
      it = imports_.erase(it);
    }
  }
  return gone;
}

void Imports::Expire() {
  std::map<Key, std::shared_ptr<Import>> gone;
  const std::lock_guard<std::mutex> lock(mutex_);
  gone = TakeIdle(kForgetAfter);
}

absl::StatusOr<std::shared_ptr<Imports::Import>> Imports::Find(
    const v1::ImportSessionRequest& request, const Key& key,
    const std::shared_ptr<TenantAccount>& account) {
  std::map<Key, std::shared_ptr<Import>> gone;  // before the lock: it goes after it
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto known = imports_.find(key);
  if (known != imports_.end()) {
    known->second->last_piece = dependencies_.seen->Now();
    return known->second;
  }
  if (request.offset() != 0) return Gap(request.offset(), 0);
  const size_t most = dependencies_.limits.imports;
  if (imports_.size() >= most) gone = TakeIdle(kGivesWay);
  const auto own =
      static_cast<size_t>(std::count_if(imports_.begin(), imports_.end(), [&](const auto& entry) {
        return entry.first.first == key.first;
      }));
  // Nobody has more than what is left for all others.
  const bool shared = !key.first.empty() && imports_.size() < most && own >= most - imports_.size();
  if (imports_.size() >= most || shared) {
    return contract::Retryable(absl::StatusCode::kResourceExhausted, "TOO_MANY_IMPORTS",
                               "as many archives are coming in as may at a time",
                               absl::Seconds(10));
  }
  std::string spools = "imports/";
  for (int i = 0; i < 2; ++i) absl::StrAppend(&spools, absl::Hex(random_(), absl::kZeroPad16));
  auto import =
      std::make_shared<Import>(SessionImport::Asked{request.session_id(), key.first, key.second},
                               absl::StrCat(spools, "/"), account, dependencies_);
  import->last_piece = dependencies_.seen->Now();
  imports_[key] = import;
  return import;
}

absl::StatusOr<Imports::Taken> Imports::Take(const v1::ImportSessionRequest& request,
                                             const std::string& tenant,
                                             const std::shared_ptr<TenantAccount>& account) {
  if (request.has_crc32c() && bytes::Crc32c(request.data()) != request.crc32c()) {
    return contract::ErrorWithReason(absl::StatusCode::kDataLoss, "PIECE_DAMAGED",
                                     "the CRC-32C of data is not the one stated; send it again");
  }
  const Key key{tenant, request.request_id()};
  const absl::StatusOr<std::shared_ptr<Import>> found = Find(request, key, account);
  if (!found.ok()) return found.status();
  const std::shared_ptr<Import>& import = *found;
  Taken taken;
  absl::Status status;
  {
    const std::lock_guard<std::mutex> lock(import->mutex);
    if (import->session == nullptr) return Gap(request.offset(), 0);  // it is over meanwhile
    const auto size = static_cast<int64_t>(request.data().size());
    if (request.offset() > import->next_offset) {
      return Gap(request.offset(), import->next_offset);
    }
    // What came before is known already.
    const int64_t known = std::min(size, import->next_offset - request.offset());
    status =
        import->session->Take(absl::string_view(request.data()).substr(static_cast<size_t>(known)));
    import->next_offset += size - known;
    taken.next_offset = import->next_offset;
    if (status.ok() && !import->session->whole()) return taken;
    taken.whole = std::move(import->session);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto it = imports_.find(key);
  if (it != imports_.end() && it->second == import) imports_.erase(it);
  if (!status.ok()) return status;
  return taken;
}

}  // namespace vantage::session
