#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "absl/strings/str_cat.h"
#include "core/registration/graph/surface_accuracy.h"
#include "server/conversion/to_proto.h"
#include "server/report/outcome_words.h"
#include "server/report/sections.h"

namespace vantage::report {
namespace {

using Column = HtmlTable::Column;

// Links that are told one by one, the weakest first.
constexpr size_t kMostLinks = 40;

double Degrees(double radians) { return radians * 180 / std::numbers::pi; }

// In percent, rounded up: what is a little above 100 is said to be.
std::string TestShare(double ratio, const Words& say) {
  return say.Number(std::ceil(100 * ratio - 1e-9), 0);
}

const v1::LinkedScan* FindLinked(const JobRecord& job, const std::string& scan) {
  for (const v1::LinkedScan& linked : job.graph.scans()) {
    if (linked.scan() == scan) return &linked;
  }
  return nullptr;
}

Html PoseTable(const JobRecord& job, const std::vector<NumberedScan>& scans,
               const std::vector<ReportStorey>& storeys, const Words& say) {
  HtmlTable table(say(Text::kPoseCaption), {{say(Text::kNumberColumn)},
                                            {say(Text::kScanColumn)},
                                            {say(Text::kStoreyColumn)},
                                            {"x, m", Column::kNumber},
                                            {"y, m", Column::kNumber},
                                            {"z, m", Column::kNumber},
                                            {say(Text::kHeadingColumn), Column::kNumber},
                                            {say(Text::kTiltColumn), Column::kNumber},
                                            {say(Text::kBoundColumn), Column::kNumber},
                                            {say(Text::kSigmaColumn), Column::kNumber},
                                            {say(Text::kTurnColumn), Column::kNumber}});
  for (const NumberedScan& of : scans) {
    if (!InModel(*of.scan)) continue;
    const v1::Vector3& at = of.scan->pose().translation();
    const Eigen::Matrix3d r =
        conversion::ReadOwnPose(of.scan->pose(), Eigen::Vector3d::Zero()).linear();
    const double tilt = std::acos(std::clamp(r(2, 2), -1.0, 1.0));
    const v1::LinkedScan* linked = FindLinked(job, of.scan->name());
    const auto covariance = CovarianceOf(job, of.scan->name());
    std::string bound = say(Text::kNotKnown);
    std::string sigmas = "\u2013";
    std::string turn = "\u2013";
    if (linked != nullptr && linked->held() && covariance.has_value()) {
      bound = say(Text::kHolds);
    } else if (covariance.has_value()) {
      bound = say.Millimetres(registration::Bound95(
          registration::PointCovariance(*covariance, Eigen::Vector3d::Zero())));
      const auto sigma = [&](int axis) {
        return say.Millimetres(std::sqrt(std::max(0.0, (*covariance)(axis, axis))));
      };
      sigmas = absl::StrCat(sigma(3), " / ", sigma(4), " / ", sigma(5));
      // Turned about the worst axis, 10 m away.
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> turns(covariance->topLeftCorner<3, 3>(),
                                                                 Eigen::EigenvaluesOnly);
      turn = say.Millimetres(10 * std::sqrt(std::max(0.0, turns.eigenvalues().maxCoeff())));
    }
    table.Add({absl::StrCat(of.number), ScanTitle(*of.scan),
               absl::StrCat(storeys[StoreyAt(storeys, at.z())].number), say.Fixed(at.x(), 3),
               say.Fixed(at.y(), 3), say.Fixed(at.z(), 3),
               say.Fixed(Degrees(std::atan2(r(1, 0), r(0, 0))), 2), say.Fixed(Degrees(tilt), 2),
               bound, sigmas, turn});
  }
  return table.Done("poses");
}

Html RegistrationTable(const JobRecord& job, const std::vector<NumberedScan>& scans,
                       const Words& say) {
  HtmlTable table(say(Text::kRegistrationCaption), {{say(Text::kNumberColumn)},
                                                    {say(Text::kMadeColumn)},
                                                    {say(Text::kHowColumn)},
                                                    {say(Text::kOverlapColumn), Column::kNumber},
                                                    {say(Text::kErrorBoundColumn), Column::kNumber},
                                                    {say(Text::kLinksColumn), Column::kNumber},
                                                    {say(Text::kWorstLinkColumn)},
                                                    {say(Text::kBroughtColumn), Column::kNumber}});
  for (const NumberedScan& of : scans) {
    if (!InModel(*of.scan)) continue;
    const v1::Scan& scan = *of.scan;
    const v1::LinkedScan* linked = FindLinked(job, scan.name());
    const auto links =
        std::count_if(job.graph.links().begin(), job.graph.links().end(), [&](const auto& link) {
          return link.first_scan() == scan.name() || link.second_scan() == scan.name();
        });
    std::string worst = say(Text::kNothingChecks);
    if (linked != nullptr && linked->has_worst_link()) {
      worst = say(linked->worst_link().test_ratio() > 1 ? Text::kWorstLinkBad : Text::kWorstLink,
                  StationWords(scans, linked->worst_link().scan(), say),
                  TestShare(linked->worst_link().test_ratio(), say));
    }
    const v1::RegistrationVerdict& verdict = scan.registration().verdict();
    const bool aligned = scan.has_registration();
    table.Add({absl::StrCat(of.number), say.Time(scan.create_time()), PoseSourceWords(scan, say),
               aligned ? say.Percent(verdict.overlap_share()) : "\u2013",
               aligned ? say.Length(verdict.error_bound_m()) : "\u2013", absl::StrCat(links), worst,
               scan.merge().has_obtained_gain_m2() ? say.Area(scan.merge().obtained_gain_m2())
                                                   : "\u2013"});
  }
  return table.Done("registrations");
}

Html LinkTable(const JobRecord& job, const std::vector<NumberedScan>& scans, const Words& say) {
  std::vector<int> order(static_cast<size_t>(job.graph.links_size()));
  for (size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
  const auto strength = [&](int i) {
    const v1::ScanLink& link = job.graph.links(i);
    const bool suspect = i < job.graph.link_test_ratios_size() && job.graph.link_test_ratios(i) > 1;
    return std::tuple(!link.in_doubt() && !suspect, link.constrained_direction_count(),
                      link.correspondence_count());
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](int a, int b) { return strength(a) < strength(b); });
  HtmlTable table(say(Text::kLinkCaption), {{say(Text::kBetweenColumn)},
                                            {say(Text::kAgreeColumn), Column::kNumber},
                                            {say(Text::kPairsColumn), Column::kNumber},
                                            {say(Text::kResidualColumn), Column::kNumber},
                                            {say(Text::kExpectedResidualColumn), Column::kNumber},
                                            {say(Text::kHeldColumn), Column::kNumber},
                                            {say(Text::kFitColumn)}});
  const size_t shown = std::min(kMostLinks, order.size());
  for (size_t k = 0; k < shown; ++k) {
    const v1::ScanLink& link = job.graph.links(order[k]);
    const double ratio =
        order[k] < job.graph.link_test_ratios_size() ? job.graph.link_test_ratios(order[k]) : 0;
    const std::string fit = link.in_doubt() ? say(Text::kFitDoubt)
                            : ratio > 1     ? say(Text::kFitSuspect, TestShare(ratio, say))
                            : ratio > 0     ? say(Text::kFitGood, TestShare(ratio, say))
                                            : say(Text::kFitUnchecked);
    table.Add({say(Text::kBetween, NumberOfScan(scans, link.first_scan()),
                   NumberOfScan(scans, link.second_scan())),
               say.Percent(link.overlap_share()), say.Count(link.correspondence_count()),
               say.Length(link.rms_residual_m()), say.Length(link.expected_residual_m()),
               say(Text::kOfSix, link.constrained_direction_count()), fit});
  }
  Html out = table.empty() ? Element("p", say(Text::kNoLinks)) : table.Done();
  if (shown < order.size()) {
    out += Element("p", say(Text::kMoreLinks, order.size() - shown), "class=\"note\"");
  }
  return out;
}

Html WeakLinks(const JobRecord& job, const std::vector<NumberedScan>& scans, const Words& say) {
  Html list;
  for (const v1::WeakLink& link : job.graph.weak_links()) {
    const int first = NumberOfScan(scans, link.first_scan());
    const int second = NumberOfScan(scans, link.second_scan());
    list += Element("li",
                    link.bridge()
                        ? say(Text::kBridge, first, second, say.Length(link.relative_sigma_m()),
                              link.hanging_scan_count())
                        : say(Text::kWeakLink, first, second, say.Length(link.relative_sigma_m())));
  }
  for (const v1::TieAdvice& advice : job.graph.advice()) {
    list += Element(
        "li",
        say(Text::kTieAdvice, NumberOfScan(scans, advice.first_scan()),
            NumberOfScan(scans, advice.second_scan()), say.Length(advice.distance_m()),
            say.Length(advice.worst_sigma_before_m()), say.Length(advice.worst_sigma_after_m())));
  }
  const v1::Connectivity& all = job.graph.connectivity();
  for (const v1::CutScan& cut : all.cut_scans()) {
    list += Element("li",
                    say(Text::kCutScan, NumberOfScan(scans, cut.scan()), cut.cut_off_scan_count()));
  }
  Html connected;
  if (all.tied_pair_count() > 0) {
    connected = Element("p", say(Text::kConnected, say.Length(all.mean_path_sigma_m()),
                                 say.Length(all.longest_path_sigma_m()), all.piece_count(),
                                 all.cut_scans_size(), all.bridge_indexes_size()));
  }
  if (list.empty()) return connected;
  return connected + Element("h3", say(Text::kWeakHeading)) + Element("ul", list);
}

}  // namespace

Html WriteStations(const JobRecord& job, const Standing& standing, const Words& say) {
  const std::vector<NumberedScan> scans = NumberedScans(job);
  const std::vector<ReportStorey> storeys = StoreysOf(job);
  Html out = Html::Raw("<section class=\"page\" id=\"stations\">\n");
  out += Element("h2", say(Text::kStations));
  if (job.view == nullptr) {
    return out + Element("p", say(Text::kNoneInModel)) + Html::Raw("</section>\n");
  }
  out += Element("p", say(Text::kStationsNote, say.Length(standing.required_accuracy)),
                 "class=\"note\"");
  out += PoseTable(job, scans, storeys, say);
  out += Element("p", say(Text::kRegistrationNote), "class=\"note\"");
  out += RegistrationTable(job, scans, say);
  if (job.graph.variance_factor() > 1.05) {
    out += Element(
        "p", say(Text::kVarianceFactor, say.Number(std::sqrt(job.graph.variance_factor()), 1)),
        "class=\"note\"");
  }
  out += Element("h3", say(Text::kLinksHeading));
  out += Element("p", say(Text::kLinksNote), "class=\"note\"");
  out += LinkTable(job, scans, say);
  out += WeakLinks(job, scans, say);
  return out + Html::Raw("</section>\n");
}

}  // namespace vantage::report
