// Which events of a session are decisions: of a person, or of the server where it decides for one.
#ifndef VANTAGE_SERVER_REPORT_DECISIONS_H_
#define VANTAGE_SERVER_REPORT_DECISIONS_H_

#include "vantage/v1/event.pb.h"

namespace vantage::report {

bool IsDecision(const v1::SessionEvent& event);

}  // namespace vantage::report

#endif  // VANTAGE_SERVER_REPORT_DECISIONS_H_
