#include "server/session/imported_entry.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/site_prior/prior_mesh.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/check_request.h"
#include "server/conversion/fleet_proto.h"
#include "server/conversion/from_proto.h"

namespace vantage::session {
namespace {

// Counts what is wrong with one entry.
class Check {
 public:
  Check(std::string id, const contract::Limits& limits) : id_(std::move(id)), limits_(limits) {}

  absl::Status Entry(const storage::v1::LogEntry& entry) {
    const v1::SessionEvent& event = entry.event();
    switch (event.event_case()) {
      case v1::SessionEvent::kSessionCreated:
        Session(event.session_created().session());
        break;
      case v1::SessionEvent::kSessionUpdated:
        Session(event.session_updated().session());
        break;
      case v1::SessionEvent::kUploadCreated:
        Upload(event.upload_created().upload());
        break;
      case v1::SessionEvent::kUploadReceived:
        Upload(event.upload_received().upload());
        break;
      case v1::SessionEvent::kUploadEnded:
        Upload(event.upload_ended().upload());
        break;
      case v1::SessionEvent::kScanReceived:
        Scan(event.scan_received().scan());
        break;
      case v1::SessionEvent::kScanReplaced:
        Scan(event.scan_replaced().scan());
        break;
      case v1::SessionEvent::kScanRegistered:
        Scan(event.scan_registered().scan());
        break;
      case v1::SessionEvent::kScanRefused:
        Scan(event.scan_refused().scan());
        break;
      case v1::SessionEvent::kScanAccepted:
        Scan(event.scan_accepted().scan());
        break;
      case v1::SessionEvent::kScanPoseSet:
        Scan(event.scan_pose_set().scan());
        break;
      case v1::SessionEvent::kScanMerged:
        Scan(event.scan_merged().scan());
        for (const v1::ScanLink& link : event.scan_merged().links()) Link(link);
        break;
      case v1::SessionEvent::kScanWithdrawn:
        Scan(event.scan_withdrawn().scan());
        break;
      case v1::SessionEvent::kScanRemoved:
        Scan(event.scan_removed().scan());
        break;
      case v1::SessionEvent::kPosesAdjusted:
        for (const v1::AdjustedPose& adjusted : event.poses_adjusted().poses()) {
          Name(adjusted.scan(), "scans", "poses.scan");
          Pose(adjusted.pose(), "poses.pose");
          if (adjusted.has_adjustment()) Adjustment(adjusted.adjustment());
        }
        break;
      case v1::SessionEvent::kPlanCreated:
        Plan(event.plan_created().plan());
        break;
      case v1::SessionEvent::kPlanEnded:
        Plan(event.plan_ended().plan());
        break;
      case v1::SessionEvent::kPlanDeleted:
        Name(event.plan_deleted().plan(), "plans", "plan");
        break;
      case v1::SessionEvent::kSitePriorSet:
        SitePrior(event.site_prior_set().site_prior());
        break;
      case v1::SessionEvent::kSitePriorCleared:
        SitePriorName(event.site_prior_cleared().site_prior().name());
        break;
      case v1::SessionEvent::kViewRejected:
        Rejection(event.view_rejected().rejection());
        break;
      case v1::SessionEvent::kRejectionDeleted:
        Rejection(event.rejection_deleted().rejection());
        break;
      case v1::SessionEvent::kScannerCreated:
        Scanner(event.scanner_created().scanner());
        break;
      case v1::SessionEvent::kScannerUpdated:
        Scanner(event.scanner_updated().scanner());
        break;
      case v1::SessionEvent::kScannerDeleted:
        Scanner(event.scanner_deleted().scanner());
        break;
      case v1::SessionEvent::kClaimTaken:
        Claim(event.claim_taken().claim());
        break;
      case v1::SessionEvent::kClaimRenewed:
        Claim(event.claim_renewed().claim());
        break;
      case v1::SessionEvent::kClaimEnded:
        Claim(event.claim_ended().claim());
        break;
      case v1::SessionEvent::kStationCreated:
        Station(event.station_created().station());
        break;
      case v1::SessionEvent::kStationEnded:
        Station(event.station_ended().station());
        break;
      case v1::SessionEvent::kEventsLeftOut:
        LeftOut(entry.left_out());
        break;
      case v1::SessionEvent::EVENT_NOT_SET:
        violations_.Add("event", "is of a kind that this server does not know");
        break;
    }
    if (entry.has_request()) conversion::CheckRequestId(entry.request().id(), violations_);
    if (!entry.blob().empty() && entry.blob().size() != 32) {
      violations_.Add("blob", "is no SHA-256");
    }
    return violations_.ToStatus();
  }

