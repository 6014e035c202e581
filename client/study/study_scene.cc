#include "client/study/study_scene.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/library/error.h"
#include "client/study/scene_list.h"
#include "core/simulation/random_sequence.h"

namespace vantage::study {
namespace {

constexpr uint64_t kStartStream = 200;
constexpr double kNearStart = 0.5;  // m

size_t NearestTo(const Eigen::Vector3d& place, const std::vector<Eigen::Vector3d>& positions) {
  return static_cast<size_t>(std::min_element(positions.begin(), positions.end(),
                                              [&](const auto& a, const auto& b) {
                                                return (a - place).squaredNorm() <
                                                       (b - place).squaredNorm();
                                              }) -
                             positions.begin());
}

}  // namespace

StudySettings StudySettings::For(const std::string& scene) const {
  StudySettings settings = *this;
  if (settings.most_scans <= 0) settings.most_scans = MostScans(scene);
  return settings;
}

std::string StudySettings::Describe() const {
  return absl::StrFormat(
             "%ssteps %.4f x %.4f deg, rays each %s, elevation %.0f to %.0f deg, range %.1f to "
             "%.1f m, "
             "noise %.1f mm, "
             "incidence %.0f deg, clearance %.2f m, D %.0f / m2, positioning %.3f m, heading %.1f "
             "deg, "
             "tilt %.2f deg, drop-outs %d%d %.2f %.2f, mixed pixels %.5f, %d truth samples, goal "
             "%.3f, "
             "ends at "
             "%.3f or %s, walking %.2f m/s, %.1f + %.2f min a scan, planned by %s",
             instrument.empty() ? "" : absl::StrCat(instrument, ", "),
             sensor::Degrees(scanner.azimuth_step), sensor::Degrees(scanner.elevation_step),
             preview > 0 ? absl::StrFormat("%.3f deg", sensor::Degrees(preview)) : "step",
             sensor::Degrees(scanner.elevation_min), sensor::Degrees(scanner.elevation_max),
             scanner.range_min, scanner.range_max,
             faults.range_noise ? 1000 * scanner.range_noise : 0.0,
             sensor::Degrees(scanner.max_incidence), scanner.clearance, required_density,
             scanner.positioning_error, sensor::Degrees(heading_error), sensor::Degrees(tilt),
             faults.glass_drops_out, faults.mirror_reflections, faults.grazing_dropout,
             faults.dark_dropout, faults.beam_divergence, static_cast<int>(truth_samples), goal,
             enough,
             most_scans > 0 ? absl::StrFormat("%d scans", most_scans)
                            : "the scans that the scene allows",
             walking_speed, setup_minutes, scan_minutes,
             server.empty() ? "servers of its own" : server) +
         absl::StrFormat(
             ", optimal on %.1f m, linked from %.3f of overlap on, in %.0f s, %s", cover_lattice,
             cover_overlap, cover_seconds,
             start ? absl::StrFormat("start %.2f %.2f %.2f", start->x(), start->y(), start->z())
                   : "starts by seed");
}

size_t CountOf(const simulation::SampleSet& set) {
  size_t count = 0;
  for (const uint64_t word : set) count += static_cast<size_t>(std::popcount(word));
  return count;
}

size_t CountWithout(const simulation::SampleSet& set, const simulation::SampleSet& without) {
  size_t count = 0;
  for (size_t i = 0; i < set.size(); ++i) {
    count += static_cast<size_t>(std::popcount(set[i] & ~without[i]));
  }
  return count;
}

void AddTo(simulation::SampleSet& set, const simulation::SampleSet& more) {
  for (size_t i = 0; i < set.size(); ++i) set[i] |= more[i];
}

StudyScene::StudyScene(simulated_job::Site site, const StudySettings& settings,
                       parallel::Parallel& parallel)
    : site_(std::move(site)),
      settings_(settings.For(site_.name)),
      scanner_(site_.mesh),
      positions_(simulated_job::AllowedPositions(scanner_, site_, settings.scanner)),
      truth_(site_.mesh, scanner_, settings.scanner, settings.required_density, positions_,
             settings.truth_samples, parallel),
      sets_(truth_.MeasuredAtDensity(positions_, parallel)),
      walks_(scanner_, site_) {
  if (!sets_.empty()) attainable_.assign(sets_.front().size(), 0);
  for (const simulation::SampleSet& set : sets_) AddTo(attainable_, set);
}

absl::StatusOr<std::unique_ptr<StudyScene>> StudyScene::Make(simulated_job::Site site,
                                                             const StudySettings& settings,
                                                             parallel::Parallel& parallel) {
  std::unique_ptr<StudyScene> scene(new StudyScene(std::move(site), settings, parallel));
  if (CountOf(scene->attainable_) == 0) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "scene '%s' has %d places to stand, and nothing that can be measured at "
        "%.0f samples / m2 from them",
        scene->name(), static_cast<int>(scene->positions_.size()), settings.required_density));
  }
  if (settings.start) {
    const double away = (scene->StartFor(1) - *settings.start).norm();
    if (away > kNearStart) {
      return client::WithFix(
          absl::InvalidArgumentError(absl::StrFormat(
              "--start: no place to stand within %.1f m of (%.2f, %.2f, %.2f) in '%s'; the nearest "
              "is (%.2f, %.2f, %.2f)",
              kNearStart, settings.start->x(), settings.start->y(), settings.start->z(),
              scene->name(), scene->StartFor(1).x(), scene->StartFor(1).y(),
              scene->StartFor(1).z())),
          "name one in metres of the scene's frame, at the height of the scanner");
    }
  }
  return scene;
}

size_t StudyScene::StartIndex(uint64_t seed) const {
  if (settings_.start) return NearestTo(*settings_.start, positions_);
  return simulation::RandomBits(seed, 1, kStartStream) % positions_.size();
}

simulated_job::PlacementErrors StudyScene::ErrorsFor(uint64_t seed) const {
  return {seed, settings_.scanner.positioning_error, settings_.heading_error, settings_.tilt};
}

}  // namespace vantage::study
