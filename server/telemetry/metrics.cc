#include "server/telemetry/metrics.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"

namespace vantage::telemetry {
namespace {

// The labels as they are written between braces: a="b",c="d".
std::string Written(const Metrics::Labels& labels) {
  std::string out;
  for (const auto& [name, value] : labels) {
    absl::StrAppend(&out, out.empty() ? "" : ",", name, "=\"",
                    absl::StrReplaceAll(value, {{"\\", "\\\\"}, {"\"", "\\\""}, {"\n", "\\n"}}),
                    "\"");
  }
  return out;
}

std::string Number(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
  return absl::StrFormat("%.12g", value);
}

void AppendSample(std::string& out, const std::string& name, const std::string& labels,
                  const std::string& value) {
  absl::StrAppend(&out, name, labels.empty() ? "" : absl::StrCat("{", labels, "}"), " ", value,
                  "\n");
}

void AppendHistogram(std::string& out, const std::string& name, const std::string& labels,
                     const Metrics::Histogram& histogram) {
  const std::vector<double>& bounds = Metrics::Histogram::Bounds();
  const std::vector<int64_t> cumulative = histogram.Cumulative();
  const std::string comma = labels.empty() ? "" : ",";
  for (size_t i = 0; i < cumulative.size(); ++i) {
    const std::string bound = i < bounds.size() ? Number(bounds[i]) : "+Inf";
    AppendSample(out, name + "_bucket", absl::StrCat(labels, comma, "le=\"", bound, "\""),
                 absl::StrCat(cumulative[i]));
  }
  AppendSample(out, name + "_sum", labels, Number(histogram.sum()));
  AppendSample(out, name + "_count", labels, absl::StrCat(cumulative.back()));
}

}  // namespace

const std::vector<double>& Metrics::Histogram::Bounds() {
  static const auto& bounds = *new std::vector<double>{
      0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1, 2.5, 5, 10, 30, 60, 300};
  return bounds;
}

Metrics::Histogram::Histogram() : counts_(Bounds().size() + 1) {}

void Metrics::Histogram::Observe(double seconds) {
  const std::vector<double>& bounds = Bounds();
  const auto at = std::lower_bound(bounds.begin(), bounds.end(), seconds) - bounds.begin();
  std::lock_guard<std::mutex> lock(mutex_);
  ++counts_[static_cast<size_t>(at)];
  sum_ += seconds;
}

std::vector<int64_t> Metrics::Histogram::Cumulative() const {
  std::lock_guard<std::mutex> lock(mutex_);
  std::vector<int64_t> out = counts_;
  for (size_t i = 1; i < out.size(); ++i) out[i] += out[i - 1];
  return out;
}

int64_t Metrics::Histogram::count() const { return Cumulative().back(); }

double Metrics::Histogram::sum() const {
  std::lock_guard<std::mutex> lock(mutex_);
  return sum_;
}

Metrics::Counter& Metrics::CounterOf(const std::string& name, const std::string& help,
                                     const Labels& labels) {
  std::lock_guard<std::mutex> lock(mutex_);
  Family& family = families_[name];
  family.help = help;
  std::unique_ptr<Counter>& counter = family.counters[Written(labels)];
  if (counter == nullptr) counter = std::make_unique<Counter>();
  return *counter;
}

Metrics::Histogram& Metrics::HistogramOf(const std::string& name, const std::string& help,
                                         const Labels& labels) {
  std::lock_guard<std::mutex> lock(mutex_);
  Family& family = families_[name];
  family.help = help;
  std::unique_ptr<Histogram>& histogram = family.histograms[Written(labels)];
  if (histogram == nullptr) histogram = std::make_unique<Histogram>();
  return *histogram;
}

void Metrics::AddGauge(const std::string& name, const std::string& help, const Labels& labels,
                       std::function<double()> read) {
  std::lock_guard<std::mutex> lock(mutex_);
  Family& family = families_[name];
  family.help = help;
  family.gauges.emplace_back(Written(labels), std::move(read));
}

std::string Metrics::Text() const {
  std::lock_guard<std::mutex> lock(mutex_);
  std::string out;
  for (const auto& [name, family] : families_) {
    const char* type = !family.counters.empty()     ? "counter"
                       : !family.histograms.empty() ? "histogram"
                                                    : "gauge";
    absl::StrAppend(&out, "# HELP ", name, " ", family.help, "\n# TYPE ", name, " ", type, "\n");
    for (const auto& [labels, counter] : family.counters) {
      AppendSample(out, name, labels, absl::StrCat(counter->value()));
    }
    for (const auto& [labels, histogram] : family.histograms) {
      AppendHistogram(out, name, labels, *histogram);
    }
    for (const auto& [labels, read] : family.gauges)
      AppendSample(out, name, labels, Number(read()));
  }
  return out;
}

void ObserveStage(Metrics* metrics, const std::string& stage, double seconds) {
  if (metrics == nullptr) return;
  metrics
      ->HistogramOf("vantage_stage_seconds", "Time that a stage of the work took.",
                    {{"stage", stage}})
      .Observe(seconds);
}

}  // namespace vantage::telemetry
