#include <algorithm>
#include <cmath>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "server/report/outcome_words.h"
#include "server/report/sections.h"

namespace vantage::report {
namespace {

using Column = HtmlTable::Column;

// Exceptions that are told one by one; the sheet says how many there are beyond.
constexpr size_t kMostExceptions = 40;

std::string RegionTitle(const RegionStanding& region, const Words& say) {
  return region.name.empty() ? say(Text::kWholeJob) : region.name;
}

std::string AccuracyWords(std::optional<double> bound, const Words& say) {
  if (!bound.has_value()) return say(Text::kNotKnown);
  const std::optional<AccuracyLevel> level = LevelOf(*bound);
  return absl::StrCat(say.Length(*bound), level.has_value()
                                              ? absl::StrCat(" (", level->name, ")")
                                              : absl::StrCat(" (", say(Text::kNoLevel), ")"));
}

Html Mark(bool met, const Words& say) {
  return Html::Raw(absl::StrCat("<span class=\"", met ? "met" : "unmet", "\">",
                                Escaped(say(met ? Text::kMet : Text::kNotMet)), "</span>"));
}

Html RequirementTable(const Standing& standing, const Words& say) {
  HtmlTable table(say(Text::kRequirementCaption),
                  {{say(Text::kRegion)},
                   {say(Text::kDensityRequired), Column::kNumber},
                   {say(Text::kAtDensity), Column::kNumber},
                   {say(Text::kCompletenessColumn), Column::kNumber},
                   {say(Text::kAccuracyColumn), Column::kNumber},
                   {say(Text::kResult)}});
  for (const RegionStanding& region : standing.regions) {
    const bool whole = region.name.empty();
    if (!region.required) {
      table.Add({RegionTitle(region, say), "\u2013", "\u2013", "\u2013", "\u2013",
                 say(Text::kNothingRequired)});
      continue;
    }
    table.Add({RegionTitle(region, say),
               say(Text::kDensityAndSpacing, say.Number(region.density, 0),
                   say.Number(1000 / std::sqrt(std::max(1e-9, region.density)), 0)),
               say.Area(region.area_at_density),
               region.coverage.has_value() ? say.Percent(*region.coverage) : say(Text::kNotKnown),
               AccuracyWords(region.accuracy, say), Mark(region.met(), say)},
              whole && standing.regions.size() > 1 ? "total" : "");
  }
  return table.Done();
}

// Why a region's requirement is not met, and what speaks against the whole, in sentences.
class Exceptions {
 public:
  Exceptions(const JobRecord& job, const Standing& standing, const Words& say)
      : job_(job), standing_(standing), say_(say), scans_(NumberedScans(job)) {
    for (const RegionStanding& region : standing.regions) AddRegion(region);
    AddScans();
    AddRooms();
    AddPlaces();
    AddUnattainable();
    AddLinks();
  }

  const std::vector<std::string>& sentences() const { return sentences_; }

 private:
  void Add(std::string sentence) { sentences_.push_back(std::move(sentence)); }

  void AddRegion(const RegionStanding& region) {
    if (!region.required) return;
    const std::string name = RegionTitle(region, say_);
    if (!region.coverage.has_value()) {
      Add(say_(Text::kExceptionNoSurface, name));
      return;
    }
    if (!region.complete) {
      const double thin = std::max(0.0, region.area.true_surface() - region.area_at_density);
      Add(say_(Text::kExceptionCoverage, name, say_.Percent(*region.coverage),
               say_.Percent(standing_.required_coverage), say_.Area(thin),
               say_.Area(region.area.occlusion()), say_.Area(region.area.hole_boundary()),
               say_.Area(region.area.image_boundary())));
    }
    if (!region.accuracy.has_value()) {
      Add(say_(Text::kExceptionNoAccuracy, name));
    } else if (*region.accuracy > standing_.required_accuracy) {
      Add(say_(Text::kExceptionAccuracy, name, AccuracyWords(region.accuracy, say_),
               AccuracyWords(standing_.required_accuracy, say_)));
    } else if (!region.accurate) {
      Add(say_(Text::kExceptionPartAccuracy, name, say_.Area(region.area_without_accuracy)));
    }
  }

