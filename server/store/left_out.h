// Entries that stand for others, which were left out of a log.
#ifndef VANTAGE_SERVER_STORE_LEFT_OUT_H_
#define VANTAGE_SERVER_STORE_LEFT_OUT_H_

#include <cstdint>

#include "vantage/v1/event.pb.h"

namespace vantage::store {

// Sequence number of the first event that this one stands for: its own, but where events were left
// out.
inline uint64_t FirstSequence(const v1::SessionEvent& event) {
  return event.has_events_left_out() ? event.events_left_out().first_sequence() : event.sequence();
}

}  // namespace vantage::store

#endif  // VANTAGE_SERVER_STORE_LEFT_OUT_H_
