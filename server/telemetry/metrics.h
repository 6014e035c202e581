// The server's counters and measurements, and their text for Prometheus.
#ifndef VANTAGE_SERVER_TELEMETRY_METRICS_H_
#define VANTAGE_SERVER_TELEMETRY_METRICS_H_

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"

namespace vantage::telemetry {

// Thread safe. Label values come from the code (methods, stages, reasons), never from clients, so
// that their number is bounded. Units are those of the names: seconds, bytes.
class Metrics {
 public:
  using Labels = std::vector<std::pair<std::string, std::string>>;

  class Counter {
   public:
    void Add(int64_t count = 1) { value_.fetch_add(count, std::memory_order_relaxed); }
    int64_t value() const { return value_.load(std::memory_order_relaxed); }

   private:
    std::atomic<int64_t> value_{0};
  };

  // Upper bounds of the buckets, from a millisecond to five minutes.
  class Histogram {
   public:
    static const std::vector<double>& Bounds();

    Histogram();
    void Observe(double seconds);
    int64_t count() const;
    double sum() const;
    // Observations at or below each bound.
    std::vector<int64_t> Cumulative() const;

   private:
    mutable std::mutex mutex_;
    std::vector<int64_t> counts_ ABSL_GUARDED_BY(mutex_);
    double sum_ ABSL_GUARDED_BY(mutex_) = 0;
  };

  // Makes the metric at the first call. The reference stays valid.
  Counter& CounterOf(const std::string& name, const std::string& help, const Labels& labels = {});
  Histogram& HistogramOf(const std::string& name, const std::string& help,
                         const Labels& labels = {});
  // `read` is called whenever the metrics are read; what it refers to outlives the last reading.
  void AddGauge(const std::string& name, const std::string& help, const Labels& labels,
                std::function<double()> read);

  // All metrics, in Prometheus' text format 0.0.4.
  std::string Text() const;

 private:
  struct Family {
    std::string help;
    std::map<std::string, std::unique_ptr<Counter>> counters;  // by labels, as written
    std::map<std::string, std::unique_ptr<Histogram>> histograms;
    std::vector<std::pair<std::string, std::function<double()>>> gauges;
  };

  mutable std::mutex mutex_;
  std::map<std::string, Family> families_ ABSL_GUARDED_BY(mutex_);
};

// Records the seconds that a stage of the work took; does nothing without metrics.
void ObserveStage(Metrics* metrics, const std::string& stage, double seconds);

}  // namespace vantage::telemetry

#endif  // VANTAGE_SERVER_TELEMETRY_METRICS_H_
