// What is stored of sessions as golden text: field by field, under labels of its own, so that it
// stays the same when messages and fields get other names and types.
#ifndef VANTAGE_TESTS_SERVER_SESSION_DESCRIBE_STATE_H_
#define VANTAGE_TESTS_SERVER_SESSION_DESCRIBE_STATE_H_

#include "server/session/session_state.h"
#include "server/store/store.h"
#include "tests/support/golden.h"

namespace vantage::session {

// All that the log of a session comes to, with the whole results of its plans.
void Describe(const SessionState& state, const store::Store& store, test_support::GoldenText& out);
// What the uploads under way brought.
void DescribeSpools(const store::Store& store, test_support::GoldenText& out);

}  // namespace vantage::session

#endif  // VANTAGE_TESTS_SERVER_SESSION_DESCRIBE_STATE_H_
