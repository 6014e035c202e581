#include "server/report/report.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/contract/error.h"
#include "server/conversion/to_proto.h"
#include "server/report/collect_record.h"
#include "server/report/sections.h"

namespace vantage::report {
namespace {

// A plan's raster at its largest, with the columns that it is made of.
constexpr int64_t kPlanBytes = int64_t{64} << 20;

// Merges that come in between, at most; of a job in which they never end, the last is taken.
constexpr int kTries = 3;

}  // namespace

Report::Report(std::shared_ptr<session::Session> session, ReportOptions options)
    : session_(std::move(session)),
      options_(options),
      model_(session_->model().Current()),
      file_name_(absl::StrCat(session_->id(), ".html")) {}

Report::~Report() {
  if (counted_) session_->model().EndExport();
}

absl::StatusOr<std::unique_ptr<Report>> Report::Create(std::shared_ptr<session::Session> session,
                                                       const v1::ExportReportRequest& request) {
  ReportOptions options;
  const std::optional<Language> language =
      request.language().empty() ? Language::kEnglish : LanguageOf(request.language());
  if (!language.has_value()) {
    return contract::InvalidField(
        "language", absl::StrCat("is '", request.language(), "', must be one of: en, de"));
  }
  options.language = *language;
  options.utc_offset = absl::Seconds(conversion::ReadDuration(request.utc_offset()));
  if (request.has_required_coverage()) options.required_coverage = request.required_coverage();
  std::unique_ptr<Report> made(new Report(std::move(session), options));
  made->counted_ = made->session_->model().BeginExport();
  if (!made->counted_) {
    return contract::Retryable(absl::StatusCode::kResourceExhausted, "TOO_MANY_EXPORTS",
                               "as many exports of the session are under way as it may have",
                               absl::Seconds(5));
  }
  if (made->model_.view == nullptr) {
    // Of a job without scans there is a report: that there is nothing.
    absl::Status why = made->session_->model().WhyNone();
    if (contract::ReasonOf(why) != "MODEL_EMPTY") return why;
  }
  return made;
}

absl::StatusOr<std::string> Report::Next() {
  const Words say(options_);
  const size_t part = part_++;
  if (part == 0) {
    absl::StatusOr<session::MemoryAccount::Reservation> room =
        session_->model().Reserve(kPlanBytes);
    if (!room.ok()) return room.status();
    room_ = *std::move(room);
    // A scan that is merged meanwhile would put tables of one model beside plans of another.
    for (int tries = 0; tries < kTries; ++tries) {
      model_ = session_->model().Current();
      absl::StatusOr<JobRecord> record = CollectRecord(*session_, model_);
      if (!record.ok()) return record.status();
      record_ = *std::move(record);
      if (record_.coverage.model_version() == model_.version) break;
    }
    storeys_ = StoreysOf(record_);
    standing_ = MeasureStanding(record_, options_.required_coverage);
    return (WriteHead(record_, say) + WriteSignOff(record_, standing_, say)).markup();
  }
  if (part <= storeys_.size()) {
    // From the highest down, as a building is drawn.
    return WriteFloorPlan(record_, storeys_, storeys_.size() - part, part == 1, say).markup();
  }
  switch (part - storeys_.size()) {
    case 1:
      return WriteStations(record_, standing_, say).markup();
    case 2:
      return WriteRemaining(record_, standing_, say).markup();
    case 3:
      return WritePromises(record_, say).markup();
    case 4:
      return (WriteInstruments(record_, say) + WriteChanges(record_, say)).markup();
    case 5:
      return (WriteDecisions(record_, say) + WriteEnd()).markup();
    default:
      return std::string();
  }
}

}  // namespace vantage::report
