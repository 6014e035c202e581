#include <cstdio>
#include <cstdlib>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct WatchArguments {
  std::string session;
  uint64_t after = 0;
  uint64_t count = 0;
  bool json = false;
};

std::string ScanWords(const v1::Scan& scan, const std::string& what) {
  std::string words =
      absl::StrCat("scan ", client::IdOf(scan.name()), " ",
                   scan.display_name().empty() ? "" : scan.display_name() + " ", what);
  if (scan.has_registration()) {
    absl::StrAppend(&words, "; ", VerdictLine(scan.registration().verdict()));
  }
  return words;
}

std::string Words(const v1::SessionEvent& event) {
  switch (event.event_case()) {
    case v1::SessionEvent::kSessionCreated:
      return "session created";
    case v1::SessionEvent::kSessionUpdated:
      return "session updated";
    case v1::SessionEvent::kScanReceived:
      return ScanWords(event.scan_received().scan(), "received");
    case v1::SessionEvent::kScanReplaced:
      return ScanWords(event.scan_replaced().scan(), event.scan_replaced().scan().preview()
                                                         ? "replaced by a better preview"
                                                         : "whole, in place of its preview");
    case v1::SessionEvent::kScanRegistered:
      return ScanWords(event.scan_registered().scan(), "registered");
    case v1::SessionEvent::kScanRefused: {
      const v1::Scan& scan = event.scan_refused().scan();
      if (!scan.has_pose_proposal()) return ScanWords(scan, "refused");
      v1::Scan unjudged = scan;
      unjudged.clear_registration();
      return ScanWords(unjudged, absl::StrCat("in doubt: ", scan.pose_proposal().message()));
    }
    case v1::SessionEvent::kScanAccepted:
      return ScanWords(event.scan_accepted().scan(), "accepted by a person");
    case v1::SessionEvent::kScanPoseSet:
      return ScanWords(event.scan_pose_set().scan(), "given a pose by a person");
    case v1::SessionEvent::kScanMerged: {
      const v1::MergeReport& merge = event.scan_merged().scan().merge();
      std::string words =
          absl::StrFormat("%s; model version %d", ScanWords(event.scan_merged().scan(), "merged"),
                          merge.model_version());
      if (merge.changes_size() > 0) {
        absl::StrAppendFormat(&words, "; %d places changed since, the largest of %.1f m\u00b2",
                              merge.changes_size(), merge.changes(0).area_m2());
      }
      return words;
    }
    case v1::SessionEvent::kScanWithdrawn:
      return ScanWords(event.scan_withdrawn().scan(), "withdrawn");
    case v1::SessionEvent::kPlanCreated:
      return absl::StrCat("plan ", client::IdOf(event.plan_created().plan().name()), " created");
    case v1::SessionEvent::kPlanEnded: {
      const v1::Plan& plan = event.plan_ended().plan();
      std::string words = absl::StrFormat("plan %s %s: %s", client::IdOf(plan.name()),
                                          Word(plan.state()), Word(plan.result().outcome()));
      if (plan.result().views_size() > 0) {
        const v1::RankedView& best = plan.result().views(0);
        absl::StrAppend(&words, ", next ", Text(best.position()));
        if (GainIsKnown(best)) {
          absl::StrAppendFormat(&words, " for %.2f m\u00b2", best.model_gain_m2());
        }
      }
      return words;
    }
    case v1::SessionEvent::kRejectionDeleted:
      return absl::StrCat("place allowed again ",
                          Text(event.rejection_deleted().rejection().position()));
    case v1::SessionEvent::kViewRejected:
      return absl::StrCat("place rejected ", Text(event.view_rejected().rejection().position()));
    case v1::SessionEvent::kScannerCreated:
      return absl::StrCat("scanner ", client::IdOf(event.scanner_created().scanner().name()),
                          " added");
    case v1::SessionEvent::kScannerUpdated:
      return absl::StrCat("scanner ", client::IdOf(event.scanner_updated().scanner().name()),
                          " changed");
    case v1::SessionEvent::kScannerDeleted:
      return absl::StrCat("scanner ", client::IdOf(event.scanner_deleted().scanner().name()),
                          " taken out");
    case v1::SessionEvent::kSitePriorSet:
      return absl::StrCat("prior of the site set: ",
                          event.site_prior_set().site_prior().display_name());
    case v1::SessionEvent::kSitePriorCleared:
      return "prior of the site taken out";
    case v1::SessionEvent::kPlanDeleted:
      return absl::StrCat("plan ", client::IdOf(event.plan_deleted().plan()), " deleted");
    case v1::SessionEvent::kClaimTaken: {
      const v1::Claim& claim = event.claim_taken().claim();
      return absl::StrCat("claim ", client::IdOf(claim.name()), " taken by ",
                          client::IdOf(claim.scanner()), ": ", Text(claim.position()),
                          Facing(claim), " until ", Time(claim.expire_time()));
    }
    case v1::SessionEvent::kClaimRenewed: {
      const v1::Claim& claim = event.claim_renewed().claim();
      return absl::StrCat("claim ", client::IdOf(claim.name()), " renewed until ",
                          Time(claim.expire_time()));
    }
    case v1::SessionEvent::kClaimEnded:
      return absl::StrCat("claim ", client::IdOf(event.claim_ended().claim().name()),
                          " ended: ", Word(event.claim_ended().end_reason()));
    case v1::SessionEvent::kUploadCreated:
      return absl::StrCat("upload ", client::IdOf(event.upload_created().upload().name()),
                          " begun");
    case v1::SessionEvent::kUploadReceived:
      return absl::StrCat("upload ", client::IdOf(event.upload_received().upload().name()),
                          " is here, and its file is read");
    case v1::SessionEvent::kUploadEnded: {
      const v1::Upload& upload = event.upload_ended().upload();
      const std::string how = upload.state() == v1::UPLOAD_STATE_COMMITTED
                                  ? absl::StrCat("became ", upload.scans_size(), " scans")
                                  : std::string("ended");
      return absl::StrCat("upload ", client::IdOf(upload.name()), " ", how,
                          upload.state_message().empty() ? "" : ": ", upload.state_message());
    }
    case v1::SessionEvent::kScanRemoved:
      return absl::StrFormat("%s; model version %d",
                             ScanWords(event.scan_removed().scan(), "left the model"),
                             event.scan_removed().model_version());
    case v1::SessionEvent::kStationCreated: {
      const v1::Station& station = event.station_created().station();
      return absl::StrCat(client::IdOf(station.name()),
                          " waits for its scan: ", Text(station.position()), Facing(station));
    }
    case v1::SessionEvent::kStationEnded: {
      const v1::StationEndedEvent& ended = event.station_ended();
      return absl::StrCat(
          client::IdOf(ended.station().name()),
          ended.scan().empty() ? " is given up" : absl::StrCat(" is ", client::IdOf(ended.scan())));
    }
    case v1::SessionEvent::kPosesAdjusted: {
      const v1::PosesAdjustedEvent& adjusted = event.poses_adjusted();
      if (adjusted.moved_count() == 0) {
        return absl::StrFormat("poses of %d scans adjusted: none moved", adjusted.poses_size());
      }
      return absl::StrFormat(
          "poses of %d scans adjusted together: %d moved, %s by %s at most; model version %d",
          adjusted.poses_size(), adjusted.moved_count(), client::IdOf(adjusted.most_moved_scan()),
          Length(adjusted.largest_move_m()), adjusted.model_version());
    }
    case v1::SessionEvent::kEventsLeftOut:
      return absl::StrCat("events from ", event.events_left_out().first_sequence(),
                          " on that have no consequence any more");
    case v1::SessionEvent::EVENT_NOT_SET:
      break;
  }
  return "something this client does not know";
}

