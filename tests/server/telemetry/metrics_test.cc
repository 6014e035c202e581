#include "server/telemetry/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

namespace vantage::telemetry {
namespace {

using ::testing::HasSubstr;

TEST(Metrics, AreWrittenAsPrometheusReadsThem) {
  Metrics metrics;
  metrics.CounterOf("calls_total", "Calls.", {{"method", "Get\"it\"\n"}, {"code", "OK"}}).Add(3);
  metrics.AddGauge("level", "Level.", {}, [] { return 1.5; });
  metrics.HistogramOf("took_seconds", "Took.").Observe(0.3);
  metrics.HistogramOf("took_seconds", "Took.").Observe(0.5);
  metrics.HistogramOf("took_seconds", "Took.").Observe(1000);
  const std::string text = metrics.Text();
  EXPECT_THAT(text, HasSubstr("# HELP calls_total Calls.\n# TYPE calls_total counter\n"
                              "calls_total{method=\"Get\\\"it\\\"\\n\",code=\"OK\"} 3\n"));
  EXPECT_THAT(text, HasSubstr("# TYPE level gauge\nlevel 1.5\n"));
  EXPECT_THAT(text, HasSubstr("# TYPE took_seconds histogram\n"));
  EXPECT_THAT(text, HasSubstr("took_seconds_bucket{le=\"0.25\"} 0\n"
                              "took_seconds_bucket{le=\"0.5\"} 2\n"
                              "took_seconds_bucket{le=\"1\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("took_seconds_bucket{le=\"300\"} 2\n"
                              "took_seconds_bucket{le=\"+Inf\"} 3\n"
                              "took_seconds_sum 1000.8\ntook_seconds_count 3\n"));
}

TEST(Metrics, LoseNothingBetweenThreads) {
  Metrics metrics;
  std::vector<std::thread> threads;
  threads.reserve(4);
  for (int i = 0; i < 4; ++i) {
    threads.emplace_back([&] {
      for (int n = 0; n < 10'000; ++n) {
        metrics.CounterOf("c", "c").Add();
        metrics.HistogramOf("h", "h").Observe(n % 2 == 0 ? 0.01 : 20);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(metrics.CounterOf("c", "c").value(), 40'000);
  EXPECT_EQ(metrics.HistogramOf("h", "h").count(), 40'000);
  EXPECT_NEAR(metrics.HistogramOf("h", "h").sum(), 20'000 * 20.01, 1e-3);
}

}  // namespace
}  // namespace vantage::telemetry
