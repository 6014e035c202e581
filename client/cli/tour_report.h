// A tour as a table for people.
#ifndef VANTAGE_CLIENT_CLI_TOUR_REPORT_H_
#define VANTAGE_CLIENT_CLI_TOUR_REPORT_H_

#include <string>

#include "vantage/v1/tour.pb.h"

namespace vantage::cli {

// '3 h 10 min', '12 min'.
std::string HoursAndMinutes(double seconds);
// The stops in their order, and what they come to: several lines, with line ends.
std::string TourReport(const v1::Tour& tour);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_TOUR_REPORT_H_
