#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "server/conversion/from_proto.h"

// A session from the wire, as CreateSession gets it: refused with every violation named, or turned
// into the core's configuration without surprises.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  vantage::v1::Session session;
  if (!session.ParseFromArray(data, static_cast<int>(size))) return 0;
  vantage::contract::Violations violations;
  vantage::conversion::CheckSession(session, "session.", violations);
  const absl::Status status = violations.ToStatus();
  if (violations.empty() != status.ok()) std::abort();
  if (!status.ok() && !absl::IsInvalidArgument(status)) std::abort();
  return 0;
}
