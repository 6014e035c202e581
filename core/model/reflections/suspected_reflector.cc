#include "core/model/reflections/suspected_reflector.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/model/reflections/mirror_fit.h"

namespace vantage::model {

Testimony Testify(const SuspectedReflector& suspect, const ReflectingPlane& plane,
                  const RangeSurface& surface, const RangeSurface& witness,
                  const Eigen::Isometry3d& T_witness_scan) {
  const ReturnTest scan(surface);
  const ReturnTest test(witness);
  // Both are noisy: what the noisier one allows.
  const double agreement = std::max(scan.Agreement(), test.Agreement());
  const Eigen::Vector3d shift =
      std::max(scan.TellingShift(), test.TellingShift()) * (T_witness_scan.linear() * plane.normal);
  const auto agrees = [&](const Eigen::Vector3d& point) {
    return test.Compare(point, agreement) == Back::kAgrees;
  };
  Testimony testimony;
  bool any = false;
  for (const ScanCell& cell : suspect.asked) {
    const Eigen::Vector3d back =
        T_witness_scan * plane.Reflected(scan.Point(cell.column, cell.row));
    const Back said = test.Compare(back, agreement);
    uint8_t bits = said == Back::kAgrees        ? Testimony::kAgrees
                   : said == Back::kContradicts ? Testimony::kContradicts
                                                : 0;
    if (agrees(back - shift)) bits |= Testimony::kAgreesFarther;
    if (agrees(back + shift)) bits |= Testimony::kAgreesNearer;
    testimony.of_returns.push_back(bits);
    any |= bits != 0;
  }
  if (!any) testimony.of_returns = {};
  // A mirror is opaque from behind.
  constexpr size_t kOpen = 3;  // parts of a square decimetre: as wide as a hand
  const Eigen::Vector3d stands = T_witness_scan.inverse(Eigen::Isometry).translation();
  if (plane.Above(stands) < -test.WellBehind()) {
    size_t open = 0;
    for (const Eigen::Vector3d& middle : suspect.aperture.Inner()) {
      const Back said = test.Compare(T_witness_scan * middle, agreement);
      open += said == Back::kContradicts ? 1 : 0;
    }
    testimony.sees_through = open >= kOpen;
  }
  return testimony;
}

std::optional<WitnessFit> FitByWitness(const SuspectedReflector& suspect,
                                       const RangeSurface& surface, const RangeSurface& witness,
                                       const Eigen::Isometry3d& T_witness_scan) {
  constexpr double kNear = 0.5;  // m: two degrees of a plane, ten metres behind it
  const ReturnTest scan(surface);
  const ReturnTest other(witness);
  const size_t looked_at = std::min(kTested, suspect.asked.size());
  std::vector<Eigen::Vector3d> points;
  for (size_t i = 0; i < looked_at; ++i) {
    const ScanCell& cell = suspect.asked[i * suspect.asked.size() / looked_at];
    points.push_back(scan.Point(cell.column, cell.row));
  }
  const std::array<MirrorWitness, 2> both = {{{&scan}, {&other, T_witness_scan}}};
  const std::span<const MirrorWitness> alone = std::span(both).last(1);
  if (4 * ComeBack(alone, suspect.plane, points, kNear) < looked_at) return std::nullopt;
  const double agreement = std::max(scan.Agreement(), other.Agreement());
  const size_t before = ComeBack(both, suspect.plane, points, agreement);
  const ReflectingPlane plane = Straighten(both, suspect.plane, points);
  if (suspect.wall && plane.IsRecessed(*suspect.wall)) return std::nullopt;
  const size_t agree = ComeBack(both, plane, points, agreement);
  if (2 * agree < looked_at || 10 * (agree - std::min(agree, before)) < looked_at) {
    return std::nullopt;
  }
  return WitnessFit{plane, agree};
}

bool IsReflector(const Testimony& own, std::span<const Testimony* const> others) {
  constexpr size_t kLeastCorroborated = 5;  // returns: more than lie somewhere by chance
  size_t telling = 0;
  size_t agree = 0;
  size_t contradict = 0;
  size_t corroborated = 0;
  for (size_t i = 0; i < own.of_returns.size(); ++i) {
    uint8_t theirs = 0;
    for (const Testimony* other : others) {
      if (!other->of_returns.empty()) theirs |= other->of_returns[i];
    }
    const uint8_t all = theirs | own.of_returns[i];
    constexpr uint8_t kTellsNothing = Testimony::kAgreesFarther | Testimony::kAgreesNearer;
    if ((all & kTellsNothing) == kTellsNothing) continue;
    ++telling;
    // Where one scan agrees and another contradicts, something was moved, and nothing is said.
    if ((all & Testimony::kContradicts) != 0) {
      contradict += (all & Testimony::kAgrees) == 0 ? 1 : 0;
    } else if ((all & Testimony::kAgrees) != 0) {
      ++agree;
      corroborated += (theirs & Testimony::kAgrees) != 0 ? 1 : 0;
    }
  }
  if (3 * agree < telling || 12 * contradict > telling || agree < kLeastAsked ||
      corroborated < kLeastCorroborated) {
    return false;
  }
  return std::none_of(others.begin(), others.end(),
                      [](const Testimony* other) { return other->sees_through; });
}

}  // namespace vantage::model
