#include "server/session/export.h"

#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/model/view/export.h"
#include "server/contract/error.h"
#include "server/conversion/to_proto.h"
#include "server/session/ply.h"

namespace vantage::session {
namespace {

const char* Extension(v1::ExportFormat format) {
  switch (format) {
    case v1::EXPORT_FORMAT_OCTOMAP:
      return ".ot";
    case v1::EXPORT_FORMAT_OCTOMAP_BINARY:
      return ".bt";
    case v1::EXPORT_FORMAT_PATCH_PLY:
      return "-patches.ply";
    case v1::EXPORT_FORMAT_SCANS_PLY:
      return "-scans.ply";
    case v1::EXPORT_FORMAT_SCANS_E57:
      return ".e57";
    case v1::EXPORT_FORMAT_ARCHIVE:
      return ".vantage";
    default:
      return "-surface.ply";
  }
}

}  // namespace

Export::Export(std::shared_ptr<Session> session, v1::ExportFormat format)
    : session_(std::move(session)), format_(format), model_(session_->model().Current()) {}

Export::~Export() {
  if (counted_) session_->model().EndExport();
}

absl::StatusOr<std::unique_ptr<Export>> Export::Create(std::shared_ptr<Session> session,
                                                       const v1::ExportModelRequest& request) {
  const v1::ExportFormat format = request.format();
  std::unique_ptr<Export> made(new Export(std::move(session), format));
  made->counted_ = made->session_->model().BeginExport();
  if (!made->counted_) {
    return contract::Retryable(absl::StatusCode::kResourceExhausted, "TOO_MANY_EXPORTS",
                               "as many exports of the session are under way as it may have",
                               absl::Seconds(5));
  }
  made->file_name_ = absl::StrCat(made->session_->id(), Extension(format));
  if (format == v1::EXPORT_FORMAT_ARCHIVE) {
    made->archive_.emplace(*made->session_);
    return made;
  }
  // Scans that are named need no model.
  const bool of_scans =
      format == v1::EXPORT_FORMAT_SCANS_PLY || format == v1::EXPORT_FORMAT_SCANS_E57;
  if (made->model_.view == nullptr && !(of_scans && !request.scans().empty())) {
    return made->session_->model().WhyNone();
  }
  if (of_scans) {
    absl::Status chosen = made->ChooseScans(request);
    if (!chosen.ok()) return chosen;
  }
  if (format == v1::EXPORT_FORMAT_PATCH_PLY) {
    made->session_->journal().Read([&](const SessionState& state) {
      for (const std::string& name : state.plan_order) {
        if (state.plans.at(name).plan.state() == v1::PLAN_STATE_SUCCEEDED) made->plan_ = name;
      }
    });
    if (made->plan_.empty()) {
      return contract::ErrorWithReason(
          absl::StatusCode::kFailedPrecondition, "NO_PLAN",
          "patches come from a plan, and none has ended yet; create one");
    }
  }
  return made;
}

absl::Status Export::ChooseScans(const v1::ExportModelRequest& request) {
  contract::Violations violations;
  session_->journal().Read([&](const SessionState& state) {
    if (request.scans().empty()) {
      for (const std::string& name : state.scan_order) {
        if (state.scans.at(name).in_model) scans_.push_back(state.scans.at(name).scan);
      }
    }
    for (int i = 0; i < request.scans_size(); ++i) {
      const auto it = state.scans.find(request.scans(i));
      if (it == state.scans.end() || !it->second.in_model) {
        violations.Add(absl::StrCat("scans[", i, "]"), "is no scan in this session's model");
      } else {
        scans_.push_back(it->second.scan);
      }
    }
  });
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return valid;
  if (format_ == v1::EXPORT_FORMAT_SCANS_E57) {
    e57_.emplace(session_->scans(), scans_);
    total_size_ = e57_->size();
    return absl::OkStatus();
  }
  int64_t samples = 0;
  for (const v1::Scan& scan : scans_) {
    samples += scan.sample_count();
    appearance_.intensity = appearance_.intensity || scan.intensity();
    appearance_.colour = appearance_.colour || scan.colour();
  }
  total_size_ = static_cast<int64_t>(SamplesPlyHeader(samples, appearance_).size()) +
                samples * SamplePlyBytes(appearance_);
  return absl::OkStatus();
}

absl::StatusOr<std::string> Export::Next() {
  if (e57_.has_value()) return e57_->Next();
  if (archive_.has_value()) return archive_->Next();
  const size_t part = part_++;
  if (format_ == v1::EXPORT_FORMAT_SCANS_PLY) {
    if (part == 0) {
      int64_t samples = 0;
      for (const v1::Scan& scan : scans_) samples += scan.sample_count();
      return SamplesPlyHeader(samples, appearance_);
    }
    if (part > scans_.size()) return std::string();
    const v1::Scan& scan = scans_[part - 1];
    absl::StatusOr<sensor::RangeImage> image = session_->scans().LoadImage(scan.name());
    if (!image.ok()) return image.status();
    // Poses are in the world frame already.
    return SamplesPlyBody(*image, conversion::ReadOwnPose(scan.pose(), Eigen::Vector3d::Zero()),
                          static_cast<uint32_t>(part), appearance_);
  }
  if (part > 0) return std::string();
  std::string file;
  switch (format_) {
    case v1::EXPORT_FORMAT_OCTOMAP:
      file = model::ExportOctomap(*model_.view, session_->origin());
      break;
    case v1::EXPORT_FORMAT_OCTOMAP_BINARY:
      file = model::ExportBinaryOctomap(*model_.view, session_->origin());
      break;
    case v1::EXPORT_FORMAT_PATCH_PLY: {
      absl::StatusOr<v1::PlanResult> result = session_->plans().GetFullResult(plan_);
      if (!result.ok()) return result.status();
      file = PatchesPly(*result);
      break;
    }
    default:
      file = model::ExportSurfacePly(*model_.view, session_->origin());
  }
  total_size_ = static_cast<int64_t>(file.size());
  return file;
}

}  // namespace vantage::session
