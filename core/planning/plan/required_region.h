// A region of the site with its own requirements (algorithm.md section 5, 'Requirements by
// region').
#ifndef VANTAGE_CORE_PLANNING_PLAN_REQUIRED_REGION_H_
#define VANTAGE_CORE_PLANNING_PLAN_REQUIRED_REGION_H_

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace vantage::planning {

// An upright prism. What lies on its outline or at its lowest height belongs to one of two regions
// that touch there, and to one only.
struct RequiredRegion {
  std::string name;
  // m, model frame: the corners of a simple polygon, in either sense, three at least. The last one
  // is joined to the first.
  std::vector<Eigen::Vector2d> outline;
  double min_z = -std::numeric_limits<double>::infinity();  // m, model frame
  double max_z = std::numeric_limits<double>::infinity();
  std::optional<double> density;  // D in it, samples / m^2, > 0; absent: as everywhere else
  double weight = 1;              // of all samples in it, >= 0; 0: nothing is required of it

  bool Contains(const Eigen::Vector3d& p) const;
  bool operator==(const RequiredRegion&) const = default;
};

// What is wrong with a region's outline, in words that follow its name ('has two corners only');
// empty where nothing is.
std::string OutlineFault(const std::vector<Eigen::Vector2d>& outline);

// Area that two outlines have in common, m^2; both are without fault.
double CommonArea(const std::vector<Eigen::Vector2d>& a, const std::vector<Eigen::Vector2d>& b);

// True where two regions overlap by more than the rounding of their coordinates.
bool Overlap(const RequiredRegion& a, const RequiredRegion& b);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_REQUIRED_REGION_H_
