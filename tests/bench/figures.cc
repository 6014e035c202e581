#include "tests/bench/figures.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <thread>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/planning/plan/planning_config.h"
#include "core/sensor/scanner_model.h"

namespace vantage::bench {

namespace {

std::string Quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

std::string Processor() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

}  // namespace

void Figures::Add(Figure figure) {
  if (!figure.name.starts_with(only_)) return;
  absl::PrintF("%-36s %12.4g %-12s %-16s %s\n", figure.name, figure.value, figure.unit,
               figure.aim.empty() ? "" : absl::StrCat("aim ", figure.aim), figure.reference);
  std::fflush(stdout);
  figures_.push_back(std::move(figure));
}

bool Figures::WriteJson(const std::string& path, const std::string& scenes) const {
  const char* commit = std::getenv("VANTAGE_COMMIT");
  const sensor::ScannerModel scanner;
  const planning::PlanningConfig config;
  std::ofstream out(path);
  out << "{\n  \"machine\": {\"processor\": " << Quoted(Processor())
      << ", \"threads\": " << std::thread::hardware_concurrency()
      << "},\n  \"commit\": " << Quoted(commit == nullptr ? "unknown" : commit)
      << (scenes.empty() ? "" : ",\n  \"scenes\": " + Quoted(scenes)) << ",\n  \"defaults\": {"
      << absl::StrFormat(
             "\"required_density_per_m2\": %g, \"range_min_m\": %g, \"range_max_m\": %g, "
             "\"range_noise_m\": %g, \"step_deg\": %g, \"voxel_m\": 0.05, \"viewcell_m\": %g",
             config.required_density, scanner.range_min, scanner.range_max, scanner.range_noise,
             sensor::Degrees(scanner.azimuth_step), config.viewcell_size)
      << "},\n  \"figures\": [\n";
  for (size_t i = 0; i < figures_.size(); ++i) {
    const Figure& f = figures_[i];
    out << "    {\"name\": " << Quoted(f.name)
        << ", \"value\": " << absl::StrFormat("%.6g", f.value) << ", \"unit\": " << Quoted(f.unit)
        << ", \"aim\": " << Quoted(f.aim) << ", \"reference\": " << Quoted(f.reference) << "}"
        << (i + 1 < figures_.size() ? "," : "") << "\n";
  }
  out << "  ]\n}\n";
  return out.good();
}

double WallSeconds(const std::function<void()>& call) {
  const auto start = std::chrono::steady_clock::now();
  call();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double ThreadSeconds(const std::function<void()>& call) {
  const auto now = [] {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  };
  const double start = now();
  call();
  return now() - start;
}

double MachineLoopSeconds() {
  volatile double factor = 0.999999;  // volatile, so that the compiler does not know it
  volatile double sink = 0;
  return WallSeconds([&] {
    const double by = factor;
    double x = 1;
    for (int i = 0; i < 100'000'000; ++i) x = x * by + 1e-6;
    sink = x;
  });
}

double Percentile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  const double at = share * static_cast<double>(values.size() - 1);
  return values[static_cast<size_t>(at + 0.5)];
}

double MedianSeconds(int runs, const std::function<void()>& call) {
  std::vector<double> seconds;
  seconds.reserve(static_cast<size_t>(runs));
  for (int i = 0; i < runs; ++i) seconds.push_back(WallSeconds(call));
  return Percentile(seconds, 0.5);
}

}  // namespace vantage::bench
