// What an address of a server says of itself.
#ifndef VANTAGE_CLIENT_LIBRARY_ADDRESS_H_
#define VANTAGE_CLIENT_LIBRARY_ADDRESS_H_

#include <string>

namespace vantage::client {

// Whether what is sent to this address (ClientOptions::server) does not leave the machine.
bool StaysOnThisMachine(const std::string& server);

}  // namespace vantage::client

#endif  // VANTAGE_CLIENT_LIBRARY_ADDRESS_H_
