#include "server/report/decisions.h"

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "server/report/outcome_words.h"
#include "server/report/sections.h"

namespace vantage::report {
namespace {

// Who decided and what, in words.
class DecisionWords {
 public:
  DecisionWords(const JobRecord& job, const Words& say)
      : job_(job), say_(say), scans_(NumberedScans(job)) {}

  std::string What(const v1::SessionEvent& event) const {
    switch (event.event_case()) {
      case v1::SessionEvent::kSessionCreated:
        return say_(Text::kDidCreate);
      case v1::SessionEvent::kSessionUpdated:
        return say_(Text::kDidUpdate, Fields(event.session_updated()));
      case v1::SessionEvent::kScanRegistered:
        return say_(Text::kDidRegister, Scan(event.scan_registered().scan()),
                    PoseSourceWords(event.scan_registered().scan(), say_));
      case v1::SessionEvent::kScanRefused:
        return say_(
            event.scan_refused().scan().state() == v1::SCAN_STATE_FAILED ? Text::kDidRefuseFailed
                                                                         : Text::kDidRefuse,
            Scan(event.scan_refused().scan()), ReasonWords(event.scan_refused().scan(), say_));
      case v1::SessionEvent::kScanAccepted:
        return say_(Text::kDidAccept, Scan(event.scan_accepted().scan()),
                    ReasonWords(event.scan_accepted().scan(), say_));
      case v1::SessionEvent::kScanPoseSet:
        return say_(Text::kDidSetPose, Scan(event.scan_pose_set().scan()));
      case v1::SessionEvent::kScanWithdrawn:
        return say_(Text::kDidWithdraw, Scan(event.scan_withdrawn().scan()));
      case v1::SessionEvent::kScanReplaced:
        return say_(Text::kDidReplace, Scan(event.scan_replaced().scan()));
      case v1::SessionEvent::kPosesAdjusted: {
        const v1::PosesAdjustedEvent& adjusted = event.poses_adjusted();
        return adjusted.moved_count() == 0
                   ? say_(Text::kDidAdjustNone, adjusted.poses_size())
                   : say_(Text::kDidAdjust, adjusted.poses_size(), adjusted.moved_count(),
                          StationWords(scans_, adjusted.most_moved_scan(), say_),
                          say_.Length(adjusted.largest_move_m()));
      }
      case v1::SessionEvent::kViewRejected: {
        const v1::Rejection& rejection = event.view_rejected().rejection();
        return say_(Text::kDidReject, say_.Place(rejection.position()),
                    say_.Length(rejection.radius_m()),
                    rejection.reason().empty() ? say_(Text::kNoReason) : rejection.reason());
      }
      case v1::SessionEvent::kRejectionDeleted:
        return say_(Text::kDidAllow, say_.Place(event.rejection_deleted().rejection().position()));
      case v1::SessionEvent::kClaimTaken:
        return say_(Text::kDidClaim, Scanner(event.claim_taken().claim().scanner()),
                    say_.Place(event.claim_taken().claim().position()));
      case v1::SessionEvent::kClaimEnded:
        return say_(
            event.claim_ended().end_reason() == v1::CLAIM_END_REASON_SCAN_ARRIVED ? Text::kDidFulfil
            : event.claim_ended().end_reason() == v1::CLAIM_END_REASON_EXPIRED    ? Text::kDidExpire
                                                                               : Text::kDidRelease,
            Scanner(event.claim_ended().claim().scanner()),
            say_.Place(event.claim_ended().claim().position()));
      case v1::SessionEvent::kScannerCreated:
        return say_(Text::kDidAddScanner, Scanner(event.scanner_created().scanner().name()));
      case v1::SessionEvent::kScannerUpdated:
        return say_(Text::kDidChangeScanner, Scanner(event.scanner_updated().scanner().name()));
      case v1::SessionEvent::kScannerDeleted:
        return say_(Text::kDidDeleteScanner, Scanner(event.scanner_deleted().scanner().name()));
      case v1::SessionEvent::kStationCreated:
        return say_(Text::kDidStation, say_.Place(event.station_created().station().position()));
      case v1::SessionEvent::kStationEnded:
        return say_(Text::kDidGiveUpStation,
                    say_.Place(event.station_ended().station().position()));
      case v1::SessionEvent::kUploadEnded: {
        const v1::Upload& upload = event.upload_ended().upload();
        return say_(Text::kDidEndUpload, upload.display_name().empty() ? LastPart(upload.name())
                                                                       : upload.display_name());
      }
      case v1::SessionEvent::kPlanEnded:
        return say_(Text::kDidSuggestEnd, LastPart(event.plan_ended().plan().name()));
      default:
        return std::string(
            v1::SessionEvent::descriptor()->FindFieldByNumber(event.event_case())->name());
    }
  }

