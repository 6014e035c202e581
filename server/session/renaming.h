// A session under another name.
#ifndef VANTAGE_SERVER_SESSION_RENAMING_H_
#define VANTAGE_SERVER_SESSION_RENAMING_H_

#include <string>

#include "google/protobuf/message.h"

namespace vantage::session {

// In all texts of a message, and of those in it, that are the name of the session `from`
// ('sessions/job') or of something in it, puts the session `to` in its place.
void RenameSession(const std::string& from, const std::string& to,
                   google::protobuf::Message& message);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_RENAMING_H_
