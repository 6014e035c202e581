// What a caller may do.
#ifndef VANTAGE_SERVER_AUTH_ROLE_H_
#define VANTAGE_SERVER_AUTH_ROLE_H_

#include <cstdint>

namespace vantage::auth {

enum class Role : uint8_t {
  kRead = 1,        // see sessions, scans, plans, models
  kSubmit = 2,      // open sessions; send, place and withdraw scans
  kPlan = 4,        // plan, evaluate and reject views, claim them; change the rules of a site
  kAdminister = 8,  // delete sessions; and all of the above
};

constexpr const char* RoleName(Role role) {
  switch (role) {
    case Role::kRead:
      return "read";
    case Role::kSubmit:
      return "submit";
    case Role::kPlan:
      return "plan";
    case Role::kAdminister:
      return "administer";
  }
  return "";
}

// A set of roles.
class Roles {
 public:
  constexpr Roles() = default;
  static constexpr Roles All() { return Roles().With(Role::kAdminister); }
  constexpr Roles With(Role role) const {
    Roles more = *this;
    more.bits_ = static_cast<uint8_t>(more.bits_ | static_cast<uint8_t>(role));
    return more;
  }
  constexpr bool Allow(Role role) const {
    return (bits_ & (static_cast<uint8_t>(role) | static_cast<uint8_t>(Role::kAdminister))) != 0;
  }
  constexpr bool empty() const { return bits_ == 0; }

 private:
  uint8_t bits_ = 0;
};

}  // namespace vantage::auth

#endif  // VANTAGE_SERVER_AUTH_ROLE_H_
