#include "core/fleet/near_first.h"

#include <algorithm>

#include "core/planning/ranking/registration_check.h"

namespace vantage::fleet {

void NearFirst::Refused(double away) {
  refused_.push_back(away);
  ++dozen_;
}

bool NearFirst::Take() {
  if (all() || over_ || found_) {
    over_ = true;
    return true;
  }
  found_ = true;
  within_ *= 2;
  dozen_ = 0;
  return false;
}

bool NearFirst::Change(bool none_left) {
  if (over_) {
    if (!none_left || all()) return false;
    within_ = kAll;
    return true;
  }
  if (dozen_ < planning::kBestFirst && (!none_left || all())) return false;
  dozen_ = 0;
  if (found_) {
    within_ /= 2;
    over_ = true;
    return true;
  }
  within_ = (all() ? Median() : within_) / 2;
  if (within_ <= least_) {
    within_ = kAll;
    over_ = true;
  }
  return true;
}

double NearFirst::Median() {
  const auto middle = refused_.begin() + static_cast<ptrdiff_t>(refused_.size() / 2);
  std::nth_element(refused_.begin(), middle, refused_.end());
  return *middle;
}

}  // namespace vantage::fleet
