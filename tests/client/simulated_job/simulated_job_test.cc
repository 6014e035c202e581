#include "client/simulated_job/simulated_job.h"

#include <gtest/gtest.h>

namespace vantage::simulated_job {
namespace {

TEST(PromiseTest, APlanThatHadNoTimeToSayPromisesNothingRatherThanZero) {
  v1::RankedView view;
  view.set_score(4711);
  view.set_exact(true);
  view.set_model_gain_upper_m2(33);
  EXPECT_FALSE(PromiseOf(view).has_value());
  view.set_model_gain_upper_m2(0);
  ASSERT_TRUE(PromiseOf(view).has_value());
  EXPECT_EQ(PromiseOf(view)->expected_gain, 0.0);
  view.set_model_gain_m2(7);
  view.set_model_gain_lower_m2(7);
  view.set_model_gain_upper_m2(7);
  view.set_expected_gain_m2(12.5);
  ASSERT_TRUE(PromiseOf(view).has_value());
  EXPECT_EQ(PromiseOf(view)->expected_gain, 12.5);
  EXPECT_EQ(PromiseOf(view)->model_gain, 7);
}

}  // namespace
}  // namespace vantage::simulated_job
