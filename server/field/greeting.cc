#include "server/field/greeting.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"
#include "server/field/qr_code.h"

namespace vantage::field {
namespace {

constexpr int kIndent = 2;

absl::string_view MediumName(Medium medium) {
  switch (medium) {
    case Medium::kWireless:
      return "wireless";
    case Medium::kWired:
      return "wired";
    case Medium::kVirtual:
      return "virtual";
  }
  return "";
}

std::string DayOf(absl::Time time) {
  return absl::FormatTime("%Y-%m-%d", time, absl::LocalTimeZone());
}

}  // namespace

std::string PairingLink(const std::string& page, const std::string& token) {
  return absl::StrCat(page, "/#token=", token);
}

std::string PairingText(const std::string& name, const std::string& link, bool code) {
  std::string text = absl::StrCat("Pair ", name, ", and no other device, with this link",
                                  code ? " (its camera reads the code)" : "", ":\n\n");
  if (code) {
    if (const absl::StatusOr<QrModules> modules = EncodeQr(link); modules.ok()) {
      absl::StrAppend(&text, DrawQr(*modules, kIndent), "\n");
    }
  }
  absl::StrAppend(&text, "  ", link, "\n\nWhoever has the link can work on the jobs here.\n");
  return text;
}

std::string AddressText(const FieldSite& site, const std::string& command) {
  std::string text = "The page for tablets is at\n\n";
  // Where it was for this computer alone, no tablet was paired.
  bool moved =
      !site.page_before().empty() && !absl::StartsWith(site.page_before(), "https://127.0.0.1:");
  for (const InterfaceAddress& one : site.addresses()) {
    const std::string url = UrlOf(one.address, site.port());
    moved = moved && url != site.page_before();
    if (one.interface.empty()) {
      absl::StrAppend(&text, "  ", url, "/\n");
    } else {
      absl::StrAppendFormat(&text, "  %-40s  %s, %s\n", url + "/", one.interface,
                            MediumName(one.medium));
    }
  }
  if (!site.has_network()) {
    absl::StrAppend(
        &text,
        "\nThis computer has no network, so the page is for a browser on it alone. Join a Wi-Fi, or"
        "\nopen a hotspot (nmcli device wifi hotspot): its address is shown here within 5 s.\n");
  }
  if (moved) {
    absl::StrAppend(&text, "\nBefore, it was at ", site.page_before(),
                    "/: devices that were paired there are paired\nanew here, with '", command,
                    " pair NAME --replace'.\n");
  }
  return text;
}

std::string TrustText(const FieldSite& site) {
  const ServedCertificate& certificate = site.certificate();
  return absl::StrCat(
      certificate.new_authority ? "A tablet warns that it does not know this computer. Go on past "
                                  "the warning, or have it\n"
                                  "trust this computer for good: open and install\n\n  "
                                : "A tablet that does not know this computer warns; where it is to "
                                  "trust it for good, open"
                                  " and\ninstall\n\n  ",
      site.page(), "/authority.crt\n\nEither way, compare (SHA-256):\n\n  certificate  ",
      certificate.fingerprint, "\n  authority    ", certificate.authority_fingerprint, "\n");
}

std::string CommandText(const FieldSite& site, const std::vector<Device>& devices,
                        const std::string& command) {
  std::string known;
  for (const Device& device : devices) {
    absl::StrAppend(&known, known.empty() ? "" : ", ", device.name);
  }
  return absl::StrCat(
      "From another terminal:\n\n  ", command, " pair NAME       # one more tablet\n  ", command,
      " devices         # ", known.empty() ? "none is paired yet" : absl::StrCat("paired: ", known),
      "\n  ", command, " revoke NAME     # a tablet that was lost\n  vantage --server ",
      ShellQuoted(site.socket()), " --token-file ", ShellQuoted(site.laptop_token_file()),
      " session list\n");
}

std::string DeviceTable(const std::vector<Device>& devices, absl::Time now) {
  if (devices.empty()) return "no device is paired\n";
  size_t widest = 0;
  for (const Device& device : devices) widest = std::max(widest, device.name.size());
  std::string table;
  for (const Device& device : devices) {
    absl::StrAppendFormat(
        &table, "%-*s  %s  %s\n", static_cast<int>(widest), device.name, device.roles,
        device.expires == absl::InfiniteFuture()
            ? "for ever"
            : absl::StrCat(device.expires <= now ? "expired " : "until ", DayOf(device.expires)));
  }
  return table;
}

std::string ShellQuoted(const std::string& argument) {
  const bool plain = !argument.empty() && std::all_of(argument.begin(), argument.end(), [](char c) {
    return absl::ascii_isalnum(c) || absl::StrContains("-_./:=@%+,", absl::string_view(&c, 1));
  });
  return plain ? argument : absl::StrCat("'", absl::StrReplaceAll(argument, {{"'", "'\\''"}}), "'");
}

}  // namespace vantage::field
