#include "core/planning/plan/planning_config.h"

#include <cmath>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"

namespace vantage::planning {
namespace {

bool ValidBox(const Region& box) {
  return box.min().allFinite() && box.max().allFinite() &&
         (box.min().array() < box.max().array()).all();
}

}  // namespace

absl::Status PlanningConfig::Validate(const sensor::ScannerModel& scanner) const {
  std::vector<std::string> wrong;
  // Conditions are written so that NaN fails them.
  const auto require = [&wrong](bool holds, std::string what) {
    if (!holds) wrong.push_back(std::move(what));
  };
  const double reachable = scanner.MaxSamplingDensity();
  require(required_density > 0 && std::isfinite(required_density),
          "required_density must be above 0");
  require(!(required_density > reachable),
          absl::StrFormat("required_density is %.0f samples/m2, but this scanner reaches no more "
                          "than %.0f anywhere in its range: lower it, or use finer steps",
                          required_density, reachable));
  require(viewcell_size >= 0.01 && viewcell_size <= 2, "viewcell_size must be in [0.01, 2] m");
  require(density_tolerance >= 0 && density_tolerance < 1, "density_tolerance must be in [0, 1)");
  require(min_viewpoint_height >= 0 && min_viewpoint_height < max_viewpoint_height &&
              max_viewpoint_height <= 100,
          "min_viewpoint_height must be at least 0 and below max_viewpoint_height, which must be "
          "at most 100 m");
  require(!(max_viewpoint_height - min_viewpoint_height < viewcell_size - 1e-9),
          "max_viewpoint_height - min_viewpoint_height must hold a viewcell");
  require(!floor_z.has_value() || std::isfinite(*floor_z), "floor_z must be finite");
  require(scanner_width > 0 && scanner_width <= 10, "scanner_width must be in (0, 10] m");
  require(scanner_height > 0 && scanner_height <= 20, "scanner_height must be in (0, 20] m");
  bool weighted = false;
  for (int kind = 0; kind < model::kSurfaceKinds; ++kind) {
    const double weight = weights[static_cast<size_t>(kind)];
    require(weight >= 0 && weight <= 1e6,
            absl::StrCat("weight of ", model::kSurfaceKindNames[static_cast<size_t>(kind)],
                         " must be in [0, 1e6]"));
    weighted |= weight > 0;
  }
  require(weighted, "at least one weight must be above 0");
  require(min_deficit_share >= 0 && min_deficit_share <= 1, "min_deficit_share must be in [0, 1]");
  require(min_counted_density_share >= 0 && min_counted_density_share < 1,
          "min_counted_density_share must be in [0, 1)");
  require(unknown_depth >= 0 && unknown_depth <= 10, "unknown_depth must be in [0, 10] m");
  require(candidate_separation >= 0 && candidate_separation <= 100,
          "candidate_separation must be in [0, 100] m");
  require(candidates >= 1 && candidates <= 1000, "candidates must be in [1, 1000]");
  require(max_checked >= candidates && max_checked <= 100000,
          "max_checked must be at least candidates, and at most 100000");
  require(max_cells > 0, "max_cells must be positive");
  require(terminate_below >= 0 && std::isfinite(terminate_below),
          "terminate_below must be at least 0 m2");
  require(min_patch_area >= 0 && std::isfinite(min_patch_area),
          "min_patch_area must be at least 0 m2");
  require(confidence > 0 && confidence < 1, "confidence must be in (0, 1)");
  require(!region_of_interest.has_value() || ValidBox(*region_of_interest),
          "region_of_interest must be finite with min below max on every axis");
  for (size_t i = 0; i < keep_out.size(); ++i) {
    require(ValidBox(keep_out[i]),
            absl::StrCat("keep_out[", i, "] must be finite with min below max on every axis"));
  }
  for (size_t i = 0; i < regions.size(); ++i) {
    const std::string which = absl::StrCat("regions[", i, "]");
    const RequiredRegion& region = regions[i];
    const std::string fault = OutlineFault(region.outline);
    require(fault.empty(), absl::StrCat(which, " ", fault));
    require(region.min_z < region.max_z, absl::StrCat(which, " must have min_z below max_z"));
    require(region.weight >= 0 && region.weight <= 1e6,
            absl::StrCat("weight of ", which, " must be in [0, 1e6]"));
    const double density = region.density.value_or(required_density);
    require(density > 0 && density <= reachable,
            absl::StrFormat("density of %s is %.0f samples/m2, must be above 0 and at most %.0f, "
                            "which this scanner reaches",
                            which, density, reachable));
    // One that it overlaps says enough.
    for (size_t j = 0; fault.empty() && j < i; ++j) {
      if (!OutlineFault(regions[j].outline).empty() || !Overlap(regions[j], region)) continue;
      require(false, absl::StrCat(which, " overlaps regions[", j, "]"));
      break;
    }
  }
  for (size_t i = 0; i < storeys.size(); ++i) {
    require(std::isfinite(storeys[i].floor_z),
            absl::StrCat("storeys[", i, "] needs a finite floor_z"));
  }
  for (size_t i = 0; i < rejected.size(); ++i) {
    require(
        rejected[i].position.allFinite() && rejected[i].radius > 0 && rejected[i].radius <= 1000,
        absl::StrCat("rejected[", i, "] needs a finite position and a radius in (0, 1000] m"));
  }
  const absl::Status scanner_status = scanner.Validate();
  if (!scanner_status.ok())
    wrong.emplace_back(scanner_status.message().data(), scanner_status.message().size());
  const absl::Status registration_status = registration.Validate();
  if (!registration_status.ok()) {
    wrong.emplace_back(registration_status.message().data(), registration_status.message().size());
  }
  if (wrong.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("planning: ", absl::StrJoin(wrong, "; ")));
}

std::optional<Requirement> PlanningConfig::RequiredAt(const Eigen::Vector3d& p) const {
  if (region_of_interest.has_value() && !region_of_interest->contains(p)) return std::nullopt;
  for (size_t i = 0; i < regions.size(); ++i) {
    if (!regions[i].Contains(p)) continue;
    if (!(regions[i].weight > 0)) return std::nullopt;
    const double density = regions[i].density.value_or(required_density);
    return Requirement{density, regions[i].weight * required_density / density, i};
  }
  return Requirement{required_density, 1, std::nullopt};
}

absl::Status ValidateFor(const model::PlanningView& model, const sensor::ScannerModel& scanner,
                         const PlanningConfig& config) {
  if (absl::Status valid = config.Validate(scanner); !valid.ok()) return valid;
  const double cells = config.viewcell_size / model.voxel_size();
  if (cells < 1 - 1e-6 || std::abs(cells - std::round(cells)) > 1e-6 * cells) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "planning: viewcell_size is %.4f m, which is no multiple of the model's voxel of %.4f m",
        config.viewcell_size, model.voxel_size()));
  }
  return absl::OkStatus();
}

}  // namespace vantage::planning
