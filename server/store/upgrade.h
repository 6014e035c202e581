// Translates what older servers stored. Format 1 is that of release 0.1: fields that have got
// another type since then arrive here as unknown fields under their old, reserved numbers.
#ifndef VANTAGE_SERVER_STORE_UPGRADE_H_
#define VANTAGE_SERVER_STORE_UPGRADE_H_

#include "vantage/storage/v1/log.pb.h"
#include "vantage/v1/plan.pb.h"

namespace vantage::store {

// Brings an entry to kLogFormatVersion. Leaves one of that format, or of a later one, as it is.
void Upgrade(storage::v1::LogEntry& entry);

// Translates a whole result, which has no format number; a result of this format is left as it is.
void Upgrade(v1::PlanResult& result);

}  // namespace vantage::store

#endif  // VANTAGE_SERVER_STORE_UPGRADE_H_
