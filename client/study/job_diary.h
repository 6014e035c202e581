// Keeps a job's record: the true gain of each scan, whichever planner chose its place.
#ifndef VANTAGE_CLIENT_STUDY_JOB_DIARY_H_
#define VANTAGE_CLIENT_STUDY_JOB_DIARY_H_

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "client/simulated_job/simulated_job.h"
#include "client/study/room_watch.h"
#include "client/study/study_scene.h"
#include "core/parallel/parallel.h"
#include "core/simulation/ground_truth.h"
#include "vantage/study_records/v1/study.pb.h"

namespace vantage::study {

// What the job knows of a scan.
struct ScanMade {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m, scene frame: where it was meant to be
  Eigen::Vector3d at = Eigen::Vector3d::Zero();        // m, scene frame: where it was made
  bool merged = false;
  bool second_prior = false;
  std::optional<double> predicted;                 // m^2 brought to density
  std::optional<simulated_job::Promise> promised;  // all of what the plan said of it; of ours
  std::optional<double> brought;                   // m^2 that came to density in the model
  std::optional<double> overlap;                   // found in aligning it
  double off = 0;                                  // m, pose in the model against the truth
  double plan_seconds = 0;                         // spent on choosing it
  std::optional<double> plan_budget;               // s, of the plan that chose it
  std::optional<int> plan_attempts;
  std::vector<std::string> notes;
  std::vector<simulated_job::TriedPlace> expected_places;  // gone to for it, in order
  // The planner's answer about the truly best position, where it was asked.
  std::optional<double> best_predicted;  // m^2 brought to density
  std::string best_refused;
};

class JobDiary {
 public:
  // References are kept.
  JobDiary(const StudyScene& scene, const std::string& planner, uint64_t seed,
           parallel::Parallel& parallel);

  void Add(const ScanMade& scan);

  int scans() const { return record_.scans_size(); }
  // Share of the attainable surface that is at density.
  double covered() const { return last_.attained_share(); }
  // The allowed position with the largest true gain now.
  struct Best {
    size_t position = 0;     // index into StudyScene::positions()
    size_t new_samples = 0;  // of the ground truth, at density only once it is scanned from there
  };
  Best BestNow() const;
  // Samples at density.
  const simulation::SampleSet& at_density() const { return at_density_; }
  // True when enough is covered, or as many scans were made as allowed.
  bool Over() const;

  study_records::v1::JobRecord& record() { return record_; }

 private:
  const StudyScene& scene_;
  parallel::Parallel& parallel_;
  const RoomWatch watch_;
  simulation::GroundTruth truth_;
  simulation::TrueCoverage last_;
  simulation::SampleSet at_density_;
  double minutes_ = 0;
  std::optional<Eigen::Vector3d> stood_;
  study_records::v1::JobRecord record_;
};

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_JOB_DIARY_H_
