// Conversion between the wire's durations and seconds.
#ifndef VANTAGE_CLIENT_LIBRARY_DURATION_H_
#define VANTAGE_CLIENT_LIBRARY_DURATION_H_

#include <google/protobuf/duration.pb.h>

namespace vantage::client {

// To the nearest nanosecond.
google::protobuf::Duration DurationOf(double seconds);
double SecondsOf(const google::protobuf::Duration& duration);

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_DURATION_H_
