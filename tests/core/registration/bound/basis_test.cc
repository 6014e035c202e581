#include "core/registration/bound/basis.h"

#include <gtest/gtest.h>

#include <vector>

namespace vantage::registration {
namespace {

TEST(Basis, SeveralAreJoined) {
  EXPECT_EQ(BasesText({}), "");
  const std::vector<RegistrationBasis> one = {RegistrationBasis::kRivalPose};
  EXPECT_EQ(BasesText(one), "rival pose");
  const std::vector<RegistrationBasis> all = {
      RegistrationBasis::kLevelling, RegistrationBasis::kTargets, RegistrationBasis::kTrustedPose};
  EXPECT_EQ(BasesText(all), "levelling and targets and trusted pose");
}

}  // namespace
}  // namespace vantage::registration
