// The certificate with which a laptop serves the page, and the authority that signs it: both of the
// laptop's own, made and kept in one folder. The authority stays for years, so that a tablet that
// trusts it once goes on trusting whatever certificate the laptop has.
#ifndef VANTAGE_SERVER_FIELD_CERTIFICATE_H_
#define VANTAGE_SERVER_FIELD_CERTIFICATE_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/time/time.h"

namespace vantage::field {

// What a laptop is called by those who call it.
struct ServedNames {
  std::string host;                    // as HostName() has it; empty: none
  std::vector<std::string> addresses;  // as inet_ntop writes them
};

struct ServedCertificate {
  std::string authority_der;
  std::string authority_fingerprint;  // SHA-256, 'AB:CD:...'
  std::string fingerprint;
  absl::Time expires;
  bool new_authority = false;    // none that a tablet may know was there, or it nears its end
  bool new_certificate = false;  // made by this call
};

// What is kept in `folder`: the authority, its key, the certificate, its key; PEM.
std::string AuthorityIn(const std::string& folder);
std::string CertificateIn(const std::string& folder);
std::string CertificateKeyIn(const std::string& folder);

// Sees to it that the folder holds a certificate for `names`, 'localhost' and the loopback
// addresses that is good for 30 days from `now`. One that is there stays when it is of the
// authority and for just these. The authority can sign certificates for addresses, for 'localhost',
// the names below 'local' and the host that it was made on, and for no other name: whoever got hold
// of its key could not make a tablet believe in anybody else's site. Keys are for their owner
// alone. FAILED_PRECONDITION: a key that others can read, a file that holds no key or certificate;
// the message says what to do. As of ReplaceFile (durable_file.h): they cannot be written.
absl::StatusOr<ServedCertificate> KeepCertificate(const std::string& folder,
                                                  const ServedNames& names, absl::Time now);

}  // namespace vantage::field

#endif  // VANTAGE_SERVER_FIELD_CERTIFICATE_H_
