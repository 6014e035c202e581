#include "client/simulated_job/simulated_job.h"

#include <gtest/gtest.h>

namespace vantage::simulated_job {
namespace {

TEST(PromisedGainTest, APlanThatHadNoTimeToSayPromisesNothingRatherThanZero) {
  v1::RankedView view;
  view.set_score(4711);
  view.set_exact(true);
  view.set_model_gain_upper_m2(33);
  EXPECT_FALSE(PromisedGain(view).has_value());
  view.set_model_gain_upper_m2(0);
  EXPECT_EQ(PromisedGain(view), 0.0);
  view.set_expected_gain_m2(12.5);
  EXPECT_EQ(PromisedGain(view), 12.5);
}

}  // namespace
}  // namespace vantage::simulated_job
