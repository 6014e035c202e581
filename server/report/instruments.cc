#include <cmath>
#include <numbers>

#include "absl/strings/str_cat.h"
#include "server/report/outcome_words.h"
#include "server/report/sections.h"

namespace vantage::report {
namespace {

using Column = HtmlTable::Column;

bool ByInstrument(const v1::Scan& scan, const v1::ScannerModel& scanner) {
  return scan.scanner_model().id() == scanner.id() &&
         scan.scanner_model().range_noise_m() == scanner.range_noise_m() &&
         scan.scanner_model().range_noise_ppm() == scanner.range_noise_ppm();
}

std::string ClassWords(size_t range, const Words& say) {
  const auto& ends = registration::kRangeClassEnds;
  if (range == 0) return say(Text::kRangeTo, say.Number(ends[0], 0));
  if (range == ends.size()) return say(Text::kRangeFrom, say.Number(ends.back(), 0));
  return say(Text::kRangeBetween, say.Number(ends[range - 1], 0), say.Number(ends[range], 0));
}

// What the residuals show beyond the data sheet, by range over all incidences, and by incidence.
Html ResidualTable(const JobRecord& job, const InstrumentRecord& instrument, const Words& say) {
  constexpr size_t kIncidences = registration::kIncidenceClassEnds.size() + 1;
  const registration::InstrumentExcess excess =
      instrument.shown.Excess(job.config.registration.correlated_sigma);
  HtmlTable table(say(Text::kResidualCaption), {{say(Text::kRangeClassColumn)},
                                                {say(Text::kIncidenceColumn)},
                                                {say(Text::kBlocksColumn), Column::kNumber},
                                                {say(Text::kScatterColumn), Column::kNumber},
                                                {say(Text::kSheetScatterColumn), Column::kNumber},
                                                {say(Text::kSharedColumn), Column::kNumber},
                                                {say(Text::kBeyondColumn), Column::kNumber}});
  for (size_t k = 0; k < registration::kResidualClasses; ++k) {
    const registration::ClassResiduals& of = instrument.shown.sums()[k];
    if (of.blocks <= 0) continue;
    const size_t incidence = k % kIncidences;
    const auto& ends = registration::kIncidenceClassEnds;
    const std::string angle = incidence == 0 ? say(Text::kAngleTo, say.Number(ends[0], 0))
                              : incidence == ends.size()
                                  ? say(Text::kAngleFrom, say.Number(ends.back(), 0))
                                  : say(Text::kAngleBetween, say.Number(ends[incidence - 1], 0),
                                        say.Number(ends[incidence], 0));
    const auto root = [&](double sum, double count) {
      return count > 0 ? say.Millimetres(std::sqrt(std::max(0.0, sum / count))) : "\u2013";
    };
    table.Add({ClassWords(k / kIncidences, say), angle, say.Count(static_cast<int64_t>(of.blocks)),
               root(of.scatter, of.freedom), root(of.expected, of.freedom),
               root(of.shared, of.blocks),
               say.Millimetres(std::sqrt(excess.shared[k] + excess.scatter[k]))});
  }
  if (table.empty()) return Element("p", say(Text::kNoResiduals));
  return Element("p", say(Text::kResidualNote), "class=\"note\"") + table.Done();
}

Html DataSheet(const v1::ScannerModel& scanner, const Words& say) {
  constexpr double kDegree = std::numbers::pi / 180;
  std::string rows;
  const auto add = [&](Text term, const std::string& fact) {
    absl::StrAppend(&rows, "<dt>", Escaped(say(term)), "</dt><dd>", Escaped(fact), "</dd>\n");
  };
  add(Text::kFieldOfView,
      say(Text::kFieldWords, say.Number(scanner.azimuth_span_rad() / kDegree, 0),
          say.Number(scanner.min_elevation_rad() / kDegree, 0),
          say.Number(scanner.max_elevation_rad() / kDegree, 0)));
  add(Text::kSteps,
      absl::StrCat(say.Number(scanner.azimuth_step_rad() / kDegree, 3), "\u00b0 \u00d7 ",
                   say.Number(scanner.elevation_step_rad() / kDegree, 3), "\u00b0"));
  add(Text::kReach, say(Text::kReachWords, say.Number(scanner.min_range_m(), 1),
                        say.Number(scanner.max_range_m(), 0)));
  add(Text::kNoise, say(Text::kNoiseWords, say.Length(scanner.range_noise_m()),
                        say.Number(scanner.range_noise_ppm(), 0)));
  return Html::Raw(absl::StrCat("<dl class=\"facts\">\n", rows, "</dl>\n"));
}

}  // namespace

Html WriteInstruments(const JobRecord& job, const Words& say) {
  Html out = Html::Raw("<section id=\"instruments\">\n");
  out += Element("h2", say(Text::kInstruments));
  if (job.instruments.empty()) out += Element("p", say(Text::kNone));
  const std::vector<NumberedScan> scans = NumberedScans(job);
  for (const InstrumentRecord& instrument : job.instruments) {
    out += Element("h3", InstrumentTitle(instrument.scanner, say));
    out += DataSheet(instrument.scanner, say);
    out += ResidualTable(job, instrument, say);
    HtmlTable table(say(Text::kReturnsCaption), {{say(Text::kNumberColumn)},
                                                 {say(Text::kRaysColumn), Column::kNumber},
                                                 {say(Text::kReturnsColumn), Column::kNumber},
                                                 {say(Text::kShareColumn), Column::kNumber},
                                                 {say(Text::kBeyondRangeColumn), Column::kNumber},
                                                 {say(Text::kBeyondSiteColumn), Column::kNumber},
                                                 {say(Text::kSkyColumn), Column::kNumber},
                                                 {say(Text::kResidualColumn), Column::kNumber},
                                                 {say(Text::kMovedColumn), Column::kNumber}});
    int64_t rays = 0;
    int64_t returns = 0;
    for (const NumberedScan& of : scans) {
      const v1::Scan& scan = *of.scan;
      if (!ByInstrument(scan, instrument.scanner)) continue;
      const int64_t cells = static_cast<int64_t>(scan.column_count()) * scan.row_count();
      rays += cells;
      returns += scan.sample_count();
      table.Add(
          {absl::StrCat(of.number), say.Count(cells), say.Count(scan.sample_count()),
           cells > 0
               ? say.Percent(static_cast<double>(scan.sample_count()) / static_cast<double>(cells))
               : "\u2013",
           say.Count(scan.merge().beyond_range_count()),
           say.Count(scan.merge().beyond_site_count()), say.Count(scan.merge().sky_ray_count()),
           scan.has_registration() ? say.Length(scan.registration().rms_residual_m()) : "\u2013",
           scan.registration().has_moved_area_m2() ? say.Area(scan.registration().moved_area_m2())
                                                   : "\u2013"});
    }
    table.Add({say(Text::kTotal), say.Count(rays), say.Count(returns),
               rays > 0 ? say.Percent(static_cast<double>(returns) / static_cast<double>(rays))
                        : "\u2013",
               "", "", "", "", ""},
              "total");
    out += table.Done();
  }
  return out + Html::Raw("</section>\n");
}

}  // namespace vantage::report
