#include "server/auth/jwt_issuer.h"

#include "absl/strings/str_cat.h"
#include "core/bytes/checksum.h"
#include "server/auth/guarded_file.h"
#include "server/auth/jwt.h"

namespace vantage::auth {
namespace {

// Of one address. A check takes some 0.1 ms, so an address can cost a hundredth of a core; one that
// a proxy or a router shares among many still gets good tokens through.
constexpr double kForgeriesPerSecond = 100;
constexpr double kForgeriesAtOnce = 200;
constexpr size_t kMaxChecked = 10'000;

}  // namespace

JwtIssuer::JwtIssuer(JwtOptions options)
    : options_(std::move(options)), forgeries_(kForgeriesPerSecond, kForgeriesAtOnce) {}

absl::StatusOr<std::unique_ptr<JwtIssuer>> JwtIssuer::Open(const JwtOptions& options) {
  std::unique_ptr<JwtIssuer> issuer(new JwtIssuer(options));
  const absl::StatusOr<bool> read = issuer->Refresh();
  if (!read.ok()) return read.status();
  return issuer;
}

std::shared_ptr<const JwtKeys> JwtIssuer::keys() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return keys_;
}

bool JwtIssuer::HasKey(const std::string& thumbprint) const { return keys()->Has(thumbprint); }

absl::StatusOr<Caller> JwtIssuer::Check(absl::string_view token, const std::string& address,
                                        absl::Time now, RateLimits::Time steady_now) {
  const std::string hash = bytes::Sha256::Of(token);
  std::shared_ptr<const JwtKeys> keys;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    if (const auto known = checked_.find(hash); known != checked_.end()) return known->second;
    keys = keys_;
  }
  if (forgeries_.Wait(address, steady_now) > absl::ZeroDuration()) {
    return absl::ResourceExhaustedError("too many forged tokens came from this address");
  }
  absl::StatusOr<Caller> caller = CheckJwt(token, *keys, options_, now);
  if (!caller.ok()) {
    if (absl::IsUnauthenticated(caller.status())) forgeries_.Take(address, steady_now);
    return caller;
  }
  std::lock_guard<std::mutex> lock(mutex_);
  if (keys_ != keys) return caller;  // the next call asks the new keys
  if (checked_.size() >= kMaxChecked) {
    std::erase_if(checked_, [now](const auto& one) { return one.second.expires <= now; });
    if (checked_.size() >= kMaxChecked) checked_.clear();
  }
  checked_.emplace(hash, *caller);
  return caller;
}

absl::StatusOr<bool> JwtIssuer::Refresh() {
  std::lock_guard<std::mutex> refreshing(refresh_mutex_);
  absl::StatusOr<std::string> text = ReadGuardedFile(options_.keys_file, "file of JWT keys");
  if (!text.ok()) return text.status();
  if (keys() != nullptr && *text == text_) return false;
  absl::StatusOr<JwtKeys> parsed = JwtKeys::Parse(*text);
  if (!parsed.ok()) {
    return absl::Status(parsed.status().code(),
                        absl::StrCat(options_.keys_file, ", ", parsed.status().message()));
  }
  text_ = *std::move(text);
  std::lock_guard<std::mutex> lock(mutex_);
  keys_ = std::make_shared<const JwtKeys>(*std::move(parsed));
  checked_.clear();
  return true;
}

}  // namespace vantage::auth
