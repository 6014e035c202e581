// The records of a set-up's points, as they lie in an E57 file (ASTM E2807, section 9.3: binary
// sections of compressed vectors).
#ifndef VANTAGE_CORE_E57_RECORDS_H_
#define VANTAGE_CORE_E57_RECORDS_H_

#include <cstddef>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "core/e57/index.h"
#include "core/e57/paged_bytes.h"

namespace vantage::e57 {

// Some records that follow one another: of each field that was asked for the values, in order.
using RecordBlock = std::span<const std::vector<double>>;

// Calls `take(block)` for all records of a set-up, in order, with the fields whose places in
// ScanSetup::fields are given (no texts), until it returns an error, which is returned. Blocks are
// as large as the file's packets, some thousand records; what they hold is gone after the call.
// Memory does not depend on the number of records.
//
// INVALID_ARGUMENT: the section is not what the standard says, or ends before its records do;
// DATA_LOSS: a checksum is wrong. Both say for which record.
absl::Status ReadRecords(PagedBytes& file, const ScanSetup& setup, std::span<const size_t> fields,
                         absl::FunctionRef<absl::Status(RecordBlock)> take);

}  // namespace vantage::e57

#endif  // VANTAGE_CORE_E57_RECORDS_H_
