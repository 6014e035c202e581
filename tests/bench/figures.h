// The benchmark's result: named figures, each beside what it is measured against.
#ifndef VANTAGE_TESTS_BENCH_FIGURES_H_
#define VANTAGE_TESTS_BENCH_FIGURES_H_

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace vantage::bench {

struct Figure {
  std::string name;  // stable
  double value = 0;
  std::string unit;
  std::string aim;        // empty: none stated
  std::string reference;  // what it is measured against, in the same run
};

// Collects figures, prints them as they come and writes them as JSON.
class Figures {
 public:
  explicit Figures(std::string only) : only_(std::move(only)) {}

  // True when a group of figures is selected by --only PREFIX: a name in it begins with the prefix,
  // or the prefix with the name.
  bool Wants(const std::string& prefix) const {
    return prefix.starts_with(only_) || only_.starts_with(prefix);
  }
  void Add(Figure figure);

  // Machine, commit, the defaults that matter, figures, and on which `scenes` they were measured
  // ('reporting', 'tuning'; empty: not said). False when the file cannot be written.
  bool WriteJson(const std::string& path, const std::string& scenes = "") const;

 private:
  std::string only_;
  std::vector<Figure> figures_;
};

// Wall seconds of one call.
double WallSeconds(const std::function<void()>& call);
// CPU seconds that the calling thread spends in one call: what others do on the machine counts
// less.
double ThreadSeconds(const std::function<void()>& call);
// Of a fixed loop, 1e8 dependent multiply-adds on one thread: how fast this machine is just now.
double MachineLoopSeconds();
// The median of several calls.
double MedianSeconds(int runs, const std::function<void()>& call);
double Percentile(std::vector<double> values, double share);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_FIGURES_H_
