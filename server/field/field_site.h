// What makes a server one for a site: reachable by tablets on whatever network the laptop is in,
// encrypted, and for devices that were paired alone.
#ifndef VANTAGE_SERVER_FIELD_FIELD_SITE_H_
#define VANTAGE_SERVER_FIELD_FIELD_SITE_H_

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "server/auth/access_options.h"
#include "server/field/addresses.h"
#include "server/field/certificate.h"
#include "server/field/devices.h"
#include "server/field/field_folder.h"

namespace vantage::field {

// HAProxy's, where it is in front of a server, too: whatever serves tablets is there.
inline constexpr int kDefaultPort = 7443;

struct SiteOptions {
  std::string data;     // the folder of the sessions and scans, which is there
  std::string address;  // of the page, one of this machine's; empty: all
  int port = kDefaultPort;
};

// Of one thread.
class FieldSite {
 public:
  using Network = std::function<std::vector<InterfaceAddress>()>;

  // Takes the folder, and sees to it that there are a certificate and a token for the command line
  // of this machine. INVALID_ARGUMENT: `address` is none. ALREADY_EXISTS: another server serves
  // with the folder. Else as of KeepCertificate, Devices and MakeFolder; all say what to do.
  static absl::StatusOr<std::unique_ptr<FieldSite>> Open(SiteOptions options, absl::Time now,
                                                         Network network = SystemAddresses,
                                                         std::string host = HostName());

  // What the server's options have to say of the site. The page: 'HOST:PORT'.
  void Protect(auth::AccessOptions& access) const;
  std::string page_listen() const;
  std::string socket() const { return SocketIn(folder_); }

  // The server listens: the page is there.
  absl::Status Begin(int port);

  // The addresses at which the page is, the likeliest for a tablet first; the loopback address
  // where this machine has no other.
  std::vector<InterfaceAddress> addresses() const;
  bool has_network() const { return !reachable_.empty() || !options_.address.empty(); }
  int port() const { return port_; }
  // 'https://192.168.1.5:7443', by the first of them.
  std::string page() const;
  // Where the page was when a server served before; empty: there was none.
  const std::string& page_before() const { return page_before_; }
  const ServedCertificate& certificate() const { return certificate_; }
  const std::string& laptop_token_file() const { return laptop_token_file_; }
  const std::string& folder() const { return folder_; }
  Devices& devices() { return devices_; }

  struct News {
    bool certificate = false;  // there is a new one
    bool addresses = false;    // others than before
  };
  // Looks at the network and the clock again, and does what follows.
  absl::StatusOr<News> Look(absl::Time now);

 private:
  FieldSite(SiteOptions options, Network network, std::string host);
  absl::Status Certify(absl::Time now);

  const SiteOptions options_;
  const Network network_;
  const std::string host_;
  const std::string folder_;
  Devices devices_;
  std::unique_ptr<Serving> serving_;
  std::vector<InterfaceAddress> reachable_;
  ServedCertificate certificate_;
  std::string laptop_token_file_;
  std::string page_before_;
  int port_ = 0;
};

}  // namespace vantage::field

#endif  // VANTAGE_SERVER_FIELD_FIELD_SITE_H_