absl::StatusOr<ExitCode> RunWatch(Environment& environment, const WatchArguments& arguments) {
  uint64_t seen = 0;
  const absl::Status watched = environment.client().WatchSession(
      client::SessionName(arguments.session), arguments.after, [&](const v1::SessionEvent& event) {
        if (arguments.json) {
          std::fputs(ToJson(event, false).c_str(), stdout);
        } else {
          std::printf("%5llu  %s  %s\n", static_cast<unsigned long long>(event.sequence()),
                      Time(event.time()).c_str(), Words(event).c_str());
        }
        std::fflush(stdout);
        ++seen;
        return arguments.count == 0 || seen < arguments.count;
      });
  if (!watched.ok()) return watched;
  return ExitCode::kOk;
}

}  // namespace

void AddWatch(CLI::App& parent, Environment& environment) {
  AddCommand<WatchArguments>(
      parent, environment, "watch", "Follow what happens in a job, from its first event",
      "  vantage watch flat\n"
      "  vantage watch flat --after 120 --json      (one event per line)",
      [](CLI::App& command, WatchArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_option("--after", a.after, "Only events with a larger number [0]");
        command.add_option("--count", a.count, "Stop after this many [never]");
        command.add_flag("--json", a.json, "One event per line, as JSON");
      },
      RunWatch);
}

}  // namespace vantage::cli
