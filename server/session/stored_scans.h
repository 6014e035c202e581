// Reads a session's scans from the store.
#ifndef VANTAGE_SERVER_SESSION_STORED_SCANS_H_
#define VANTAGE_SERVER_SESSION_STORED_SCANS_H_

#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/sensor/encoding.h"
#include "core/sensor/range_image.h"
#include "core/sensor/scan.h"
#include "server/session/session_context.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::session {

// The range image of a scan, by name. NOT_FOUND: there is no such scan. FAILED_PRECONDITION
// (SCAN_ERASED). DATA_LOSS (SCAN_LOST): its data are lost or damaged, which the session's lost
// scans say from then on. UNAVAILABLE: they cannot be read now, and it is unknown whether they are
// intact. `sha256`: of the preview, where a scan waits to be merged in its place and that is meant.
absl::StatusOr<sensor::RangeImage> LoadImage(
    const SessionContext& context, const std::string& scan, absl::string_view sha256 = "",
    sensor::RangeImageDecoder::Keep keep = sensor::RangeImageDecoder::Keep::kRanges);
// The same with scanner and prior, in the form that the algorithms need.
absl::StatusOr<sensor::Scan> LoadScan(const SessionContext& context, const v1::Scan& scan);

// Notes the scans whose data are missing; damage is found when they are read.
void FindLostScans(const SessionContext& context);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_STORED_SCANS_H_
