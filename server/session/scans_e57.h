// Registered scans as one E57 file, part by part: no scan is in memory but the one that is written.
#ifndef VANTAGE_SERVER_SESSION_SCANS_E57_H_
#define VANTAGE_SERVER_SESSION_SCANS_E57_H_

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/e57/writer.h"
#include "core/sensor/range_image.h"
#include "server/session/scans.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::session {

// A set-up each, with its pose in the world, as structured spherical coordinates in double: ranges,
// directions and pose are in the file to the bit. A ray without a return has no record. Not thread
// safe.
class ScansE57 {
 public:
  // Both have to outlive it.
  ScansE57(const Scans& stored, const std::vector<v1::Scan>& scans);

  int64_t size() const { return static_cast<int64_t>(writer_.size()); }
  // The next bytes; empty at the end. Errors as of session::LoadImage().
  absl::StatusOr<std::string> Next();

 private:
  const Scans& stored_;
  const std::vector<v1::Scan>& scans_;
  e57::Writer writer_;
  bool begun_ = false;
  size_t scan_ = 0;  // that is being written
  std::optional<sensor::RangeImage> image_;
  size_t cell_ = 0;       // the next of it
  uint64_t written_ = 0;  // records of it
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SCANS_E57_H_