 private:
  void Add(const absl::Status& status, absl::string_view field) {
    if (!status.ok()) violations_.Add(field, status.message());
  }
  void Name(const std::string& name, absl::string_view collection, absl::string_view field) {
    const absl::StatusOr<contract::ChildId> child =
        contract::ParseChildName(name, collection, field);
    if (!child.ok() || child->session != id_) {
      violations_.Add(field, "is no name of something in the session");
    }
  }
  void NameOrNone(const std::string& name, absl::string_view collection, absl::string_view field) {
    if (!name.empty()) Name(name, collection, field);
  }
  void Session(const v1::Session& session) {
    if (session.name() != contract::NameOfSession(id_)) {
      violations_.Add("session.name", "is another session's");
    }
    conversion::CheckSession(session, "session.", violations_);
  }
  void Upload(const v1::Upload& upload) {
    Name(upload.name(), "uploads", "upload.name");
    NameOrNone(upload.scanner(), "scanners", "upload.scanner");
    NameOrNone(upload.replaces(), "scans", "upload.replaces");
    NameOrNone(upload.scan(), "scans", "upload.scan");
    for (const std::string& scan : upload.scans()) Name(scan, "scans", "upload.scans");
    v1::CreateUploadRequest request;
    *request.mutable_upload() = upload;
    Add(conversion::CheckRequest(request, limits_), "upload");
  }
  void Pose(const v1::Pose& pose, const std::string& field) {
    v1::PosePrior prior;
    *prior.mutable_pose() = pose;
    conversion::ReadPosePrior(prior, Eigen::Vector3d::Zero(), field, violations_);
  }
  void Scan(const v1::Scan& scan) {
    Name(scan.name(), "scans", "scan.name");
    Name(scan.upload(), "uploads", "scan.upload");
    NameOrNone(scan.scanner(), "scanners", "scan.scanner");
    conversion::ReadScannerModel(scan.scanner_model(), "scan.scanner_model", violations_);
    conversion::CheckTargets(scan.targets(), "scan.targets", violations_);
    if (scan.has_prior()) {
      conversion::ReadPosePrior(scan.prior(), Eigen::Vector3d::Zero(), "scan.prior", violations_);
    }
    if (scan.has_pose()) Pose(scan.pose(), "scan.pose");
    if (scan.has_adjustment()) Adjustment(scan.adjustment());
    if (scan.has_pose_reference()) {
      Name(scan.pose_reference().scan(), "scans", "scan.pose_reference.scan");
      Pose(scan.pose_reference().pose(), "scan.pose_reference.pose");
    }
    if (scan.has_pose_proposal()) Proposal(scan.pose_proposal());
    const bool placed =
        scan.state() == v1::SCAN_STATE_MERGING || scan.state() == v1::SCAN_STATE_MERGED;
    if (placed && !scan.has_pose()) violations_.Add("scan.pose", "is required in its state");
    if (scan.encoded_size_bytes() < 0 || scan.encoded_size_bytes() > limits_.encoded_scan_bytes) {
      violations_.Add("scan.encoded_size_bytes", "is more than a scan may have");
    }
  }
  void Proposal(const v1::PoseProposal& proposal) {
    Pose(proposal.registration().pose(), "scan.pose_proposal.registration.pose");
    if (!proposal.pose_reference().scan().empty()) {
      Name(proposal.pose_reference().scan(), "scans", "scan.pose_proposal.pose_reference.scan");
      Pose(proposal.pose_reference().pose(), "scan.pose_proposal.pose_reference.pose");
    }
    for (const std::string& scan : proposal.agreeing_scans()) {
      Name(scan, "scans", "scan.pose_proposal.agreeing_scans");
    }
    for (const std::string& scan : proposal.contradicting_scans()) {
      Name(scan, "scans", "scan.pose_proposal.contradicting_scans");
    }
  }
  void Adjustment(const v1::PoseAdjustment& adjustment) {
    Pose(adjustment.unadjusted_pose(), "adjustment.unadjusted_pose");
    if (adjustment.covariance_size() != 0) {
      Matrix(adjustment.covariance(), "adjustment.covariance");
    }
  }
  void Link(const v1::ScanLink& link) {
    Name(link.first_scan(), "scans", "links.first_scan");
    Name(link.second_scan(), "scans", "links.second_scan");
    Pose(link.pose(), "links.pose");
    Matrix(link.information(), "links.information");
  }
  void Matrix(const google::protobuf::RepeatedField<double>& numbers, const std::string& field) {
    const bool finite = std::all_of(numbers.begin(), numbers.end(),
                                    [](double number) { return std::isfinite(number); });
    if (numbers.size() != 36 || !finite) violations_.Add(field, "is no 6 x 6 matrix");
  }
  void Plan(const v1::Plan& plan) {
    Name(plan.name(), "plans", "plan.name");
    for (const std::string& scanner : plan.scanners()) Name(scanner, "scanners", "plan.scanners");
    v1::CreatePlanRequest request;
    *request.mutable_plan() = plan;
    Add(conversion::CheckRequest(request), "plan");
  }
  void SitePriorName(const std::string& name) {
    if (name == absl::StrCat(contract::NameOfSession(id_), "/sitePrior")) return;
    violations_.Add("site_prior.name", "is not that of the session's prior");
  }
  void SitePrior(const v1::SitePrior& prior) {
    SitePriorName(prior.name());
    conversion::CheckSitePrior(prior, "site_prior", violations_);
    // What a server fills in.
    if (!(prior.unit_m() > 0)) violations_.Add("site_prior.unit_m", "is required");
    if (!v1::SitePriorFormat_IsValid(prior.format()) ||
        prior.format() == v1::SITE_PRIOR_FORMAT_UNSPECIFIED) {
      violations_.Add("site_prior.format", "is none");
    }
    if (prior.triangle_count() < 1 ||
        prior.triangle_count() > static_cast<int64_t>(site_prior::kMostPriorTriangles)) {
      violations_.Add("site_prior.triangle_count", "is none of a prior");
    }
    if (prior.has_source_origin()) {
      conversion::ReadVector(prior.source_origin(), "site_prior.source_origin", violations_);
    }
  }
  void Rejection(const v1::Rejection& rejection) {
    Name(rejection.name(), "rejections", "rejection.name");
    v1::RejectViewRequest request;
    *request.mutable_position() = rejection.position();
    request.set_radius_m(rejection.radius_m());
    request.set_reason(rejection.reason());
    Add(conversion::CheckRequest(request), "rejection");
  }
  void Scanner(const v1::Scanner& scanner) {
    Name(scanner.name(), "scanners", "scanner.name");
    if (scanner.has_last_pose()) Pose(scanner.last_pose(), "scanner.last_pose");
    conversion::CheckScanner(scanner, "scanner", violations_);
  }
  void Claim(const v1::Claim& claim) {
    Name(claim.name(), "claims", "claim.name");
    Name(claim.scanner(), "scanners", "claim.scanner");
    NameOrNone(claim.plan(), "plans", "claim.plan");
    conversion::ReadVector(claim.position(), "claim.position", violations_);
    if (claim.has_heading_rad()) {
      conversion::ReadHeading(claim.heading_rad(), "claim.heading_rad", violations_);
    }
  }
  void Station(const v1::Station& station) {
    Name(station.name(), "stations", "station.name");
    NameOrNone(station.scanner(), "scanners", "station.scanner");
    v1::CreateStationRequest request;
    *request.mutable_station() = station;
    Add(conversion::CheckRequest(request), "station");
  }
  void LeftOut(const storage::v1::LeftOut& left_out) {
    constexpr uint64_t kMost = uint64_t{1} << 40;  // far more than a log tells of
    const uint64_t counts[] = {left_out.created_upload_count(), left_out.rejection_count(),
                               left_out.created_station_count(), left_out.created_plan_count()};
    if (*std::max_element(std::begin(counts), std::end(counts)) > kMost) {
      violations_.Add("left_out", "stands for more than there can be");
    }
  }

  const std::string id_;
  const contract::Limits& limits_;
  contract::Violations violations_;
};

}  // namespace

absl::Status CheckImportedEntry(const storage::v1::LogEntry& entry, const std::string& id,
                                const contract::Limits& limits) {
  return Check(id, limits).Entry(entry);
}

}  // namespace vantage::session
