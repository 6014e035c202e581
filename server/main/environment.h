// Variables of the environment.
#ifndef VANTAGE_SERVER_MAIN_ENVIRONMENT_H_
#define VANTAGE_SERVER_MAIN_ENVIRONMENT_H_

#include <cstdlib>
#include <string>

namespace vantage::server {

// Empty where it is not set.
inline std::string Variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace vantage::server

#endif  // VANTAGE_SERVER_MAIN_ENVIRONMENT_H_
