#include <algorithm>
#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "server/report/sections.h"

namespace vantage::report {
namespace {

using Column = HtmlTable::Column;

constexpr size_t kBarsInARow = 30;

struct Promise {
  int number = 0;
  double obtained = 0;                       // m2
  const v1::GainPromise* promise = nullptr;  // null: nothing was promised
  double most() const {
    return promise == nullptr ? obtained : std::max(obtained, promise->expected_gain_upper_m2());
  }
};

// Bars of what came, ranges of what was promised. `top`: m2 at the upper edge.
std::string Chart(const std::vector<Promise>& promises, size_t begin, size_t end, double top,
                  const Words& say) {
  constexpr double kHeight = 46;  // mm
  constexpr double kLeft = 14;
  constexpr double kStep = 5.4;
  const double width = kLeft + kStep * static_cast<double>(std::max<size_t>(8, end - begin)) + 4;
  const auto y = [&](double m2) { return 3 + kHeight * (1 - std::clamp(m2 / top, 0.0, 1.0)); };
  std::string svg = absl::StrFormat(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" width=\"%.1fmm\" height=\"%.1fmm\" "
      "viewBox=\"0 0 %.2f %.2f\"><title>%s</title>\n",
      width, kHeight + 12, width, kHeight + 12,
      Escaped(say(Text::kChartAlt, promises[begin].number, promises[end - 1].number)));
  // Round steps, three to six of them.
  const double power = std::pow(10, std::floor(std::log10(top / 3)));
  const double step = power * (top / 3 / power >= 5 ? 5 : top / 3 / power >= 2 ? 2 : 1);
  for (double m2 = 0; m2 <= top + 1e-9; m2 += step) {
    absl::StrAppendFormat(&svg,
                          "<line x1=\"%.1f\" y1=\"%.2f\" x2=\"%.1f\" y2=\"%.2f\" stroke=\"%s\" "
                          "stroke-width=\"0.2\"/><text x=\"%.1f\" y=\"%.2f\" font-size=\"2.7\" "
                          "text-anchor=\"end\">%s</text>\n",
                          kLeft, y(m2), width - 2, y(m2), m2 == 0 ? "#111" : "#bbb", kLeft - 1,
                          y(m2) + 0.9, say.Number(m2, step < 1 ? 1 : 0));
  }
  absl::StrAppendFormat(&svg, "<text x=\"0.5\" y=\"%.1f\" font-size=\"2.7\">m\u00b2</text>\n", 3.9);
  for (size_t i = begin; i < end; ++i) {
    const Promise& of = promises[i];
    const double x = kLeft + kStep * (static_cast<double>(i - begin) + 0.5);
    absl::StrAppendFormat(&svg,
                          "<rect x=\"%.2f\" y=\"%.2f\" width=\"2.6\" height=\"%.2f\" "
                          "fill=\"#9aa7b4\" stroke=\"#111\" stroke-width=\"0.15\"/>\n",
                          x - 1.3, y(of.obtained), std::max(0.0, y(0) - y(of.obtained)));
    if (of.promise != nullptr) {
      absl::StrAppendFormat(
          &svg,
          "<path d=\"M%.2f %.2f V%.2f M%.2f %.2f h1.6 M%.2f %.2f h1.6\" stroke=\"#111\" "
          "stroke-width=\"0.3\" fill=\"none\"/><circle cx=\"%.2f\" cy=\"%.2f\" r=\"0.8\" "
          "fill=\"#fff\" stroke=\"#111\" stroke-width=\"0.3\"/>\n",
          x, y(of.promise->expected_gain_lower_m2()), y(of.promise->expected_gain_upper_m2()),
          x - 0.8, y(of.promise->expected_gain_lower_m2()), x - 0.8,
          y(of.promise->expected_gain_upper_m2()), x, y(of.promise->expected_gain_m2()));
    }
    absl::StrAppendFormat(
        &svg, "<text x=\"%.2f\" y=\"%.2f\" font-size=\"2.6\" text-anchor=\"middle\">%d</text>\n", x,
        kHeight + 6.5, of.number);
  }
  absl::StrAppendFormat(&svg,
                        "<text x=\"%.2f\" y=\"%.2f\" font-size=\"2.7\" text-anchor=\"middle\">%s"
                        "</text>\n",
                        (kLeft + width) / 2, kHeight + 10.5, Escaped(say(Text::kChartAxis)));
  return svg + "</svg>\n";
}

}  // namespace

Html WritePromises(const JobRecord& job, const Words& say) {
  std::vector<Promise> promises;
  for (const NumberedScan& of : NumberedScans(job)) {
    if (!InModel(*of.scan) || !of.scan->merge().has_obtained_gain_m2()) continue;
    promises.push_back({of.number, of.scan->merge().obtained_gain_m2(),
                        of.scan->merge().has_promise() ? &of.scan->merge().promise() : nullptr});
  }
  Html out = Html::Raw("<section class=\"page\" id=\"promises\">\n");
  out += Element("h2", say(Text::kPromises));
  out += Element("p", say(Text::kPromisesNote), "class=\"note\"");
  if (promises.empty()) {
    return out + Element("p", say(Text::kNoPromises)) + Html::Raw("</section>\n");
  }
  double expected = 0;
  double obtained = 0;
  double all = 0;
  int promised = 0;
  int within = 0;
  double top = 1;
  for (const Promise& of : promises) {
    all += of.obtained;
    top = std::max(top, of.most());
    if (of.promise == nullptr) continue;
    ++promised;
    expected += of.promise->expected_gain_m2();
    obtained += of.obtained;
    if (of.obtained >= of.promise->expected_gain_lower_m2() &&
        of.obtained <= of.promise->expected_gain_upper_m2()) {
      ++within;
    }
  }
  out += Element("p", promised == 0 ? say(Text::kNothingPromised, say.Area(all))
                                    : say(Text::kPromiseTotals, promised, say.Area(expected),
                                          say.Area(obtained), within, say.Area(all)));
  for (size_t begin = 0; begin < promises.size(); begin += kBarsInARow) {
    const size_t end = std::min(promises.size(), begin + kBarsInARow);
    out += Element(
        "figure",
        Html::Raw(Chart(promises, begin, end, 1.05 * top, say)) +
            (end == promises.size() ? Element("figcaption", say(Text::kChartCaption)) : Html()));
  }
  HtmlTable table(say(Text::kPromisesCaption), {{say(Text::kNumberColumn)},
                                                {say(Text::kPlanColumn)},
                                                {say(Text::kExpectedColumn), Column::kNumber},
                                                {say(Text::kRangeColumn), Column::kNumber},
                                                {say(Text::kBroughtColumn), Column::kNumber},
                                                {say(Text::kWithinColumn)}});
  for (const Promise& of : promises) {
    if (of.promise == nullptr) {
      table.Add({absl::StrCat(of.number), say(Text::kNotPlanned), "\u2013", "\u2013",
                 say.Area(of.obtained), "\u2013"});
      continue;
    }
    const v1::GainPromise& promise = *of.promise;
    const Text how = of.obtained < promise.expected_gain_lower_m2()   ? Text::kLess
                     : of.obtained > promise.expected_gain_upper_m2() ? Text::kMore
                                                                      : Text::kWithin;
    table.Add({absl::StrCat(of.number), LastPart(promise.plan()),
               say.Area(promise.expected_gain_m2()),
               say(Text::kRange, say.Number(promise.expected_gain_lower_m2(), 1),
                   say.Number(promise.expected_gain_upper_m2(), 1)),
               say.Area(of.obtained), say(how)});
  }
  return out + table.Done() + Html::Raw("</section>\n");
}

}  // namespace vantage::report