  void AddScans() {
    for (const NumberedScan& of : scans_) {
      const v1::Scan& scan = *of.scan;
      const std::string title = ScanTitle(scan);
      switch (scan.state()) {
        case v1::SCAN_STATE_DOUBTFUL:
        case v1::SCAN_STATE_FAILED:
          Add(say_(scan.state() == v1::SCAN_STATE_DOUBTFUL ? Text::kExceptionDoubtful
                                                           : Text::kExceptionFailed,
                   of.number, title, ReasonWords(scan, say_)));
          break;
        case v1::SCAN_STATE_MERGED:
          if (scan.preview()) Add(say_(Text::kExceptionPreview, of.number, title));
          if (scan.pose_source() == v1::POSE_SOURCE_ACCEPTED) {
            Add(say_(Text::kExceptionAccepted, of.number, title, ReasonWords(scan, say_)));
          } else if (scan.pose_source() == v1::POSE_SOURCE_SET) {
            Add(say_(Text::kExceptionPoseSet, of.number, title));
          }
          break;
        default:
          Add(say_(Text::kExceptionUnderWay, of.number, title));
      }
      if (scan.data_lost()) Add(say_(Text::kExceptionLost, of.number, title));
    }
    if (!job_.pending.empty()) {
      Add(say_(Text::kExceptionPending, job_.pending.size(),
               say_.Area(job_.coverage.coverage().area_pending_m2())));
    }
  }

  void AddRooms() {
    const v1::Coverage& coverage = job_.coverage.coverage();
    if (coverage.rooms_not_entered_count() > 0) {
      Add(say_(Text::kExceptionRooms, coverage.rooms_not_entered_count()));
    }
  }

  void AddPlaces() {
    for (const v1::Rejection& rejection : job_.session.rejections()) {
      Add(rejection.reason().empty()
              ? say_(Text::kExceptionPlace, say_.Place(rejection.position()),
                     say_.Length(rejection.radius_m()))
              : say_(Text::kExceptionPlaceReason, say_.Place(rejection.position()),
                     say_.Length(rejection.radius_m()), rejection.reason()));
    }
  }

  void AddUnattainable() {
    const v1::Coverage& coverage = job_.coverage.coverage();
    if (coverage.area_given_up_m2() >= 0.05) {
      Add(say_(Text::kExceptionGivenUp, say_.Area(coverage.area_given_up_m2())));
    }
    if (coverage.area_out_of_reach_m2() >= 0.05) {
      Add(say_(Text::kExceptionOutOfReach, say_.Area(coverage.area_out_of_reach_m2())));
    }
  }

  void AddLinks() {
    for (int i = 0; i < job_.graph.links_size(); ++i) {
      const v1::ScanLink& link = job_.graph.links(i);
      const bool suspect =
          i < job_.graph.link_test_ratios_size() && job_.graph.link_test_ratios(i) > 1;
      if (!suspect && !link.in_doubt()) continue;
      Add(say_(Text::kExceptionLink, NumberOfScan(scans_, link.first_scan()),
               NumberOfScan(scans_, link.second_scan())));
    }
    std::set<int> pieces;
    for (const v1::LinkedScan& scan : job_.graph.scans()) pieces.insert(scan.piece_index());
    if (pieces.size() > 1) Add(say_(Text::kExceptionPieces, pieces.size()));
  }

