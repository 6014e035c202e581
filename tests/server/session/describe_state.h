// What is stored of sessions as golden text: field by field, under labels of its own, so that it
// stays the same when messages and fields get other names and types.
#ifndef VANTAGE_TESTS_SERVER_SESSION_DESCRIBE_STATE_H_
#define VANTAGE_TESTS_SERVER_SESSION_DESCRIBE_STATE_H_

#include "server/session/session_state.h"
#include "server/store/store.h"
#include "tests/support/golden.h"

namespace vantage {

// All that the log of a session comes to, with the whole results of its plans.
void Describe(const SessionState& state, const Store& store, GoldenText& out);
// What the uploads under way brought.
void DescribeSpools(const Store& store, GoldenText& out);

}  // namespace vantage

#endif  // VANTAGE_TESTS_SERVER_SESSION_DESCRIBE_STATE_H_
