// What 'vantaged field' tells the person in front of the laptop.
#ifndef VANTAGE_SERVER_FIELD_GREETING_H_
#define VANTAGE_SERVER_FIELD_GREETING_H_

#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include "absl/time/time.h"
#include "server/field/devices.h"
#include "server/field/field_site.h"

namespace vantage::field {

// The link that pairs a device: behind '#', which browsers send to nobody.
std::string PairingLink(const std::string& page, const std::string& token);

// The link of a device, and its QR code where `code` is set.
std::string PairingText(const std::string& name, const std::string& link, bool code);

// Where the page is, and where it is no more.
std::string AddressText(const FieldSite& site, const std::string& command);

// How a tablet comes to trust the certificate.
std::string TrustText(const FieldSite& site);

// How the devices are looked after, and how this computer's own command line calls; `command` is
// how 'vantaged field' was called with what other calls need, too ('vantaged field --data DIR').
std::string CommandText(const FieldSite& site, const std::vector<Device>& devices,
                        const std::string& command);

// The devices as a table.
std::string DeviceTable(const std::vector<Device>& devices, absl::Time now);

// An argument as a shell takes it.
std::string ShellQuoted(const std::string& argument);

}  // namespace vantage::field

#endif  // VANTAGE_SERVER_FIELD_GREETING_H_
