// The devices that may call a laptop's server: each with a token of its own, which can be taken
// back. Kept as lines of a callers file (server/auth/callers.h), which the running server reads
// again when it changes; of a token only its SHA-256 is kept.
#ifndef VANTAGE_SERVER_FIELD_DEVICES_H_
#define VANTAGE_SERVER_FIELD_DEVICES_H_

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"

namespace vantage::field {

// The laptop's own command line, which may do everything. No tablet can have the name.
inline constexpr char kLaptop[] = "laptop";
// What a tablet may do unless something else is said: all of a crew's work, but not delete jobs.
inline constexpr char kTabletRoles[] = "submit,plan,read";

struct Device {
  std::string name;
  std::string roles;  // as the callers file has them
  absl::Time expires = absl::InfiniteFuture();
};

struct Pairing {
  std::string name;
  std::string roles = kTabletRoles;
  absl::Duration good_for = absl::Hours(24) * 365;
  bool replace = false;  // whoever has the name has it no more
};

// Thread safe, and safe beside other processes that change the same file.
class Devices {
 public:
  // The file `devices` in a folder that is there.
  explicit Devices(std::string folder) : folder_(std::move(folder)) {}

  std::string file() const { return folder_ + "/devices"; }

  // Without the laptop itself, in the order in which they were paired. None where there is no file.
  // As of CallersFile::Open (server/auth/callers.h): the file cannot be used.
  absl::StatusOr<std::vector<Device>> List() const;

  // A new token for a device. INVALID_ARGUMENT: no name or roles as the callers file has them, or
  // the laptop's name; ALREADY_EXISTS: a device has the name; as of List(); as of ReplaceFile.
  absl::StatusOr<std::string> Pair(const Pairing& pairing, absl::Time now);

  // Takes its token back. NOT_FOUND: no device has the name.
  absl::Status Revoke(const std::string& name);

  // A new token for the laptop's own command line, written to a file that only its owner can read;
  // the one before counts no more. The file's path.
  absl::StatusOr<std::string> RenewLaptop();

 private:
  // Every line of the file; a missing file has none.
  absl::StatusOr<std::vector<std::string>> Lines() const;
  absl::Status Write(const std::vector<std::string>& lines) const;

  const std::string folder_;
};

}  // namespace vantage::field

#endif  // VANTAGE_SERVER_FIELD_DEVICES_H_
