// The service's answers as text for people.
#ifndef VANTAGE_CLIENT_CLI_REPORT_H_
#define VANTAGE_CLIENT_CLI_REPORT_H_

#include <string>

#include "client/library/client.h"

namespace vantage::cli {

// 'merged' for SCAN_STATE_MERGED.
std::string Word(v1::ScanState state);
std::string Word(v1::PoseSource source);
std::string Word(v1::PlanState state);
std::string Word(v1::PlanOutcome outcome);
std::string Word(v1::PlanStage stage);
std::string Word(v1::RegistrationOutcome outcome);
std::string Word(v1::RegistrationBasis basis);
std::string Word(v1::ClaimEndReason reason);

// '(1.20, -0.40, 1.55)', m.
std::string Text(const v1::Vector3& v);
// Position and heading.
std::string Text(const v1::Pose& pose);
// 1.3 mm, 4.2 cm, 1.20 m, 'unbounded'.
std::string Length(double metres);
std::string Bytes(double bytes);
std::string Percent(double share);
std::string Seconds(const google::protobuf::Duration& duration);
std::string Time(const google::protobuf::Timestamp& time);
// ' facing 90°', or nothing where the scanner turns all around.
std::string Facing(const v1::RankedView& view);
std::string Facing(const v1::Claim& claim);
std::string Facing(const v1::Station& station);

// Whether a view's gains are known: where a plan's time did not suffice for them, they are 0.
bool GainIsKnown(const v1::RankedView& view);

// 'registered: overlap 63 %, error bound 0.5 mm, strength 0.31'.
std::string VerdictFigures(const v1::RegistrationVerdict& verdict);
// The same with reason and remedy.
std::string VerdictLine(const v1::RegistrationVerdict& verdict);

// Several lines each, with line ends.
std::string SessionReport(const v1::Session& session);
std::string ScanReport(const v1::Scan& scan);
// The assignments of scanners to views, one line each.
std::string JointReport(const v1::PlanResult& result);
std::string PlanReport(const v1::Plan& plan);
std::string ViewReport(const v1::RankedView& view);
std::string CoverageReport(const v1::Coverage& coverage);
// One line; nothing where no storey is known.
std::string StoreysReport(const google::protobuf::RepeatedPtrField<v1::Storey>& storeys);

// 'feasible views 0.02, ... : 0.31 s in all'.
std::string StagesLine(const v1::PlanResult& result);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_REPORT_H_
