#include "server/field/field_site.h"

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"

namespace vantage::field {
namespace {

constexpr char kLoopback[] = "127.0.0.1";

// False where the system was told to do without IPv6. A socket of IPv6 takes IPv4, too.
bool HasIpv6() {
  const store::FileDescriptor tried(::socket(AF_INET6, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in6 any{};
  any.sin6_family = AF_INET6;
  const auto* address = reinterpret_cast<const sockaddr*>(&any);  // NOLINT: the system's way
  return tried.ok() && ::bind(tried.get(), address, sizeof any) == 0;
}

std::string Bracketed(const std::string& address) {
  return absl::StrContains(address, ':') ? absl::StrCat("[", address, "]") : address;
}

}  // namespace

FieldSite::FieldSite(SiteOptions options, Network network, std::string host)
    : options_(std::move(options)),
      network_(std::move(network)),
      host_(std::move(host)),
      folder_(FieldFolderOf(options_.data)),
      devices_(folder_),
      port_(options_.port) {}

absl::StatusOr<std::unique_ptr<FieldSite>> FieldSite::Open(SiteOptions options, absl::Time now,
                                                           Network network, std::string host) {
  if (!options.address.empty()) {
    const std::string canonical = CanonicalAddress(options.address);
    if (canonical.empty()) {
      return absl::InvalidArgumentError(
          absl::StrCat("'", options.address,
                       "' is no address: --address 192.168.1.5, or none for "
                       "all that this computer has"));
    }
    options.address = canonical;
  }
  std::unique_ptr<FieldSite> site(
      new FieldSite(std::move(options), std::move(network), std::move(host)));
  absl::StatusOr<std::unique_ptr<Serving>> serving = Serving::Begin(site->folder_);
  if (!serving.ok()) return serving.status();
  site->serving_ = *std::move(serving);
  site->page_before_ = LastPage(site->folder_);
  site->reachable_ = ReachableAddresses(site->network_());
  if (absl::Status certified = site->Certify(now); !certified.ok()) return certified;
  absl::StatusOr<std::string> token_file = site->devices_.RenewLaptop();
  if (!token_file.ok()) return token_file.status();
  site->laptop_token_file_ = *std::move(token_file);
  return site;
}

absl::Status FieldSite::Certify(absl::Time now) {
  ServedNames names{host_, {}};
  for (const InterfaceAddress& one : addresses()) names.addresses.push_back(one.address);
  absl::StatusOr<ServedCertificate> kept = KeepCertificate(folder_, names, now);
  if (!kept.ok()) return kept.status();
  certificate_ = *std::move(kept);
  return absl::OkStatus();
}

void FieldSite::Protect(auth::AccessOptions& access) const {
  access.tls_cert = CertificateIn(folder_);
  access.tls_key = CertificateKeyIn(folder_);
  access.callers_file = devices_.file();
}

std::string FieldSite::page_listen() const {
  const std::string all = HasIpv6() ? "[::]" : "0.0.0.0";
  return absl::StrCat(options_.address.empty() ? all : Bracketed(options_.address), ":", port_);
}

absl::Status FieldSite::Begin(int port) {
  port_ = port;
  return serving_->Tell(page());
}

std::vector<InterfaceAddress> FieldSite::addresses() const {
  if (!options_.address.empty()) return {{"", options_.address, true}};
  if (reachable_.empty()) return {{"", kLoopback, true}};
  return reachable_;
}

std::string FieldSite::page() const { return UrlOf(addresses().front().address, port_); }

absl::StatusOr<FieldSite::News> FieldSite::Look(absl::Time now) {
  const std::string page_of_before = page();
  std::vector<InterfaceAddress> before = std::exchange(reachable_, ReachableAddresses(network_()));
  News news;
  news.addresses = options_.address.empty() && reachable_ != before;
  absl::Status done = Certify(now);
  if (done.ok() && news.addresses) done = serving_->Tell(page());
  if (!done.ok()) {
    reachable_ = std::move(before);  // so that the next look has the same news
    return done;
  }
  news.certificate = certificate_.new_certificate;
  if (news.addresses) page_before_ = page_of_before;
  return news;
}

}  // namespace vantage::field
