// What was read of a scan file, as a confined reader hands it to the process that asked. Both are
// the same program, so that this is no format: numbers as they lie in memory, in a fixed order, the
// samples in bulk. What is received is judged as a stranger's.
#ifndef VANTAGE_CORE_SENSOR_SCAN_ANSWER_H_
#define VANTAGE_CORE_SENSOR_SCAN_ANSWER_H_

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/confinement/bulk.h"
#include "core/sensor/imported_scan.h"

namespace vantage::sensor {

void SayScan(const ImportedScan& scan, confinement::SayBytes say);
// The same scan to the bit. INVALID_ARGUMENT naming what no reader says: an image that is not
// valid, a pose that is none, counts and shares beyond what they are of. Errors of `hear` as they
// are. `max_bytes`: that will be heard at most; nothing is allocated beyond.
absl::StatusOr<ImportedScan> HearScan(confinement::HearBytes hear, uint64_t max_bytes);

// The names of a file's set-ups.
void SaySetups(const std::vector<std::string>& setups, confinement::SayBytes say);
// INVALID_ARGUMENT: none, or more of them or longer than `max_bytes` hold.
absl::StatusOr<std::vector<std::string>> HearSetups(confinement::HearBytes hear,
                                                    uint64_t max_bytes);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_SCAN_ANSWER_H_
