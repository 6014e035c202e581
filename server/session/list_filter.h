// What the filters of lists have in common.
#ifndef VANTAGE_SERVER_SESSION_LIST_FILTER_H_
#define VANTAGE_SERVER_SESSION_LIST_FILTER_H_

#include <algorithm>

#include "google/protobuf/repeated_field.h"

namespace vantage::session {

// Whether a filter lets a state through: one without states lets all of them.
inline bool LetsThrough(const google::protobuf::RepeatedField<int>& states, int state) {
  return states.empty() || std::find(states.begin(), states.end(), state) != states.end();
}

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_LIST_FILTER_H_
