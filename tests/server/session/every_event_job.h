// A job that has every kind of event; data/every_event was recorded with it.
#ifndef VANTAGE_TESTS_SERVER_SESSION_EVERY_EVENT_JOB_H_
#define VANTAGE_TESTS_SERVER_SESSION_EVERY_EVENT_JOB_H_

#include "absl/time/time.h"
#include "server/store/store.h"

namespace vantage::session {

// Runs it on an empty store and leaves it with an upload under way and a claim that is held. Fails
// the test where a step does not come to what it should.
void RunEveryEventJob(store::Store& store);

// A time after its end when nothing has expired yet that was held then.
inline absl::Time EveryEventJobEnd() { return absl::FromUnixSeconds(1'700'110'000); }

}  // namespace vantage::session

#endif  // VANTAGE_TESTS_SERVER_SESSION_EVERY_EVENT_JOB_H_
