// A session's scans as the store has them.
#ifndef VANTAGE_SERVER_SESSION_STORED_SCANS_H_
#define VANTAGE_SERVER_SESSION_STORED_SCANS_H_

#include <string>

#include "absl/status/statusor.h"
#include "core/sensor/range_image.h"
#include "core/sensor/scan.h"
#include "server/session/session_context.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::session {

// The range image of a scan, by name. NOT_FOUND: there is no such scan. FAILED_PRECONDITION
// (SCAN_ERASED). DATA_LOSS: its data are lost (SCAN_LOST) or damaged. UNAVAILABLE: they cannot be
// read now; nothing is known of them.
absl::StatusOr<sensor::RangeImage> LoadImage(const SessionContext& context,
                                             const std::string& scan);
// The same with scanner and prior, as the algorithms take it.
absl::StatusOr<sensor::Scan> LoadScan(const SessionContext& context, const v1::Scan& scan);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_STORED_SCANS_H_
