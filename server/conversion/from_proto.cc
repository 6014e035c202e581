#include "server/conversion/from_proto.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <utility>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/sensor/presets.h"
#include "server/contract/resource_names.h"
#include "server/conversion/to_proto.h"

namespace vantage::conversion {
namespace {

constexpr double kMaxCoordinate = 1e8;  // m
constexpr double kHalfPi = sensor::kPi / 2;
constexpr int kMaxScannerModels = 16;
constexpr int kMaxKeepOut = 256;
constexpr int kMaxRegions = 64;
constexpr int kMaxStoreys = 64;
constexpr int kMaxCorners = 64;
constexpr size_t kMaxSiteName = 100;
// m; a storey begins so far below its level floor, which varies, but not in the slab below it.
constexpr double kBelowFloor = 0.1;
constexpr size_t kMaxDisplayName = 200;
// Finite limits of intervals that the contract leaves open.
constexpr double kTiny = std::numeric_limits<double>::min();
constexpr double kHuge = 1e9;

void CheckRange(double value, double min, double max, const std::string& field,
                contract::Violations& violations) {
  if (!(value >= min && value <= max)) {
    violations.Add(field, absl::StrFormat("is %g, must be in [%g, %g]", value, min, max));
  }
}

Eigen::AlignedBox3d ReadBox(const v1::Box& box, const Eigen::Vector3d& origin,
                            const std::string& field, contract::Violations& violations) {
  if (!box.has_min()) violations.Add(absl::StrCat(field, ".min"), "is required");
  if (!box.has_max()) violations.Add(absl::StrCat(field, ".max"), "is required");
  if (!box.has_min() || !box.has_max()) return {};
  const Eigen::Vector3d min = ReadVector(box.min(), absl::StrCat(field, ".min"), violations);
  const Eigen::Vector3d max = ReadVector(box.max(), absl::StrCat(field, ".max"), violations);
  if (!(min.array() < max.array()).all()) {
    violations.Add(field, "must have min below max on every axis");
  }
  return Eigen::AlignedBox3d(min - origin, max - origin);
}

void Check(const v1::RegistrationConfig& c, const std::string& field,
           contract::Violations& violations) {
  CheckRange(c.required_accuracy_m(), 1e-5, 1, field + ".required_accuracy_m", violations);
  CheckRange(c.min_overlap(), 1e-6, 0.999999, field + ".min_overlap", violations);
  CheckRange(c.correlation_length_m(), 0.05, 10, field + ".correlation_length_m", violations);
  CheckRange(c.correlated_sigma_m(), 0, 0.1, field + ".correlated_sigma_m", violations);
  CheckRange(c.normal_sigma_rad(), kTiny, 0.5, field + ".normal_sigma_rad", violations);
  CheckRange(c.sample_spacing_m(), 0.01, 0.5, field + ".sample_spacing_m", violations);
  CheckRange(c.max_correspondence_distance_m(), 0.1, 2, field + ".max_correspondence_distance_m",
             violations);
  CheckRange(c.draw_count(), 20, 65536, field + ".draw_count", violations);
  CheckRange(c.prior_position_sigma_m(), 0, 10, field + ".prior_position_sigma_m", violations);
  CheckRange(c.prior_heading_sigma_rad(), 0, 3.2, field + ".prior_heading_sigma_rad", violations);
}

// The name of a storey or a region, which no other one has.
void CheckSiteName(const std::string& name, const std::string& field, std::set<std::string>& names,
                   contract::Violations& violations) {
  if (name.empty()) {
    violations.Add(field, "is required");
  } else if (!names.insert(name).second) {
    violations.Add(field, absl::StrCat("'", name, "' is used twice"));
  }
  CheckText(name, kMaxSiteName, field, violations);
}

std::vector<planning::NamedStorey> ReadStoreys(const v1::SiteRules& rules, double origin_z,
                                               const std::string& field,
                                               contract::Violations& violations) {
  std::vector<planning::NamedStorey> storeys;
  if (rules.storeys_size() > kMaxStoreys) {
    violations.Add(field, absl::StrCat("has ", rules.storeys_size(), " storeys, at most ",
                                       kMaxStoreys, " fit"));
    return storeys;
  }
  std::set<std::string> names;
  for (int i = 0; i < rules.storeys_size(); ++i) {
    const v1::NamedStorey& storey = rules.storeys(i);
    const std::string at = absl::StrFormat("%s[%d]", field, i);
    CheckSiteName(storey.name(), at + ".name", names, violations);
    CheckRange(storey.floor_z_m(), -kMaxCoordinate, kMaxCoordinate, at + ".floor_z_m", violations);
    const double floor_z = storey.floor_z_m() - origin_z;
    for (const planning::NamedStorey& other : storeys) {
      if (std::abs(other.floor_z - floor_z) >= planning::kStoreysApart) continue;
      violations.Add(at + ".floor_z_m", absl::StrFormat("is less than %g m from that of '%s'",
                                                        planning::kStoreysApart, other.name));
    }
    storeys.push_back({storey.name(), floor_z});
  }
  return storeys;
}

std::vector<Eigen::Vector2d> ReadOutline(const v1::RequiredRegion& region,
                                         const Eigen::Vector3d& origin, const std::string& at,
                                         contract::Violations& violations) {
  std::vector<Eigen::Vector2d> outline;
  if (region.has_box()) {
    const Eigen::AlignedBox3d box = ReadBox(region.box(), origin, at + ".box", violations);
    if (box.isEmpty()) return outline;
    return {box.min().head<2>(),
            {box.max().x(), box.min().y()},
            box.max().head<2>(),
            {box.min().x(), box.max().y()}};
  }
  if (!region.has_polygon()) {
    violations.Add(at + ".polygon", "is required, or box");
    return outline;
  }
  const std::string corners = at + ".polygon.corners";
  if (region.polygon().corners_size() > kMaxCorners) {
    violations.Add(corners, absl::StrCat("has ", region.polygon().corners_size(),
                                         " corners, at most ", kMaxCorners, " fit"));
    return outline;
  }
  contract::Violations own;
  for (int i = 0; i < region.polygon().corners_size(); ++i) {
    outline.emplace_back(
        (ReadVector(region.polygon().corners(i), absl::StrFormat("%s[%d]", corners, i), own) -
         origin)
            .head<2>());
  }
  if (own.empty()) {
    const std::string fault = planning::OutlineFault(outline);
    if (!fault.empty()) own.Add(corners, fault);
  }
  if (!own.empty()) outline.clear();
  violations.Append(own);
  return outline;
}

// Sets the heights between which a region lies.
void ReadHeights(const v1::RequiredRegion& asked, const Eigen::Vector3d& origin,
                 std::span<const planning::NamedStorey> storeys, const std::string& at,
                 planning::RequiredRegion& region, contract::Violations& violations) {
  if (asked.has_box()) {
    region.min_z = asked.box().min().z() - origin.z();
    region.max_z = asked.box().max().z() - origin.z();
    for (const auto& [given, name] : {std::pair(asked.has_min_z_m(), ".min_z_m"),
                                      {asked.has_max_z_m(), ".max_z_m"},
                                      {!asked.storey().empty(), ".storey"}}) {
      if (given) violations.Add(at + name, "goes with a polygon; a box has its own heights");
    }
    return;
  }
  if (asked.has_min_z_m()) {
    CheckRange(asked.min_z_m(), -kMaxCoordinate, kMaxCoordinate, at + ".min_z_m", violations);
    region.min_z = asked.min_z_m() - origin.z();
  }
  if (asked.has_max_z_m()) {
    CheckRange(asked.max_z_m(), -kMaxCoordinate, kMaxCoordinate, at + ".max_z_m", violations);
    region.max_z = asked.max_z_m() - origin.z();
  }
  if (asked.has_min_z_m() && asked.has_max_z_m() && !(asked.min_z_m() < asked.max_z_m())) {
    violations.Add(at + ".max_z_m", "must be above min_z_m");
  }
  if (asked.storey().empty()) return;
  if (asked.has_min_z_m() || asked.has_max_z_m()) {
    violations.Add(at + ".storey", "goes without min_z_m and max_z_m");
    return;
  }
  const auto storey = std::find_if(storeys.begin(), storeys.end(),
                                   [&](const auto& named) { return named.name == asked.storey(); });
  if (storey == storeys.end()) {
    violations.Add(at + ".storey",
                   absl::StrCat("'", asked.storey(), "' is none of site_rules.storeys"));
    return;
  }
  region.min_z = storey->floor_z - kBelowFloor;
  for (const planning::NamedStorey& above : storeys) {
    if (above.floor_z > storey->floor_z) {
      region.max_z = std::min(region.max_z, above.floor_z - kBelowFloor);
    }
  }
}

std::vector<planning::RequiredRegion> ReadRegions(const v1::SiteRules& rules,
                                                  const Eigen::Vector3d& origin,
                                                  std::span<const planning::NamedStorey> storeys,
                                                  const std::string& field,
                                                  contract::Violations& violations) {
  std::vector<planning::RequiredRegion> regions;
  if (rules.regions_size() > kMaxRegions) {
    violations.Add(field, absl::StrCat("has ", rules.regions_size(), " regions, at most ",
                                       kMaxRegions, " fit"));
    return regions;
  }
  std::set<std::string> names;
  for (int i = 0; i < rules.regions_size(); ++i) {
    const v1::RequiredRegion& asked = rules.regions(i);
    const std::string at = absl::StrFormat("%s[%d]", field, i);
    contract::Violations own;
    planning::RequiredRegion region;
    region.name = asked.name();
    CheckSiteName(asked.name(), at + ".name", names, own);
    region.outline = ReadOutline(asked, origin, at, own);
    ReadHeights(asked, origin, storeys, at, region, own);
    if (asked.has_required_density_per_m2()) {
      CheckRange(asked.required_density_per_m2(), 1e-3, kHuge, at + ".required_density_per_m2",
                 own);
      region.density = asked.required_density_per_m2();
    }
    if (asked.has_weight()) {
      CheckRange(asked.weight(), 0, 1e6, at + ".weight", own);
      region.weight = asked.weight();
    }
    if (!own.empty()) region.outline.clear();  // it overlaps nothing
    for (const planning::RequiredRegion& other : regions) {
      if (region.outline.empty() || other.outline.empty() || !Overlap(region, other)) continue;
      own.Add(at, absl::StrCat("overlaps region '", other.name, "'"));
      break;
    }
    violations.Append(own);
    regions.push_back(std::move(region));
  }
  return regions;
}

// True where all of a region lies out of the site.
bool IsOutside(const planning::RequiredRegion& region, const model::ModelConfig& site) {
  Eigen::AlignedBox2d extent;
  for (const Eigen::Vector2d& corner : region.outline) extent.extend(corner);
  const Eigen::Vector3d& half = site.max_half_extent;
  return !extent.isEmpty() &&
         (extent.intersection(Eigen::AlignedBox2d(-half.head<2>(), half.head<2>())).isEmpty() ||
          region.max_z <= -half.z() || region.min_z >= half.z());
}

}  // namespace

Eigen::Vector3d ReadVector(const v1::Vector3& vector, const std::string& field,
                           contract::Violations& violations) {
  CheckRange(vector.x(), -kMaxCoordinate, kMaxCoordinate, field + ".x", violations);
  CheckRange(vector.y(), -kMaxCoordinate, kMaxCoordinate, field + ".y", violations);
  CheckRange(vector.z(), -kMaxCoordinate, kMaxCoordinate, field + ".z", violations);
  return {vector.x(), vector.y(), vector.z()};
}

double ReadHeading(double heading_rad, const std::string& field, contract::Violations& violations) {
  constexpr double kMostTurned = 100;  // rad: of who counts turns, none turns fifteen times
  CheckRange(heading_rad, -kMostTurned, kMostTurned, field, violations);
  return heading_rad;
}

double ReadUpright(const v1::Quaternion& rotation, const std::string& field,
                   contract::Violations& violations) {
  constexpr double kMostTilt = sensor::Radians(15);
  const Eigen::Quaterniond q(rotation.w(), rotation.x(), rotation.y(), rotation.z());
  if (!(std::abs(q.norm() - 1) <= 1e-3)) {
    violations.Add(
        field, absl::StrFormat("has norm %g, must be a unit quaternion (w, x, y, z)", q.norm()));
    return 0;
  }
  const Eigen::Matrix3d turn = q.normalized().toRotationMatrix();
  const double tilt = std::acos(std::clamp(turn(2, 2), -1.0, 1.0));
  if (!(tilt <= kMostTilt)) {
    violations.Add(field,
                   absl::StrFormat("tilts the scanner by %.0f degrees: views are planned and "
                                   "evaluated for scanners that stand upright",
                                   sensor::Degrees(tilt)));
  }
  return std::atan2(turn(1, 0), turn(0, 0));
}

void CheckText(absl::string_view text, size_t max, const std::string& field,
               contract::Violations& violations) {
  if (text.size() > max) {
    violations.Add(field, absl::StrCat("has ", text.size(), " bytes, at most ", max, " fit"));
  }
}

void CheckRequestId(absl::string_view request_id, contract::Violations& violations) {
  const bool printable = std::all_of(request_id.begin(), request_id.end(),
                                     [](char c) { return c >= 0x21 && c <= 0x7E; });
  if (request_id.size() > 128 || !printable) {
    violations.Add("request_id", "must be 1 to 128 printable ASCII characters without spaces");
  }
}

void FillDefaults(v1::ScannerModel& s) {
  sensor::ScannerModel d;
  if (!s.preset().empty()) {
    const absl::StatusOr<sensor::Preset> preset = sensor::FindPreset(s.preset());
    const absl::StatusOr<sensor::ScanSetting> setting =
        preset.ok() ? preset->Setting(s.setting()) : preset.status();
    if (setting.ok()) {
      d = preset->At(*setting);
      s.set_setting(setting->name);
      if (!s.has_scan_duration()) {
        *s.mutable_scan_duration() = WriteDuration(60 * setting->minutes);
      }
    }
  }
  if (s.id().empty()) s.set_id(d.name);
  if (!s.has_azimuth_span_rad()) s.set_azimuth_span_rad(d.azimuth_span);
  if (!s.has_min_elevation_rad()) s.set_min_elevation_rad(d.elevation_min);
  if (!s.has_max_elevation_rad()) s.set_max_elevation_rad(d.elevation_max);
  if (!s.has_azimuth_step_rad()) s.set_azimuth_step_rad(d.azimuth_step);
  if (!s.has_elevation_step_rad()) s.set_elevation_step_rad(d.elevation_step);
  if (!s.has_min_range_m()) s.set_min_range_m(d.range_min);
  if (!s.has_max_range_m()) s.set_max_range_m(d.range_max);
  if (!s.has_range_noise_m()) s.set_range_noise_m(d.range_noise);
  if (!s.has_range_noise_ppm()) s.set_range_noise_ppm(d.range_noise_ppm);
  if (!s.has_max_incidence_rad()) s.set_max_incidence_rad(d.max_incidence);
  if (!s.has_clearance_m()) s.set_clearance_m(d.clearance);
  if (!s.has_positioning_error_m()) s.set_positioning_error_m(d.positioning_error);
}

void FillDefaults(v1::ModelConfig& m) {
  const model::ModelConfig d;
  if (!m.has_voxel_size_m()) m.set_voxel_size_m(d.voxel_size);
  if (!m.has_discontinuity_angle_rad()) m.set_discontinuity_angle_rad(d.discontinuity_angle);
  if (!m.has_max_half_extent()) {
    m.mutable_max_half_extent()->set_x(d.max_half_extent.x());
    m.mutable_max_half_extent()->set_y(d.max_half_extent.y());
    m.mutable_max_half_extent()->set_z(d.max_half_extent.z());
  }
}

void FillDefaults(v1::PlanningConfig& p) {
  const planning::PlanningConfig d;
  if (!p.has_required_density_per_m2()) p.set_required_density_per_m2(d.required_density);
  if (!p.has_viewcell_size_m()) p.set_viewcell_size_m(d.viewcell_size);
  if (!p.has_density_tolerance()) p.set_density_tolerance(d.density_tolerance);
  if (!p.has_min_viewpoint_height_m()) p.set_min_viewpoint_height_m(d.min_viewpoint_height);
  if (!p.has_max_viewpoint_height_m()) p.set_max_viewpoint_height_m(d.max_viewpoint_height);
  if (!p.has_require_reachable()) p.set_require_reachable(d.require_reachable);
  if (!p.has_scanner_width_m()) p.set_scanner_width_m(d.scanner_width);
  if (!p.has_scanner_height_m()) p.set_scanner_height_m(d.scanner_height);
  v1::SurfaceWeights& w = *p.mutable_weights();
  if (!w.has_true_surface()) w.set_true_surface(d.weights[0]);
  if (!w.has_occlusion()) w.set_occlusion(d.weights[1]);
  if (!w.has_hole_boundary()) w.set_hole_boundary(d.weights[2]);
  if (!w.has_image_boundary()) w.set_image_boundary(d.weights[3]);
  if (!p.has_pose_sensitivity()) p.set_pose_sensitivity(d.pose_sensitivity);
  if (!p.has_density_on_false_surface()) {
    p.set_density_on_false_surface(d.density_on_false_surface);
  }
  if (!p.has_min_deficit_share()) p.set_min_deficit_share(d.min_deficit_share);
  if (!p.has_min_counted_density_share())
    p.set_min_counted_density_share(d.min_counted_density_share);
  if (!p.has_unknown_depth_m()) p.set_unknown_depth_m(d.unknown_depth);
  if (p.evaluation_order() == v1::EVALUATION_ORDER_UNSPECIFIED) {
    p.set_evaluation_order(v1::EVALUATION_ORDER_ANYTIME);
  }
  if (p.station_basis() == v1::STATION_BASIS_UNSPECIFIED) {
    p.set_station_basis(v1::STATION_BASIS_EXPECTED);
  }
  if (!p.has_candidate_separation_m()) p.set_candidate_separation_m(d.candidate_separation);
  if (!p.has_max_view_count()) p.set_max_view_count(d.candidates);
  if (!p.has_max_checked_view_count()) p.set_max_checked_view_count(d.max_checked);
  if (!p.has_terminate_below_m2()) p.set_terminate_below_m2(d.terminate_below);
  if (!p.has_min_patch_area_m2()) p.set_min_patch_area_m2(d.min_patch_area);
  if (!p.has_confidence()) p.set_confidence(d.confidence);
  v1::RegistrationConfig& r = *p.mutable_registration();
  const registration::RegistrationConfig& dr = d.registration;
  if (!r.has_required_accuracy_m()) r.set_required_accuracy_m(dr.required_accuracy);
  if (!r.has_min_overlap()) r.set_min_overlap(dr.minimum_overlap);
  if (!r.has_correlation_length_m()) r.set_correlation_length_m(dr.correlation_length);
  if (!r.has_correlated_sigma_m()) r.set_correlated_sigma_m(dr.correlated_sigma);
  if (!r.has_normal_sigma_rad()) r.set_normal_sigma_rad(dr.normal_sigma);
  if (!r.has_sample_spacing_m()) r.set_sample_spacing_m(dr.sample_spacing);
  if (!r.has_max_correspondence_distance_m())
    r.set_max_correspondence_distance_m(dr.max_correspondence);
  if (!r.has_draw_count()) r.set_draw_count(dr.draws);
  if (!r.has_seed()) r.set_seed(dr.seed);
  if (!r.has_prior_position_sigma_m()) r.set_prior_position_sigma_m(dr.prior_sigma);
  if (!r.has_prior_heading_sigma_rad()) r.set_prior_heading_sigma_rad(dr.prior_heading_sigma);
}

// Fields with presence that are absent from `overrides` keep their values: Protobuf's own merge.
void Override(const v1::PlanningConfig& overrides, v1::PlanningConfig& config) {
  config.MergeFrom(overrides);
}

sensor::ScannerModel ReadScannerModel(const v1::ScannerModel& scanner, const std::string& field,
                                      contract::Violations& violations) {
  v1::ScannerModel s = scanner;
  FillDefaults(s);
  if (!contract::IsValidId(s.id())) {
    violations.Add(field + ".id", "must be 1 to 63 of [a-z0-9-], starting with a letter");
  }
  if (!s.preset().empty()) {
    const absl::StatusOr<sensor::Preset> preset = sensor::FindPreset(s.preset());
    if (!preset.ok()) {
      violations.Add(field + ".preset", preset.status().message());
    } else if (const auto setting = preset->Setting(s.setting()); !setting.ok()) {
      violations.Add(field + ".setting", setting.status().message());
    }
  } else if (!s.setting().empty()) {
    violations.Add(field + ".setting", "needs a preset");
  }
  if (s.has_scan_duration()) {
    CheckRange(ReadDuration(s.scan_duration()), 0, 86400, field + ".scan_duration", violations);
  }
  CheckRange(s.azimuth_span_rad(), 1e-3, 2 * sensor::kPi + 1e-9, field + ".azimuth_span_rad",
             violations);
  CheckRange(s.min_elevation_rad(), -kHalfPi, kHalfPi, field + ".min_elevation_rad", violations);
  CheckRange(s.max_elevation_rad(), -kHalfPi, kHalfPi, field + ".max_elevation_rad", violations);
  if (!(s.min_elevation_rad() < s.max_elevation_rad())) {
    violations.Add(field + ".max_elevation_rad", "must be above min_elevation_rad");
  }
  CheckRange(s.azimuth_step_rad(), 1e-5, 0.2, field + ".azimuth_step_rad", violations);
  CheckRange(s.elevation_step_rad(), 1e-5, 0.2, field + ".elevation_step_rad", violations);
  CheckRange(s.min_range_m(), 1e-3, 1000, field + ".min_range_m", violations);
  CheckRange(s.max_range_m(), 1e-3, 1000, field + ".max_range_m", violations);
  if (!(s.min_range_m() < s.max_range_m())) {
    violations.Add(field + ".max_range_m", "must be above min_range_m");
  }
  CheckRange(s.range_noise_m(), kTiny, 1, field + ".range_noise_m", violations);
  CheckRange(s.range_noise_ppm(), 0, 1e4, field + ".range_noise_ppm", violations);
  CheckRange(s.max_incidence_rad(), 1e-3, kHalfPi - 1e-6, field + ".max_incidence_rad", violations);
  CheckRange(s.clearance_m(), kTiny, 5, field + ".clearance_m", violations);
  CheckRange(s.positioning_error_m(), 0, 5, field + ".positioning_error_m", violations);
  sensor::ScannerModel m;
  m.name = s.id();
  m.azimuth_span = std::min(s.azimuth_span_rad(), 2 * sensor::kPi);
  m.elevation_min = s.min_elevation_rad();
  m.elevation_max = s.max_elevation_rad();
  m.azimuth_step = s.azimuth_step_rad();
  m.elevation_step = s.elevation_step_rad();
  m.range_min = s.min_range_m();
  m.range_max = s.max_range_m();
  m.range_noise = s.range_noise_m();
  m.range_noise_ppm = s.range_noise_ppm();
  m.max_incidence = s.max_incidence_rad();
  m.clearance = s.clearance_m();
  m.positioning_error = s.positioning_error_m();
  return m;
}

model::ModelConfig ReadModelConfig(const v1::ModelConfig& config, const std::string& field,
                                   contract::Violations& violations) {
  v1::ModelConfig m = config;
  FillDefaults(m);
  contract::Violations own;
  CheckRange(m.voxel_size_m(), 0.01, 0.5, field + ".voxel_size_m", own);
  CheckRange(m.discontinuity_angle_rad(), 1e-4, kHalfPi - 1e-6, field + ".discontinuity_angle_rad",
             own);
  const v1::Vector3& e = m.max_half_extent();
  CheckRange(e.x(), 1, 5000, field + ".max_half_extent.x", own);
  CheckRange(e.y(), 1, 5000, field + ".max_half_extent.y", own);
  CheckRange(e.z(), 1, 5000, field + ".max_half_extent.z", own);
  model::ModelConfig out;
  out.voxel_size = m.voxel_size_m();
  out.discontinuity_angle = m.discontinuity_angle_rad();
  out.max_half_extent = {e.x(), e.y(), e.z()};
  // How far the model's tree reaches goes with the voxel.
  const absl::Status possible = out.Validate();
  if (own.empty() && !possible.ok()) own.Add(field + ".max_half_extent", possible.message());
  violations.Append(own);
  return out;
}

void CheckTargets(const google::protobuf::RepeatedPtrField<v1::TargetSighting>& targets,
                  const std::string& field, contract::Violations& violations) {
  constexpr int kMostTargets = 100;
  constexpr size_t kMaxName = 100;
  if (targets.size() > kMostTargets) {
    violations.Add(field, absl::StrCat("has ", targets.size(), " targets, at most ", kMostTargets));
    return;
  }
  std::set<absl::string_view> names;
  for (int i = 0; i < targets.size(); ++i) {
    const v1::TargetSighting& target = targets[i];
    const std::string at = absl::StrCat(field, "[", i, "]");
    if (target.name().empty()) violations.Add(at + ".name", "is required");
    CheckText(target.name(), kMaxName, at + ".name", violations);
    if (!names.insert(target.name()).second) {
      violations.Add(at + ".name", absl::StrCat("'", target.name(), "' is there twice"));
    }
    if (!target.has_in_scan()) violations.Add(at + ".in_scan", "is required");
    ReadVector(target.in_scan(), at + ".in_scan", violations);
    ReadVector(target.in_world(), at + ".in_world", violations);
    if (target.has_sigma_m()) CheckRange(target.sigma_m(), 1e-6, 1, at + ".sigma_m", violations);
  }
}

sensor::PosePrior ReadPosePrior(const v1::PosePrior& prior, const Eigen::Vector3d& origin,
                                const std::string& field, contract::Violations& violations) {
  sensor::PosePrior out;
  const v1::Pose& pose = prior.pose();
  if (!pose.has_rotation()) violations.Add(field + ".pose.rotation", "is required");
  if (!pose.has_translation()) violations.Add(field + ".pose.translation", "is required");
  Eigen::Quaterniond rotation(pose.rotation().w(), pose.rotation().x(), pose.rotation().y(),
                              pose.rotation().z());
  if (pose.has_rotation() && !(std::abs(rotation.norm() - 1.0) <= 1e-3)) {
    violations.Add(
        field + ".pose.rotation",
        absl::StrFormat("has norm %g, must be a unit quaternion (w, x, y, z)", rotation.norm()));
  } else if (pose.has_rotation()) {
    rotation.normalize();
    out.T_world_scan.linear() = rotation.toRotationMatrix();
  }
  out.T_world_scan.translation() =
      ReadVector(pose.translation(), field + ".pose.translation", violations) - origin;

  const auto& numbers = prior.covariance();
  if (numbers.size() == 36) {
    const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> map(numbers.data());
    const sensor::Matrix6d covariance = map;
    if (!covariance.allFinite() || !covariance.isApprox(covariance.transpose(), 1e-9) ||
        Eigen::LLT<sensor::Matrix6d>(covariance).info() != Eigen::Success) {
      violations.Add(field + ".covariance", "must be finite, symmetric and positive definite");
    } else {
      out.covariance = covariance;
    }
  } else if (!numbers.empty()) {
    violations.Add(field + ".covariance",
                   absl::StrCat("has ", numbers.size(), " numbers, must have 36 or none"));
  }
  if (prior.has_levelled_sigma_rad()) {
    CheckRange(prior.levelled_sigma_rad(), 1e-7, 0.2, field + ".levelled_sigma_rad", violations);
    out.levelled_sigma = prior.levelled_sigma_rad();
  }
  out.from_file_header = prior.source() == v1::POSE_PRIOR_SOURCE_FILE_HEADER;
  out.trusted = prior.trusted();
  if (out.trusted && numbers.empty()) {
    violations.Add(field + ".covariance", "is required for a trusted pose");
  }
  return out;
}

planning::PlanningConfig ReadPlanningConfig(const v1::PlanningConfig& config,
                                            const v1::SiteRules& rules,
                                            const Eigen::Vector3d& origin, double voxel_size,
                                            const std::string& f, const std::string& rules_field,
                                            contract::Violations& v) {
  v1::PlanningConfig p = config;
  FillDefaults(p);
  CheckRange(p.required_density_per_m2(), 1e-3, kHuge, f + ".required_density_per_m2", v);
  CheckRange(p.viewcell_size_m(), 0.01, 2, f + ".viewcell_size_m", v);
  const double ratio = p.viewcell_size_m() / voxel_size;
  if (!(std::abs(ratio - std::round(ratio)) <= 1e-6) || !(std::round(ratio) >= 1)) {
    v.Add(f + ".viewcell_size_m", absl::StrFormat("is %g, must be a multiple of the voxel size %g",
                                                  p.viewcell_size_m(), voxel_size));
  }
  CheckRange(p.density_tolerance(), 0, 0.999, f + ".density_tolerance", v);
  CheckRange(p.min_viewpoint_height_m(), 1e-3, 100, f + ".min_viewpoint_height_m", v);
  CheckRange(p.max_viewpoint_height_m(), 1e-3, 100, f + ".max_viewpoint_height_m", v);
  if (!(p.max_viewpoint_height_m() - p.min_viewpoint_height_m() >= p.viewcell_size_m() - 1e-9)) {
    v.Add(f + ".max_viewpoint_height_m",
          absl::StrFormat("must be above min_viewpoint_height_m by a viewcell (%g m) at least",
                          p.viewcell_size_m()));
  }
  if (p.has_floor_z_m()) {
    CheckRange(p.floor_z_m(), -kMaxCoordinate, kMaxCoordinate, f + ".floor_z_m", v);
  }
  CheckRange(p.scanner_width_m(), 1e-3, 10, f + ".scanner_width_m", v);
  CheckRange(p.scanner_height_m(), 1e-3, 20, f + ".scanner_height_m", v);
  const v1::SurfaceWeights& w = p.weights();
  CheckRange(w.true_surface(), 0, 1e6, f + ".weights.true_surface", v);
  CheckRange(w.occlusion(), 0, 1e6, f + ".weights.occlusion", v);
  CheckRange(w.hole_boundary(), 0, 1e6, f + ".weights.hole_boundary", v);
  CheckRange(w.image_boundary(), 0, 1e6, f + ".weights.image_boundary", v);
  if (w.true_surface() == 0 && w.occlusion() == 0 && w.hole_boundary() == 0 &&
      w.image_boundary() == 0) {
    v.Add(f + ".weights", "must not all be 0");
  }
  CheckRange(p.min_deficit_share(), 0, 1, f + ".min_deficit_share", v);
  CheckRange(p.min_counted_density_share(), 0, 0.999, f + ".min_counted_density_share", v);
  CheckRange(p.unknown_depth_m(), 0, 10, f + ".unknown_depth_m", v);
  if (!v1::StationBasis_IsValid(p.station_basis())) {
    v.Add(f + ".station_basis",
          absl::StrCat("is ", static_cast<int>(p.station_basis()),
                       ", must be STATION_BASIS_KNOWN or STATION_BASIS_EXPECTED"));
  }
  if (!v1::EvaluationOrder_IsValid(p.evaluation_order())) {
    v.Add(f + ".evaluation_order",
          absl::StrCat("is ", static_cast<int>(p.evaluation_order()),
                       ", must be EVALUATION_ORDER_ANYTIME or EVALUATION_ORDER_PATCHES"));
  }
  CheckRange(p.candidate_separation_m(), 0, 100, f + ".candidate_separation_m", v);
  CheckRange(p.max_view_count(), 1, 100, f + ".max_view_count", v);
  CheckRange(p.max_checked_view_count(), 1, 1000, f + ".max_checked_view_count", v);
  if (p.max_checked_view_count() < p.max_view_count()) {
    v.Add(f + ".max_checked_view_count",
          absl::StrCat("is ", p.max_checked_view_count(), ", must be max_view_count (",
                       p.max_view_count(), ") at least"));
  }
  CheckRange(p.terminate_below_m2(), 0, kHuge, f + ".terminate_below_m2", v);
  CheckRange(p.min_patch_area_m2(), 0, kHuge, f + ".min_patch_area_m2", v);
  CheckRange(p.confidence(), kTiny, 1 - 1e-9, f + ".confidence", v);
  Check(p.registration(), f + ".registration", v);

  planning::PlanningConfig out;
  out.required_density = p.required_density_per_m2();
  out.viewcell_size = p.viewcell_size_m();
  out.density_tolerance = p.density_tolerance();
  out.min_viewpoint_height = p.min_viewpoint_height_m();
  out.max_viewpoint_height = p.max_viewpoint_height_m();
  if (p.has_floor_z_m()) out.floor_z = p.floor_z_m() - origin.z();
  out.require_reachable = p.require_reachable();
  out.scanner_width = p.scanner_width_m();
  out.scanner_height = p.scanner_height_m();
  out.weights = {w.true_surface(), w.occlusion(), w.hole_boundary(), w.image_boundary()};
  out.pose_sensitivity = p.pose_sensitivity();
  out.density_on_false_surface = p.density_on_false_surface();
  out.min_deficit_share = p.min_deficit_share();
  out.min_counted_density_share = p.min_counted_density_share();
  out.unknown_depth = p.unknown_depth_m();
  out.order = p.evaluation_order() == v1::EVALUATION_ORDER_PATCHES
                  ? planning::EvaluationOrder::kPatches
                  : planning::EvaluationOrder::kAnytime;
  out.station_basis = p.station_basis() == v1::STATION_BASIS_KNOWN
                          ? planning::StationBasis::kKnown
                          : planning::StationBasis::kExpected;
  out.candidate_separation = p.candidate_separation_m();
  out.candidates = p.max_view_count();
  out.max_checked = p.max_checked_view_count();
  out.terminate_below = p.terminate_below_m2();
  out.min_patch_area = p.min_patch_area_m2();
  out.confidence = p.confidence();
  const v1::RegistrationConfig& r = p.registration();
  out.registration.required_accuracy = r.required_accuracy_m();
  out.registration.minimum_overlap = r.min_overlap();
  out.registration.correlation_length = r.correlation_length_m();
  out.registration.correlated_sigma = r.correlated_sigma_m();
  out.registration.normal_sigma = r.normal_sigma_rad();
  out.registration.sample_spacing = r.sample_spacing_m();
  out.registration.max_correspondence = r.max_correspondence_distance_m();
  out.registration.draws = r.draw_count();
  out.registration.seed = r.seed();
  out.registration.prior_sigma = r.prior_position_sigma_m();
  out.registration.prior_heading_sigma = r.prior_heading_sigma_rad();

  if (rules.has_region_of_interest()) {
    out.region_of_interest =
        ReadBox(rules.region_of_interest(), origin, rules_field + ".region_of_interest", v);
  }
  if (rules.keep_out_size() > kMaxKeepOut) {
    v.Add(rules_field + ".keep_out",
          absl::StrCat("has ", rules.keep_out_size(), " boxes, at most ", kMaxKeepOut, " fit"));
  } else {
    for (int i = 0; i < rules.keep_out_size(); ++i) {
      out.keep_out.push_back(ReadBox(rules.keep_out(i), origin,
                                     absl::StrFormat("%s.keep_out[%d]", rules_field, i), v));
    }
  }
  out.storeys = ReadStoreys(rules, origin.z(), rules_field + ".storeys", v);
  out.regions = ReadRegions(rules, origin, out.storeys, rules_field + ".regions", v);
  return out;
}

void CheckSession(const v1::Session& session, const std::string& prefix,
                  contract::Violations& violations) {
  CheckText(session.display_name(), kMaxDisplayName, prefix + "display_name", violations);
  const Eigen::Vector3d origin = ReadVector(session.origin(), prefix + "origin", violations);
  const model::ModelConfig model =
      ReadModelConfig(session.model_config(), prefix + "model_config", violations);
  const planning::PlanningConfig planning =
      ReadPlanningConfig(session.planning_config(), session.site_rules(), origin, model.voxel_size,
                         prefix + "planning_config", prefix + "site_rules", violations);
  for (size_t i = 0; i < planning.regions.size(); ++i) {
    if (!IsOutside(planning.regions[i], model)) continue;
    violations.Add(absl::StrFormat("%ssite_rules.regions[%d]", prefix, i),
                   "lies outside of the site (model_config.max_half_extent around its origin)");
  }
  if (session.scanner_models_size() > kMaxScannerModels) {
    violations.Add(prefix + "scanner_models",
                   absl::StrCat("has ", session.scanner_models_size(), " models, at most ",
                                kMaxScannerModels, " fit"));
    return;
  }
  std::set<std::string> ids;
  for (int i = 0; i < session.scanner_models_size(); ++i) {
    const std::string field = absl::StrFormat("%sscanner_models[%d]", prefix, i);
    contract::Violations own;
    const sensor::ScannerModel scanner = ReadScannerModel(session.scanner_models(i), field, own);
    if (!ids.insert(scanner.name).second) {
      own.Add(field + ".id", absl::StrCat("'", scanner.name, "' is used twice"));
    }
    if (own.empty() && scanner.MaxSamplingDensity() < planning.required_density) {
      own.Add(
          prefix + "planning_config.required_density_per_m2",
          absl::StrFormat("is %g samples/m^2; scanner '%s' reaches %g at most, at its nearest "
                          "range",
                          planning.required_density, scanner.name, scanner.MaxSamplingDensity()));
    }
    for (size_t r = 0; own.empty() && r < planning.regions.size(); ++r) {
      const double density = planning.regions[r].density.value_or(0);
      if (!(density > scanner.MaxSamplingDensity())) continue;
      violations.Add(absl::StrFormat("%ssite_rules.regions[%d].required_density_per_m2", prefix, r),
                     absl::StrFormat(
                         "is %g samples/m^2; scanner '%s' reaches %g at most, at its nearest range",
                         density, scanner.name, scanner.MaxSamplingDensity()));
    }
    violations.Append(own);
  }
}

}  // namespace vantage::conversion
