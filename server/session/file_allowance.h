// What the process that reads a stranger's file may take, and whose turn it is: the same for scans
// and for priors of a site.
#ifndef VANTAGE_SERVER_SESSION_FILE_ALLOWANCE_H_
#define VANTAGE_SERVER_SESSION_FILE_ALLOWANCE_H_

#include <functional>
#include <string>

#include "core/confinement/allowance.h"
#include "server/session/session_context.h"

namespace vantage::session {

// By the server's settings. `given_up`: as Allowance::given_up.
confinement::AllowanceSettings FileAllowance(const SessionDependencies& dependencies,
                                             std::function<bool()> given_up);

// As FileReadings::Post() tells those apart whose files are read one at a time: the tenant, or the
// session of one that has none.
std::string ReaderOf(const SessionContext& context);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_FILE_ALLOWANCE_H_
