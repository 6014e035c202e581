#include "client/study/job_page.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/study/svg.h"

namespace vantage::study {
namespace {

constexpr char kJobHead[] =
    R"(<style>
body{font:16px/1.5 sans-serif;color:#222;background:#fff;max-width:1180px;margin:24px auto;padding:0 16px}
h1{font-size:26px;margin:0 0 8px}h2{font-size:19px;margin:28px 0 8px}
svg{width:860px;max-width:100%;height:auto}svg text{font-family:sans-serif}
table{border-collapse:collapse;margin:12px 0;font-size:14px}
td,th{border-bottom:1px solid #ddd;padding:3px 10px;text-align:right}
td.words,th.words{text-align:left}th{background:#f4f4f4}
figure{margin:20px 0}figure img{max-width:100%;height:auto;border:1px solid #ddd}
figcaption{color:#555;font-size:14px}.fact{margin:4px 0}.small{color:#666;font-size:14px}
details summary{cursor:pointer;color:#1f5fbf;margin:10px 0}
</style></head><body>
)";

constexpr double kGoalLine = 0.95;

std::string CoverageChart(const JobPage& page) {
  std::vector<Curve> curves;
  Curve job{"this job", "#1f5fbf", false, {}};
  for (const JobPage::Scan& scan : page.scans) job.points.emplace_back(scan.number, scan.attained);
  curves.push_back(job);
  size_t most = page.scans.size();
  if (!page.oracle.empty()) {
    Curve oracle{"the oracle", "#d9480f", true, {}};
    // It has nothing to gain after its last one.
    most = std::max(most, page.oracle.size());
    for (size_t i = 0; i < most; ++i) {
      oracle.points.emplace_back(static_cast<double>(i + 1),
                                 page.oracle[std::min(i, page.oracle.size() - 1)]);
    }
    curves.push_back(oracle);
  }
  return Chart("Attainable surface at density, by scan", "scans", 1,
               std::max<double>(2, static_cast<double>(most)), kGoalLine, curves);
}

std::string Figure(const JobPage::Scan& scan) {
  return absl::StrFormat(
      "<figure><img src='%s' alt='The job from above after scan %d' loading='lazy'>"
      "<figcaption>After scan %d: %.1f %% of what can be attained is at density.</figcaption>"
      "</figure>\n",
      Escape(scan.picture), scan.number, scan.number, 100 * scan.attained);
}

}  // namespace

std::string Html(const JobPage& page) {
  std::string html = absl::StrCat(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\"><title>",
      Escape(page.title), "</title>\n", kJobHead, "<h1>", Escape(page.title), "</h1>\n");
  for (const std::string& fact : page.facts) {
    absl::StrAppend(&html, "<p class='fact'>", Escape(fact), "</p>\n");
  }
  if (!page.link.empty()) {
    absl::StrAppend(
        &html, "<p class='fact'>While its server runs, a crew's page for tablets shows ",
        "the job, too: <a href='", Escape(page.link), "'>", Escape(page.link), "</a></p>\n");
  }
  if (!page.scans.empty()) {
    absl::StrAppend(&html, "<h2>How fast</h2>\n", CoverageChart(page));
    if (!page.oracle.empty()) {
      absl::StrAppend(&html, "<p class='small'>", Escape(page.oracle_words), "</p>\n");
    }
  }
  std::vector<const JobPage::Scan*> drawn;
  for (const JobPage::Scan& scan : page.scans) {
    if (!scan.picture.empty()) drawn.push_back(&scan);
  }
  if (!drawn.empty()) {
    absl::StrAppend(&html, "<h2>The job at its end</h2>\n", Figure(*drawn.back()));
    if (drawn.size() > 1) {
      absl::StrAppend(&html, "<details open><summary>And after each scan</summary>\n");
      for (size_t i = 0; i + 1 < drawn.size(); ++i) absl::StrAppend(&html, Figure(*drawn[i]));
      html += "</details>\n";
    }
  }
  if (!page.scans.empty()) {
    html +=
        "<h2>Scan by scan</h2>\n<table><tr><th>scan</th><th class='words'>position, m</th>"
        "<th class='words'>aligned</th><th>minutes on site</th><th>attained</th>"
        "<th>covered, estimated</th></tr>\n";
    for (const JobPage::Scan& scan : page.scans) {
      absl::StrAppendFormat(
          &html,
          "<tr><td>%d</td><td class='words'>%s</td><td class='words'>%s</td><td>%.0f</td>"
          "<td>%.1f %%</td><td>%s</td></tr>\n",
          scan.number, Escape(scan.position), Escape(scan.aligned), scan.minutes,
          100 * scan.attained,
          scan.estimated ? absl::StrFormat("%.1f %%", 100 * *scan.estimated) : "");
    }
    html +=
        "</table>\n<p class='small'>Attained: by the ground truth, of the surface that some place "
        "can measure at the required density, the share that is. Covered: what the planner, who "
        "does not know the truth, takes it for. Minutes: walking, setting up, scanning.</p>\n";
  }
  return html + "</body></html>\n";
}

}  // namespace vantage::study
