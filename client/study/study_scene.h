// A scene of a study and the truth about it, made once for all jobs in it.
#ifndef VANTAGE_CLIENT_STUDY_STUDY_SCENE_H_
#define VANTAGE_CLIENT_STUDY_STUDY_SCENE_H_

#include <Eigen/Core>
#include <bit>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/simulated_job/placement.h"
#include "client/simulated_job/site.h"
#include "client/simulated_job/walk_map.h"
#include "core/parallel/parallel.h"
#include "core/sensor/scanner_model.h"
#include "core/simulation/ground_truth.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::study {

// The settings that a study holds constant. Describe() has all of them and goes with every record.
struct StudySettings {
  sensor::ScannerModel scanner;
  std::string instrument;  // that `scanner` is, for readers; empty: none in particular
  double preview = 0;      // rad between the rays of scans, which stand for native ones; 0: all
  simulation::ScanFaults faults;
  double required_density = 2500;             // samples / m^2
  double heading_error = sensor::Radians(5);  // rad, one sigma
  double tilt = sensor::Radians(0.5);         // rad, one sigma
  size_t truth_samples = 20'000;              // points on the mesh
  double goal = 0.95;          // share of the attainable surface that scans are counted to
  double enough = 0.97;        // a job ends here
  int most_scans = 0;          // 0: as the scene's kind has it
  double walking_speed = 0.5;  // m/s, with the tripod
  double setup_minutes = 1.0;  // a scan, before it
  double scan_minutes = 2.0;   // a scan
  double cover_lattice = 0.6;  // m, between places that 'optimal' chooses from; a multiple of 0.3
  double cover_overlap = 0.1;  // of the larger scan, from which on 'optimal' links two
  double cover_seconds = 120;  // wall time of 'optimal'
  std::optional<Eigen::Vector3d> start;  // m, scene frame; else by seed, one of the allowed places
  std::string server;                    // host:port of a running one; empty: the study's own

  // The settings with the scene's own most_scans where none is given.
  StudySettings For(const std::string& scene) const;
  std::string Describe() const;
};

size_t CountOf(const simulation::SampleSet& set);
// Elements of `set` that are not in `without`.
size_t CountWithout(const simulation::SampleSet& set, const simulation::SampleSet& without);
void AddTo(simulation::SampleSet& set, const simulation::SampleSet& more);

class StudyScene {
 public:
  // FAILED_PRECONDITION: nobody can stand in it, or nothing can be measured at the density.
  // INVALID_ARGUMENT: the start is not within half a metre of an allowed position.
  static absl::StatusOr<std::unique_ptr<StudyScene>> Make(simulated_job::Site site,
                                                          const StudySettings& settings,
                                                          parallel::Parallel& parallel);
  StudyScene(const StudyScene&) = delete;
  StudyScene& operator=(const StudyScene&) = delete;

  const std::string& name() const { return site_.name; }
  const simulated_job::Site& site() const { return site_; }
  const StudySettings& settings() const { return settings_; }
  const simulation::SimulatedScanner& scanner() const { return scanner_; }
  const simulation::GroundTruth& truth() const { return truth_; }  // without scans
  const simulated_job::WalkMap& walks() const { return walks_; }
  int most_scans() const { return settings_.most_scans; }

  // The allowed positions (a lattice; m, scene frame), and what each measures at density.
  const std::vector<Eigen::Vector3d>& positions() const { return positions_; }
  const std::vector<simulation::SampleSet>& sets() const { return sets_; }
  double area_per_sample() const { return truth_.area_per_sample(); }  // m^2
  // Samples that some allowed position measures at density.
  const simulation::SampleSet& attainable() const { return attainable_; }

  // The first scan's place for a seed, the same for every planner: one of the allowed positions,
  // the one nearest to the start of the settings where these have one.
  size_t StartIndex(uint64_t seed) const;
  const Eigen::Vector3d& StartFor(uint64_t seed) const { return positions_[StartIndex(seed)]; }
  simulated_job::PlacementErrors ErrorsFor(uint64_t seed) const;

 private:
  StudyScene(simulated_job::Site site, const StudySettings& settings, parallel::Parallel& parallel);

  simulated_job::Site site_;
  StudySettings settings_;
  simulation::SimulatedScanner scanner_;
  std::vector<Eigen::Vector3d> positions_;
  simulation::GroundTruth truth_;
  std::vector<simulation::SampleSet> sets_;
  simulation::SampleSet attainable_;
  simulated_job::WalkMap walks_;
};

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_STUDY_SCENE_H_