  const JobRecord& job_;
  const Standing& standing_;
  const Words& say_;
  const std::vector<NumberedScan> scans_;
  std::vector<std::string> sentences_;
};

std::string InstrumentsLine(const JobRecord& job, const Words& say) {
  std::vector<std::string> names;
  for (const InstrumentRecord& instrument : job.instruments) {
    names.push_back(InstrumentTitle(instrument.scanner, say));
  }
  return names.empty() ? say(Text::kNone) : absl::StrJoin(names, "; ");
}

std::string CrewLine(const JobRecord& job) {
  std::vector<std::string> names;
  for (const v1::Scanner& scanner : job.scanners) {
    const std::string title =
        scanner.display_name().empty() ? LastPart(scanner.name()) : scanner.display_name();
    names.push_back(
        scanner.operator_().empty() ? title : absl::StrCat(title, " (", scanner.operator_(), ")"));
  }
  return absl::StrJoin(names, "; ");
}

Html Facts(const JobRecord& job, const Standing& standing, const Words& say) {
  std::string rows;
  const auto add = [&rows](const std::string& term, const std::string& fact) {
    absl::StrAppend(&rows, "<dt>", Escaped(term), "</dt><dd>", Escaped(fact), "</dd>\n");
  };
  const std::vector<NumberedScan> scans = NumberedScans(job);
  if (!scans.empty()) {
    const std::string first = say.Day(scans.front().scan->create_time());
    const std::string last = say.Day(scans.back().scan->create_time());
    add(say(Text::kDates), first == last ? first : say(Text::kFromTo, first, last));
  }
  add(say(Text::kScanners), InstrumentsLine(job, say));
  if (const std::string crew = CrewLine(job); !crew.empty()) add(say(Text::kCrew), crew);
  const v1::ScanCounts& n = job.session.scan_counts();
  add(say(Text::kScans),
      say(Text::kScanCounts, n.merged_count(), n.doubtful_count() + n.failed_count(),
          n.unmerged_count(), n.withdrawn_count()));
  add(say(Text::kRequired), say(Text::kRequiredWords, say.Percent(standing.required_coverage),
                                AccuracyWords(standing.required_accuracy, say)));
  add(say(Text::kFrame), FrameWords(job, say));
  add(say(Text::kMade), say(Text::kMadeAt, say.Time(job.made), say.Zone()));
  return Html::Raw(absl::StrCat("<dl class=\"facts\">\n", rows, "</dl>\n"));
}

// What the last plan says of further scans; nothing where it does not know.
std::string WorthOfFurtherScans(const JobRecord& job, const Words& say) {
  const v1::PlanResult& result = job.plan.result();
  const std::string plan = LastPart(job.plan.name());
  if (result.termination().suggested()) return say(Text::kNoFurtherScan, plan);
  if (result.views().empty()) return "";
  const v1::RankedView& best = result.views(0);
  const double gain = std::max(best.expected_gain_m2(), best.model_gain_m2());
  if (!best.exact() || gain <= 0) return "";
  return say(Text::kFurtherScan, plan, say.Area(gain), say.Place(best.position()));
}

Html Verdict(const JobRecord& job, const Standing& standing, size_t exceptions, const Words& say) {
  if (job.view == nullptr) {
    return Html::Raw(absl::StrCat("<div class=\"verdict open\"><strong>",
                                  Escaped(say(Text::kVerdictNothing)), "</strong></div>\n"));
  }
  const auto missed = std::count_if(standing.regions.begin(), standing.regions.end(),
                                    [](const RegionStanding& region) { return !region.met(); });
  std::string words;
  if (missed == 0) {
    words = exceptions == 0 ? say(Text::kNoExceptions) : say(Text::kWithExceptions, exceptions);
  } else {
    words = say(Text::kMissedRows, missed, standing.regions.size());
  }
  absl::StrAppend(&words, " ", WorthOfFurtherScans(job, say));
  return Html::Raw(
      absl::StrCat("<div class=\"verdict", missed == 0 ? "" : " open", "\"><strong>",
                   Escaped(say(missed == 0 ? Text::kVerdictMet : Text::kVerdictNotMet)),
                   "</strong>", Escaped(words), "</div>\n"));
}

}  // namespace

Html WriteSignOff(const JobRecord& job, const Standing& standing, const Words& say) {
  const Exceptions exceptions(job, standing, say);
  Html out = Html::Raw("<section id=\"sign-off\">\n");
  out += Element("h2", say(Text::kSignOff));
  out += Verdict(job, standing, exceptions.sentences().size(), say);
  out += Facts(job, standing, say);
  if (job.view != nullptr) out += RequirementTable(standing, say);
  out += Element(
      "div",
      Element("strong", say(Text::kPlanningHeading)) + Element("p", say(Text::kPlanningNote)),
      "class=\"planning\"");
  out += Element("h3", say(Text::kExceptions));
  if (exceptions.sentences().empty()) {
    out += Element("p", say(Text::kNone));
  } else {
    Html list;
    const size_t shown = std::min(kMostExceptions, exceptions.sentences().size());
    for (size_t i = 0; i < shown; ++i) list += Element("li", exceptions.sentences()[i]);
    out += Element("ol", list, "class=\"exceptions\"");
    if (shown < exceptions.sentences().size()) {
      out += Element("p", say(Text::kMoreExceptions, exceptions.sentences().size() - shown));
    }
  }
  Html lines;
  for (const Text who : {Text::kSignSurveyor, Text::kSignClient}) {
    lines += Element("div", say(who));
    lines += Element("div", say(Text::kSignPlaceDate));
  }
  out += Element("div", lines, "class=\"signatures\"");
  if (job.view != nullptr) {
    out += Element("h3", say(Text::kFiguresHeading));
    out += Element("p", say(Text::kCoverageNote, say.Percent(standing.required_coverage)),
                   "class=\"note\"");
    out += Element("p", say(Text::kAccuracyNote), "class=\"note\"");
    out += Element("p", say(Text::kLevelNote), "class=\"note\"");
  }
  return out + Html::Raw("</section>\n");
}

}  // namespace vantage::report
