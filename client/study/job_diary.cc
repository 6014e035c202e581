#include "client/study/job_diary.h"

#include "client/library/geometry.h"
#include "client/simulated_job/placement.h"
#include "client/study/job_store.h"

namespace vantage::study {
namespace {

void WritePromise(const simulated_job::Promise& promise, study_records::v1::ScanRecord& record) {
  record.set_model_gain(promise.model_gain);
  record.set_predicted_overlap(promise.overlap);
  study_records::v1::GainForecast& forecast = *record.mutable_forecast();
  forecast.set_lower(promise.lower);
  forecast.set_upper(promise.upper);
  *forecast.mutable_by_kind() = promise.by_kind;
  forecast.set_expected_surface(promise.expected_surface);
}

}  // namespace

JobDiary::JobDiary(const StudyScene& scene, const std::string& planner, uint64_t seed,
                   parallel::Parallel& parallel)
    : scene_(scene),
      parallel_(parallel),
      watch_(scene.site(), scene.scanner(), scene.settings().scanner),
      truth_(scene.truth()),
      last_(truth_.Measure()),
      at_density_(truth_.AtDensity()) {
  record_.set_format_version(kRecordFormat);
  record_.set_scene(scene.name());
  record_.set_planner(planner);
  record_.set_seed(seed);
  record_.set_settings(scene.settings().Describe());
  record_.set_attainable_area(last_.attainable_at_density_area);
  watch_.Begin(record_);
}

JobDiary::Best JobDiary::BestNow() const {
  Best best;
  for (size_t i = 0; i < scene_.sets().size(); ++i) {
    const size_t new_samples = CountWithout(scene_.sets()[i], at_density_);
    if (new_samples > best.new_samples) best = {i, new_samples};
  }
  return best;
}

void JobDiary::Add(const ScanMade& scan) {
  const StudySettings& settings = scene_.settings();
  study_records::v1::ScanRecord& record = *record_.add_scans();
  record.set_number(record_.scans_size());
  *record.mutable_position() = client::ToProto(scan.position);
  record.set_merged(scan.merged);
  record.set_second_prior(scan.second_prior);
  const double walk = stood_ ? scene_.walks().Distance(*stood_, scan.position) : 0;
  stood_ = scan.position;
  record.set_walk(walk);
  minutes_ += walk / settings.walking_speed / 60 + settings.setup_minutes + settings.scan_minutes;
  for (const simulated_job::TriedPlace& tried : scan.expected_places) {
    if (!tried.free) minutes_ += simulated_job::kNoFreeSpotMinutes;
  }
  record.set_minutes(minutes_);
  if (scan.predicted) record.set_predicted(*scan.predicted);
  if (scan.promised) WritePromise(*scan.promised, record);
  if (scan.brought) record.set_brought(*scan.brought);
  if (scan.overlap) record.set_overlap(*scan.overlap);
  const Best best = BestNow();
  record.set_best(static_cast<double>(best.new_samples) * scene_.area_per_sample());
  *record.mutable_best_position() = client::ToProto(scene_.positions()[best.position]);
  if (scan.best_predicted) record.set_best_predicted(*scan.best_predicted);
  record.set_best_refused(scan.best_refused);
  const simulation::TrueCoverage before = last_;
  if (scan.merged) {
    truth_.AddScan(scan.at, parallel_);
    last_ = truth_.Measure();
    at_density_ = truth_.AtDensity();
    watch_.Note(scan.at, record.number(), record_);
  }
  record.set_obtained(last_.equivalent_area - before.equivalent_area);
  record.set_gained(last_.attained_area - before.attained_area);
  record.set_covered(last_.attained_share());
  record.set_off(scan.off);
  record.set_plan_seconds(scan.plan_seconds);
  if (scan.plan_budget) record.set_plan_budget(*scan.plan_budget);
  if (scan.plan_attempts) record.set_plan_attempts(*scan.plan_attempts);
  for (const std::string& note : scan.notes) record.add_notes(note);
  for (const simulated_job::TriedPlace& tried : scan.expected_places) {
    study_records::v1::ExpectedPlace& place = *record.add_expected_places();
    place.set_chance(tried.chance);
    place.set_free(tried.free);
  }
}

bool JobDiary::Over() const {
  return covered() >= scene_.settings().enough || scans() >= scene_.most_scans();
}

}  // namespace vantage::study