  std::string Who(const v1::SessionEvent& event) const {
    switch (event.event_case()) {
      case v1::SessionEvent::kClaimTaken:
        return Claimant(event.claim_taken().claim());
      case v1::SessionEvent::kClaimEnded:
        return event.claim_ended().end_reason() == v1::CLAIM_END_REASON_RELEASED
                   ? Claimant(event.claim_ended().claim())
                   : say_(Text::kByServer);
      case v1::SessionEvent::kScanRegistered:
        return ByServerFor(event.scan_registered().scan());
      case v1::SessionEvent::kScanRefused:
        return ByServerFor(event.scan_refused().scan());
      case v1::SessionEvent::kScanReplaced:
        return Crew(event.scan_replaced().scan().scanner());
      case v1::SessionEvent::kStationCreated:
        return Crew(event.station_created().station().scanner());
      case v1::SessionEvent::kStationEnded:
        return Crew(event.station_ended().station().scanner());
      case v1::SessionEvent::kPosesAdjusted:
      case v1::SessionEvent::kPlanEnded:
        return say_(Text::kByServer);
      default:
        return say_(Text::kBySomebody);
    }
  }

 private:
  std::string Scan(const v1::Scan& scan) const {
    const int number = NumberOfScan(scans_, scan.name());
    return number > 0 ? say_(Text::kStationAndScan, number, ScanTitle(scan)) : ScanTitle(scan);
  }
  const v1::Scanner* Find(const std::string& name) const {
    for (const v1::Scanner& scanner : job_.scanners) {
      if (scanner.name() == name) return &scanner;
    }
    return nullptr;
  }
  std::string Scanner(const std::string& name) const {
    const v1::Scanner* scanner = Find(name);
    return scanner == nullptr || scanner->display_name().empty() ? LastPart(name)
                                                                 : scanner->display_name();
  }
  std::string Crew(const std::string& name) const {
    if (name.empty()) return say_(Text::kBySomebody);
    const v1::Scanner* scanner = Find(name);
    return scanner == nullptr || scanner->operator_().empty() ? Scanner(name)
                                                              : scanner->operator_();
  }
  std::string Claimant(const v1::Claim& claim) const {
    const auto caller = job_.decisions.callers.find(claim.name());
    return caller == job_.decisions.callers.end() || caller->second.empty() ? Crew(claim.scanner())
                                                                            : caller->second;
  }
  std::string ByServerFor(const v1::Scan& scan) const {
    return scan.scanner().empty() ? say_(Text::kByServer)
                                  : say_(Text::kByServerFor, Crew(scan.scanner()));
  }
  static std::string Fields(const v1::SessionUpdatedEvent& event) {
    std::vector<std::string> paths(event.update_mask().paths().begin(),
                                   event.update_mask().paths().end());
    return absl::StrJoin(paths, ", ");
  }

  const JobRecord& job_;
  const Words& say_;
  const std::vector<NumberedScan> scans_;
};

}  // namespace

bool IsDecision(const v1::SessionEvent& event) {
  switch (event.event_case()) {
    case v1::SessionEvent::kSessionCreated:
    case v1::SessionEvent::kSessionUpdated:
    case v1::SessionEvent::kScanRegistered:
    case v1::SessionEvent::kScanRefused:
    case v1::SessionEvent::kScanAccepted:
    case v1::SessionEvent::kScanPoseSet:
    case v1::SessionEvent::kScanWithdrawn:
    case v1::SessionEvent::kScanReplaced:
    case v1::SessionEvent::kPosesAdjusted:
    case v1::SessionEvent::kViewRejected:
    case v1::SessionEvent::kRejectionDeleted:
    case v1::SessionEvent::kClaimTaken:
    case v1::SessionEvent::kClaimEnded:
    case v1::SessionEvent::kScannerCreated:
    case v1::SessionEvent::kScannerUpdated:
    case v1::SessionEvent::kScannerDeleted:
    case v1::SessionEvent::kStationCreated:
      return true;
    case v1::SessionEvent::kStationEnded:
      return event.station_ended().end_reason() == v1::STATION_END_REASON_DELETED;
    case v1::SessionEvent::kUploadEnded:
      return event.upload_ended().upload().state() != v1::UPLOAD_STATE_COMMITTED;
    case v1::SessionEvent::kPlanEnded:
      return event.plan_ended().plan().result().termination().suggested();
    default:
      return false;
  }
}

Html WriteDecisions(const JobRecord& job, const Words& say) {
  const DecisionWords words(job, say);
  Html out = Html::Raw("<section class=\"page\" id=\"decisions\">\n");
  out += Element("h2", say(Text::kDecisions));
  out += Element("p", say(Text::kDecisionsNote), "class=\"note\"");
  if (job.decisions.left_out > 0) {
    out += Element(
        "p", say(Text::kDecisionsLeftOut, job.decisions.left_out, job.decisions.events.size()));
  }
  if (job.decisions.compacted) out += Element("p", say(Text::kDecisionsCompacted));
  HtmlTable table(say(Text::kDecisionsCaption, say.Zone()),
                  {{say(Text::kTimeColumn)}, {say(Text::kWhoColumn)}, {say(Text::kDidColumn)}});
  for (const v1::SessionEvent& event : job.decisions.events) {
    table.Add({say.Time(event.time()), words.Who(event), words.What(event)});
  }
  return out + table.Done("decisions") + Html::Raw("</section>\n");
}

}  // namespace vantage::report
