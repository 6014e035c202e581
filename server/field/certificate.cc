#include "server/field/certificate.h"

#include <openssl/x509.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include <algorithm>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "server/field/addresses.h"
#include "server/field/x509.h"
#include "server/store/durable_file.h"

namespace vantage::field {
namespace {

// Longer than any tablet or laptop is in use.
constexpr absl::Duration kAuthorityLife = absl::Hours(24 * 3650);
// Apple's devices take 825 days at most from an authority that a person installed.
constexpr absl::Duration kCertificateLife = absl::Hours(24 * 180);
// A job in progress is not disturbed by a certificate that ends.
constexpr absl::Duration kLeftAtLeast = absl::Hours(24 * 30);
// Clocks of tablets without a network may be behind.
constexpr absl::Duration kBackdated = absl::Hours(24);
constexpr char kLocal[] = "local";
constexpr char kLocalhost[] = "localhost";

struct SigningKey {
  auth::OwnedKey key;
  auth::OwnedCertificate certificate;
};

std::string AuthorityKeyIn(const std::string& folder) { return folder + "/authority.key"; }

absl::Status Keep(const std::string& path, const std::string& text) {
  return store::ReplaceFile(path, path + ".new", text);
}

absl::Status Unusable(const std::string& path, absl::string_view what) {
  return absl::FailedPreconditionError(absl::StrCat(path, " ", what));
}

// NOT_FOUND; FAILED_PRECONDITION: others can read it.
absl::StatusOr<std::string> ReadKey(const std::string& path) {
  struct stat about {};
  if (stat(path.c_str(), &about) == 0 && (about.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    return Unusable(path,
                    "can be read by others than its owner: chmod 600 it, or, where the disk keeps "
                    "no permissions, have the data on another one (--data)");
  }
  return store::ReadWhole(path);
}

bool Signed(const SigningKey& authority, const X509& certificate) {
  return X509_verify(const_cast<X509*>(&certificate), authority.key.get()) == 1;  // NOLINT
}

// A key and a certificate that are not each other's, as a crash between the two leaves them, count
// as NOT_FOUND.
absl::StatusOr<SigningKey> ReadPair(const std::string& key_path, const std::string& path) {
  const absl::StatusOr<std::string> key = ReadKey(key_path);
  if (!key.ok()) return key.status();
  const absl::StatusOr<std::string> certificate = store::ReadWhole(path);
  if (!certificate.ok()) return certificate.status();
  SigningKey read{KeyOfPem(*key), CertificateOfPem(*certificate)};
  const char* fix = "cannot be read: move it away, and another one is made";
  if (read.key == nullptr) return Unusable(key_path, fix);
  if (read.certificate == nullptr) return Unusable(path, fix);
  if (X509_check_private_key(read.certificate.get(), read.key.get()) != 1) {
    return absl::NotFoundError(absl::StrCat(key_path, " and ", path, " do not fit"));
  }
  return read;
}

// The key first: what a crash leaves of the two does not fit together, and is made anew.
absl::Status KeepPair(const SigningKey& made, const std::string& key_path,
                      const std::string& path) {
  if (absl::Status kept = Keep(key_path, PemOf(*made.key)); !kept.ok()) return kept;
  if (absl::Status kept = Keep(path, PemOf(*made.certificate)); !kept.ok()) return kept;
  return ReadKey(key_path).status();
}

absl::StatusOr<SigningKey> MakePair(const CertificateText& text, const SigningKey* authority) {
  SigningKey made;
  absl::StatusOr<auth::OwnedKey> key = NewKey();
  if (!key.ok()) return key.status();
  made.key = *std::move(key);
  absl::StatusOr<auth::OwnedCertificate> certificate =
      Certify(text, *made.key, authority == nullptr ? *made.key : *authority->key,
              authority == nullptr ? nullptr : authority->certificate.get());
  if (!certificate.ok()) return certificate.status();
  made.certificate = *std::move(certificate);
  return made;
}

absl::StatusOr<SigningKey> MakeAuthority(const std::string& host, absl::Time now) {
  CertificateText text;
  // The day tells apart what one laptop had before and after its data were lost.
  text.common_name = absl::StrCat("Vantage field, ", host.empty() ? "a laptop" : host, ", ",
                                  absl::FormatTime("%Y-%m-%d", now, absl::UTCTimeZone()));
  text.begins = now - kBackdated;
  text.ends = now + kAuthorityLife;
  std::string names =
      absl::StrCat("critical,permitted;DNS:", kLocalhost, ",permitted;DNS:", kLocal);
  if (!host.empty()) absl::StrAppend(&names, ",permitted;DNS:", host);
  text.extensions = {{NID_basic_constraints, "critical,CA:TRUE,pathlen:0"},
                     {NID_key_usage, "critical,keyCertSign,cRLSign"},
                     {NID_subject_key_identifier, "hash"},
                     {NID_name_constraints, names}};
  return MakePair(text, nullptr);
}

// Whether the authority may sign for that name.
bool Permits(const X509& authority, const std::string& name) {
  const std::unique_ptr<NAME_CONSTRAINTS, auth::FreedBy<NAME_CONSTRAINTS_free>> constraints(
      static_cast<NAME_CONSTRAINTS*>(
          X509_get_ext_d2i(&authority, NID_name_constraints, nullptr, nullptr)));
  if (constraints == nullptr) return true;
  for (int i = 0; i < sk_GENERAL_SUBTREE_num(constraints->permittedSubtrees); ++i) {
    const GENERAL_NAME* base = sk_GENERAL_SUBTREE_value(constraints->permittedSubtrees, i)->base;
    if (base->type != GEN_DNS) continue;
    const ASN1_STRING* text = base->d.dNSName;
    const std::string permitted(
        reinterpret_cast<const char*>(ASN1_STRING_get0_data(text)),  // NOLINT
        static_cast<size_t>(ASN1_STRING_length(text)));
    if (name == permitted || absl::EndsWith(name, "." + permitted)) return true;
  }
  return false;
}

// In order of the alphabet, as NamesOf() has them.
std::vector<std::string> AllNames(const ServedNames& names, const X509& authority) {
  std::vector<std::string> all = {kLocalhost, "127.0.0.1", "::1"};
  if (!names.host.empty()) {
    // A laptop that was renamed keeps its authority, which may not sign for the new name alone.
    if (Permits(authority, names.host)) all.push_back(names.host);
    // By which networks without a name server know it (multicast DNS).
    all.push_back(absl::StrCat(names.host.substr(0, names.host.find('.')), ".", kLocal));
  }
  all.insert(all.end(), names.addresses.begin(), names.addresses.end());
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

absl::StatusOr<SigningKey> Issue(const SigningKey& authority, const std::string& host,
                                 const std::vector<std::string>& names, absl::Time now) {
  std::vector<std::string> alternative;
  alternative.reserve(names.size());
  for (const std::string& name : names) {
    alternative.push_back(absl::StrCat(CanonicalAddress(name).empty() ? "DNS:" : "IP:", name));
  }
  CertificateText text;
  text.common_name = absl::StrCat("Vantage on ", host.empty() ? "a laptop" : host);
  text.begins = now - kBackdated;
  text.ends = std::min(now + kCertificateLife, EndOf(*authority.certificate));
  text.extensions = {{NID_basic_constraints, "critical,CA:FALSE"},
                     {NID_key_usage, "critical,digitalSignature"},
                     {NID_ext_key_usage, "serverAuth"},
                     {NID_subject_alt_name, absl::StrJoin(alternative, ",")},
                     {NID_subject_key_identifier, "hash"},
                     {NID_authority_key_identifier, "keyid:always"}};
  return MakePair(text, &authority);
}

bool LastsFrom(const X509& certificate, absl::Time now) {
  return BeginOf(certificate) <= now && EndOf(certificate) - now >= kLeftAtLeast;
}

}  // namespace

std::string AuthorityIn(const std::string& folder) { return folder + "/authority.crt"; }
std::string CertificateIn(const std::string& folder) { return folder + "/server.crt"; }
std::string CertificateKeyIn(const std::string& folder) { return folder + "/server.key"; }

absl::StatusOr<ServedCertificate> KeepCertificate(const std::string& folder,
                                                  const ServedNames& names, absl::Time now) {
  ServedCertificate served;
  absl::StatusOr<SigningKey> authority = ReadPair(AuthorityKeyIn(folder), AuthorityIn(folder));
  if (!authority.ok() && !absl::IsNotFound(authority.status())) return authority.status();
  if (!authority.ok() || EndOf(*authority->certificate) - now < kLeftAtLeast) {
    authority = MakeAuthority(names.host, now);
    if (!authority.ok()) return authority.status();
    if (absl::Status kept = KeepPair(*authority, AuthorityKeyIn(folder), AuthorityIn(folder));
        !kept.ok()) {
      return kept;
    }
    served.new_authority = true;
  }
  const std::vector<std::string> all = AllNames(names, *authority->certificate);
  absl::StatusOr<SigningKey> own = ReadPair(CertificateKeyIn(folder), CertificateIn(folder));
  if (!own.ok() && !absl::IsNotFound(own.status())) return own.status();
  if (!own.ok() || !Signed(*authority, *own->certificate) || NamesOf(*own->certificate) != all ||
      !LastsFrom(*own->certificate, now)) {
    own = Issue(*authority, names.host, all, now);
    if (!own.ok()) return own.status();
    if (absl::Status kept = KeepPair(*own, CertificateKeyIn(folder), CertificateIn(folder));
        !kept.ok()) {
      return kept;
    }
    served.new_certificate = true;
  }
  served.authority_der = DerOf(*authority->certificate);
  served.authority_fingerprint = FingerprintOf(*authority->certificate);
  served.fingerprint = FingerprintOf(*own->certificate);
  served.expires = EndOf(*own->certificate);
  return served;
}

}  // namespace vantage::field
