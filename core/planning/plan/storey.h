// What people are told of a level of the site (algorithm.md section 7A, 'Storeys').
#ifndef VANTAGE_CORE_PLANNING_PLAN_STOREY_H_
#define VANTAGE_CORE_PLANNING_PLAN_STOREY_H_

#include <optional>
#include <span>
#include <string>

namespace vantage::planning {

struct Storey {
  int number = 0;                 // 0 is the lowest that is known
  std::optional<double> floor_z;  // m, model frame; absent where no level floor is known
  std::string name;               // as people named it; empty where they did not

  // 'storey 1', or 'storey 1 (attic)'.
  std::string Words() const;
};

// A storey that people have named, wherever it comes in the order of those that are known.
struct NamedStorey {
  std::string name;
  double floor_z = 0;  // m, model frame: z of its level floor

  bool operator==(const NamedStorey&) const = default;
};
// m from storey to storey at least, of those that are found and of those that are named: what a
// person needs.
inline constexpr double kStoreysApart = 2.0;

// The name of the storey whose level floor is at `floor_z` (m); empty where none of `named` lies
// within a quarter of what storeys lie apart, which is more than level floor of one storey varies.
std::string NameOfStorey(double floor_z, std::span<const NamedStorey> named);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_STOREY_H_
