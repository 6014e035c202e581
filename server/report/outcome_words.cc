#include "server/report/outcome_words.h"

#include "absl/strings/str_cat.h"

namespace vantage::report {
namespace {

Text BasisText(v1::RegistrationBasis basis) {
  switch (basis) {
    case v1::REGISTRATION_BASIS_SCAN_GEOMETRY:
      return Text::kBasisGeometry;
    case v1::REGISTRATION_BASIS_LEVELLING:
      return Text::kBasisLevelling;
    case v1::REGISTRATION_BASIS_TARGETS:
      return Text::kBasisTargets;
    case v1::REGISTRATION_BASIS_TRUSTED_POSE:
      return Text::kBasisTrusted;
    case v1::REGISTRATION_BASIS_COMBINED:
      return Text::kBasisCombined;
    case v1::REGISTRATION_BASIS_OVERLAP:
      return Text::kBasisOverlap;
    case v1::REGISTRATION_BASIS_NO_POSE_PRIOR:
      return Text::kBasisNoPrior;
    case v1::REGISTRATION_BASIS_RESIDUALS:
      return Text::kBasisResiduals;
    case v1::REGISTRATION_BASIS_CONTRADICTION:
      return Text::kBasisContradiction;
    case v1::REGISTRATION_BASIS_RIVAL_POSE:
      return Text::kBasisRival;
    case v1::REGISTRATION_BASIS_NOT_CONVERGED:
      return Text::kBasisNotConverged;
    default:
      return Text::kBasisNotStated;
  }
}

}  // namespace

std::string ReasonWords(const v1::Scan& scan, const Words& say) {
  if (!scan.has_registration()) return say(Text::kBasisNotStated);
  const v1::RegistrationVerdict& verdict = scan.registration().verdict();
  // It would register by now, and was accepted since it did not when it came.
  if (verdict.outcome() == v1::REGISTRATION_OUTCOME_REGISTERED) return say(Text::kBasisSettled);
  if (verdict.basis() == v1::REGISTRATION_BASIS_SCAN_GEOMETRY) {
    return say(Text::kBasisGeometryShort, say.Length(verdict.error_bound_m()));
  }
  return say(BasisText(verdict.basis()));
}

std::string PoseSourceWords(const v1::Scan& scan, const Words& say) {
  switch (scan.pose_source()) {
    case v1::POSE_SOURCE_FIRST_SCAN:
      if (!scan.has_levelling()) return say(Text::kSourceFirst);
      return say(scan.levelling().from_inclinometer() ? Text::kSourceFirstInclinometer
                 : scan.levelling().found_floor()     ? Text::kSourceFirstFloor
                                                      : Text::kSourceFirstNothing);
    case v1::POSE_SOURCE_REGISTRATION:
      return say(Text::kSourceRegistered, say(BasisText(scan.registration().verdict().basis())));
    case v1::POSE_SOURCE_ACCEPTED:
      return say(Text::kSourceAccepted, ReasonWords(scan, say));
    case v1::POSE_SOURCE_SET:
      return say(Text::kSourceSet);
    case v1::POSE_SOURCE_TRUSTED_PRIOR:
      return say(Text::kSourceTrusted);
    default:
      return say(Text::kSourceNone);
  }
}

std::string InstrumentTitle(const v1::ScannerModel& scanner, const Words& say) {
  if (scanner.preset().empty()) return scanner.id();
  return scanner.setting().empty() ? scanner.preset()
                                   : say(Text::kPresetAt, scanner.preset(), scanner.setting());
}

std::string FrameWords(const JobRecord& job, const Words& say) {
  bool control = false;
  for (const v1::Scan& scan : job.scans) {
    for (const v1::TargetSighting& target : scan.targets()) {
      control = control || target.has_in_world();
    }
  }
  const Text frame = control ? Text::kFrameControl : Text::kFrameFirst;
  if (job.origin.isZero()) return say(frame);
  v1::Vector3 origin;
  origin.set_x(job.origin.x());
  origin.set_y(job.origin.y());
  origin.set_z(job.origin.z());
  return absl::StrCat(say(frame), " ", say(Text::kFrameOrigin, say.Place(origin)));
}

}  // namespace vantage::report
