#include "server/rpc/call/authorizer.h"

#include <grpc/grpc_security_constants.h>

#include <chrono>
#include <iterator>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "absl/time/clock.h"
#include "server/auth/forwarded.h"
#include "server/auth/jwt.h"
#include "server/contract/error.h"

namespace vantage::rpc {
namespace {

constexpr char kAuthorization[] = "authorization";
constexpr absl::string_view kBearer = "bearer ";
constexpr size_t kMaxTenant = 200;
// Failures of one address: beyond this rate it is told to wait, and not every failure is logged.
constexpr double kFailuresPerSecond = 1;
constexpr double kFailuresAtOnce = 20;

absl::string_view View(const grpc::string_ref& text) { return {text.data(), text.size()}; }

// The only value of a key. INVALID_ARGUMENT when there are several, since it is not known who wrote
// which.
absl::StatusOr<std::optional<std::string>> OnlyValue(const grpc::ServerContextBase& context,
                                                     const std::string& key) {
  const auto [first, end] = context.client_metadata().equal_range(key);
  if (first == end) return std::nullopt;
  if (std::next(first) != end) {
    return absl::InvalidArgumentError(absl::StrCat("the call has several values for ", key));
  }
  return std::string(View(first->second));
}

absl::Status Unauthenticated(absl::string_view reason, absl::string_view message) {
  return contract::ErrorWithReason(absl::StatusCode::kUnauthenticated, reason, message);
}

absl::Status CheckExpiry(const std::string& name, absl::Time expires) {
  if (expires > absl::Now()) return absl::OkStatus();
  return Unauthenticated("TOKEN_EXPIRED",
                         absl::StrCat("the credential of '", name, "' expired on ",
                                      absl::FormatTime(expires, absl::UTCTimeZone())));
}

absl::Status Withdrawn(const std::string& name) {
  return Unauthenticated("CREDENTIALS_WITHDRAWN",
                         absl::StrCat("what '", name, "' showed is known no more"));
}

absl::Status JwtRefused(const absl::Status& why) {
  if (absl::IsResourceExhausted(why)) {
    return contract::Retryable(absl::StatusCode::kResourceExhausted, "RATE_LIMITED", why.message(),
                               absl::Seconds(1));
  }
  return Unauthenticated(absl::IsUnauthenticated(why) ? "TOKEN_UNKNOWN" : "TOKEN_UNFIT",
                         why.message());
}

absl::Status CheckRole(const RpcRule& rule, const std::string& name, const auth::Roles& roles) {
  if (roles.Allow(rule.needs)) return absl::OkStatus();
  return contract::ErrorWithReason(
      absl::StatusCode::kPermissionDenied, "ROLE_MISSING",
      absl::StrCat("'", name, "' may not call ", std::string(rule.method), ": that needs the role ",
                   auth::RoleName(rule.needs)),
      {{"role", auth::RoleName(rule.needs)}});
}

// 'ipv4:10.0.0.7' of 'ipv4:10.0.0.7:51234'.
std::string AddressOf(const std::string& peer) {
  return absl::StartsWith(peer, "ip") ? peer.substr(0, peer.rfind(':')) : peer;
}

// Whether it came by a socket of the file system, which only the proxy in front may open.
bool ByProxy(const Arrival& arrival) { return absl::StartsWith(arrival.peer, "unix:"); }

}  // namespace

Authorizer::Authorizer(auth::AccessOptions options, std::unique_ptr<auth::CallersFile> callers,
                       std::unique_ptr<auth::JwtIssuer> jwts, WebSeal web)
    : options_(std::move(options)),
      callers_(std::move(callers)),
      jwts_(std::move(jwts)),
      web_(std::move(web)),
      calls_(options_.calls_per_second, options_.calls_at_once),
      failures_(kFailuresPerSecond, kFailuresAtOnce) {}

absl::StatusOr<bool> Authorizer::RefreshCallers() {
  return callers_ == nullptr ? absl::StatusOr<bool>(false) : callers_->Refresh();
}

absl::StatusOr<bool> Authorizer::RefreshJwtKeys() {
  return jwts_ == nullptr ? absl::StatusOr<bool>(false) : jwts_->Refresh();
}

absl::StatusOr<std::optional<std::string>> Authorizer::NamedTenant(const Call& call) const {
  if (options_.tenant_metadata.empty()) return std::nullopt;
  absl::StatusOr<std::optional<std::string>> value =
      OnlyValue(call.context, options_.tenant_metadata);
  if (!value.ok()) return Unauthenticated("TENANT_AMBIGUOUS", value.status().message());
  if (value->has_value() && (*value)->size() > kMaxTenant) {
    return Unauthenticated("TENANT_MISSING", "the tenant's name is too long");
  }
  return value;
}

// Authorization where callers are not told apart.
absl::StatusOr<Authorizer::Identity> Authorizer::IdentifyOpenly(const Call& call) const {
  absl::StatusOr<std::optional<std::string>> named = NamedTenant(call);
  if (!named.ok()) return named.status();
  Identity identity{AddressOf(call.arrival.peer), std::nullopt, auth::Roles::All(), ""};
  for (const grpc::string_ref& name : call.context.auth_context()->GetPeerIdentity()) {
    identity.name = std::string(View(name));
  }
  if (call.arrival.certificate.has_value()) {
    const auto names = auth::CertificateNames(*call.arrival.certificate);
    if (names.ok() && !names->empty()) identity.name = names->front();
  }
  if (options_.tenant_metadata.empty()) return identity;
  identity.tenant = named->value_or("");
  if (!identity.tenant->empty()) identity.name = *identity.tenant;
  return identity;
}

// The client's address, without a port, where the proxy says it.
std::optional<std::string> Authorizer::ForwardedAddress(const Call& call) const {
  if (options_.address_metadata.empty() || !ByProxy(call.arrival)) return std::nullopt;
  const absl::StatusOr<std::optional<std::string>> told =
      OnlyValue(call.context, options_.address_metadata);
  if (!told.ok() || !told->has_value()) return std::nullopt;
  return auth::ClientAddress(**told);
}

// The names of the certificate that the client showed, here or to the proxy; nullopt: it showed
// none.
absl::StatusOr<std::optional<std::vector<std::string>>> Authorizer::CertificateNamesOf(
    const Call& call) const {
  if (!options_.certificate_metadata.empty() && ByProxy(call.arrival)) {
    const absl::StatusOr<std::optional<std::string>> passed_on =
        OnlyValue(call.context, options_.certificate_metadata);
    if (!passed_on.ok()) return passed_on.status();
    if (!passed_on->has_value()) return std::nullopt;
    absl::StatusOr<std::vector<std::string>> names = auth::CertificateNames(**passed_on);
    if (!names.ok()) return names.status();
    return *std::move(names);
  }
  if (call.arrival.certificate.has_value()) {
    absl::StatusOr<std::vector<std::string>> names =
        auth::CertificateNames(*call.arrival.certificate);
    if (!names.ok()) return names.status();
    return *std::move(names);
  }
  const std::shared_ptr<const grpc::AuthContext> peer = call.context.auth_context();
  if (!peer->IsPeerAuthenticated()) return std::nullopt;
  std::vector<std::string> names;
  for (const char* property : {GRPC_X509_SAN_PROPERTY_NAME, GRPC_X509_CN_PROPERTY_NAME}) {
    for (const grpc::string_ref& name : peer->FindPropertyValues(property)) {
      names.emplace_back(View(name));
    }
  }
  return names;
}

absl::StatusOr<auth::Caller> Authorizer::FindByToken(const auth::CallerList& list,
                                                     absl::string_view token,
                                                     const Call& call) const {
  if (const auth::Caller* known = list.ByToken(token); known != nullptr) return *known;
  if (jwts_ == nullptr || !auth::HasFormOfJwt(token)) {
    return Unauthenticated("TOKEN_UNKNOWN", "the token is none that this server knows");
  }
  absl::StatusOr<auth::Caller> caller =
      jwts_->Check(token, ForwardedAddress(call).value_or(AddressOf(call.arrival.peer)),
                   absl::Now(), std::chrono::steady_clock::now());
  if (!caller.ok()) return JwtRefused(caller.status());
  return caller;
}

// Whom the call's credentials belong to: a line of the callers file, or a JWT's subject.
absl::StatusOr<auth::Caller> Authorizer::FindCaller(const Call& call) const {
  const std::shared_ptr<const auth::CallerList> list =
      callers_ == nullptr ? std::make_shared<const auth::CallerList>() : callers_->list();
  const absl::StatusOr<std::optional<std::string>> header = OnlyValue(call.context, kAuthorization);
  if (!header.ok()) return Unauthenticated("TOKEN_UNKNOWN", header.status().message());
  if (header->has_value()) {
    const absl::string_view text = **header;
    if (!absl::EqualsIgnoreCase(text.substr(0, kBearer.size()), kBearer)) {
      return Unauthenticated("TOKEN_UNKNOWN", "authorization must be 'Bearer TOKEN'");
    }
    return FindByToken(*list, absl::StripAsciiWhitespace(text.substr(kBearer.size())), call);
  }
  const absl::StatusOr<std::optional<std::vector<std::string>>> names = CertificateNamesOf(call);
  if (!names.ok()) {
    return Unauthenticated("CERTIFICATE_INVALID",
                           absl::StrCat("the proxy's header ", options_.certificate_metadata, ": ",
                                        names.status().message()));
  }
  if (!names->has_value()) {
    return Unauthenticated("CREDENTIALS_MISSING",
                           "this server has to know who calls: send 'authorization: Bearer TOKEN'"
                           ", or connect with a certificate");
  }
  for (const std::string& name : **names) {
    const auth::Caller* known = list->ByCertificate(name);
    if (known != nullptr) return *known;
  }
  return Unauthenticated("CERTIFICATE_UNKNOWN",
                         "the certificate is in order, but none of the callers that this server "
                         "knows has it");
}

absl::StatusOr<Authorizer::Identity> Authorizer::Identify(const Call& call) const {
  if (callers_ == nullptr && jwts_ == nullptr) return IdentifyOpenly(call);
  const absl::StatusOr<auth::Caller> caller = FindCaller(call);
  if (!caller.ok()) return caller.status();
  if (absl::Status valid = CheckExpiry(caller->name, caller->expires); !valid.ok()) return valid;
  if (!caller->names_tenant) {
    return Identity{caller->name,       caller->tenant, caller->roles,
                    caller->credential, caller->by_jwt, caller->expires};
  }
  const absl::StatusOr<std::optional<std::string>> named = NamedTenant(call);
  if (!named.ok()) return named.status();
  if (named->value_or("").empty()) {
    return Unauthenticated("TENANT_MISSING",
                           absl::StrCat("'", caller->name, "' must name the tenant it calls for",
                                        options_.tenant_metadata.empty()
                                            ? ", and this server has no --tenant-metadata"
                                            : absl::StrCat(" in ", options_.tenant_metadata)));
  }
  return Identity{absl::StrCat(caller->name, "/", **named), *named, caller->roles,
                  caller->credential};
}

Admission Authorizer::Admit(const RpcRule& rule, const grpc::ServerContextBase& context) {
  const auto now = std::chrono::steady_clock::now();
  Admission admission;
  const Call call{context, web_.Read(context)};
  const std::optional<std::string> forwarded = ForwardedAddress(call);
  admission.peer = forwarded.value_or(call.arrival.peer);
  absl::StatusOr<Identity> identity = Identify(call);
  if (!identity.ok()) {
    admission.caller = forwarded.value_or(AddressOf(call.arrival.peer));
    admission.status = identity.status();
    const absl::Duration wait = failures_.Take(admission.caller, now);
    if (wait > absl::ZeroDuration()) {
      admission.status = contract::Retryable(absl::StatusCode::kResourceExhausted, "RATE_LIMITED",
                                             "too many calls without valid credentials", wait);
    }
    return admission;
  }
  admission.caller = identity->name;
  admission.tenant = std::move(identity->tenant);
  admission.credential = std::move(identity->credential);
  admission.by_jwt = identity->by_jwt;
  admission.expires = identity->expires;
  admission.administers = identity->roles.Allow(auth::Role::kAdminister);
  const absl::Duration wait = calls_.Take(admission.caller, now);
  if (wait > absl::ZeroDuration()) {
    admission.status = contract::Retryable(
        absl::StatusCode::kResourceExhausted, "RATE_LIMITED",
        absl::StrCat("more than ", options_.calls_per_second, " calls a second"), wait);
  } else {
    admission.status = CheckRole(rule, identity->name, identity->roles);
  }
  return admission;
}

absl::Status Authorizer::StillLetsIn(const RpcRule& rule, const Admission& admission) const {
  if (admission.by_jwt) {
    // The roles are in the token, which does not change.
    if (!jwts_->HasKey(admission.credential)) return Withdrawn(admission.caller);
    return CheckExpiry(admission.caller, admission.expires);
  }
  if (callers_ == nullptr || admission.credential.empty()) return absl::OkStatus();
  const std::shared_ptr<const auth::CallerList> list = callers_->list();
  const auth::Caller* caller = list->ByCredential(admission.credential);
  if (caller == nullptr || (!caller->names_tenant && caller->tenant != admission.tenant)) {
    return Withdrawn(admission.caller);
  }
  if (absl::Status valid = CheckExpiry(caller->name, caller->expires); !valid.ok()) return valid;
  return CheckRole(rule, caller->name, caller->roles);
}

}  // namespace vantage::rpc
