// Describes stored sessions as golden text, field by field under labels of its own, so that the
// text stays the same when messages and fields are renamed.
#ifndef VANTAGE_TESTS_SERVER_SESSION_DESCRIBE_STATE_H_
#define VANTAGE_TESTS_SERVER_SESSION_DESCRIBE_STATE_H_

#include "server/session/session_state.h"
#include "server/store/store.h"
#include "tests/support/golden.h"

namespace vantage::session {

// The whole state of a session, with the full results of its plans.
void Describe(const SessionState& state, const store::Store& store, test_support::GoldenText& out);
// The records of open uploads.
void DescribeSpools(const store::Store& store, test_support::GoldenText& out);

}  // namespace vantage::session

#endif  // VANTAGE_TESTS_SERVER_SESSION_DESCRIBE_STATE_H_
