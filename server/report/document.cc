#include "absl/strings/str_cat.h"
#include "server/report/sections.h"

namespace vantage::report {
namespace {

// Black on white, A4. Everything that is told by a colour is told by words, too.
constexpr absl::string_view kStyle = R"(
@page { size: A4; margin: 16mm 14mm 18mm; }
* { box-sizing: border-box; }
html { -webkit-print-color-adjust: exact; print-color-adjust: exact; }
body { margin: 0 auto; max-width: 182mm; padding: 8mm 0; color: #111; background: #fff;
  font: 10pt/1.4 "Helvetica Neue", Helvetica, Arial, "Liberation Sans", "DejaVu Sans", sans-serif; }
h1 { font-size: 18pt; line-height: 1.2; margin: 0 0 0.5mm; overflow-wrap: anywhere; }
h2 { font-size: 14pt; line-height: 1.25; margin: 7mm 0 3mm; padding-bottom: 1mm; border-bottom: 0.5mm solid #111; break-after: avoid; }
h3 { font-size: 11pt; margin: 5mm 0 2mm; break-after: avoid; }
p { margin: 0 0 2.5mm; }
p, li { orphans: 3; widows: 3; overflow-wrap: anywhere; }
.under { color: #444; margin-bottom: 3mm; }
.note { font-size: 8.5pt; color: #333; }
#sign-off h2 { margin-top: 3mm; }
#sign-off .facts, #sign-off .exceptions, #sign-off .planning { font-size: 9pt; line-height: 1.3; }
#sign-off .note { font-size: 7.5pt; line-height: 1.3; margin-bottom: 1.2mm; }
.verdict { border: 0.7mm solid #111; padding: 2mm 4mm; margin: 0 0 3mm; break-inside: avoid; }
.verdict strong { font-size: 14pt; display: block; }
.verdict.open { border-style: dashed; }
.planning { border-left: 1.5mm solid #111; padding: 1mm 0 1mm 4mm; margin: 3mm 0; break-inside: avoid; }
.planning p { margin: 0; }
dl.facts { display: grid; grid-template-columns: 38mm 1fr; gap: 0.8mm 4mm; margin: 0 0 4mm; }
dl.facts dt { color: #444; }
dl.facts dd { margin: 0; overflow-wrap: anywhere; }
table { border-collapse: collapse; width: 100%; margin: 0 0 4mm; font-size: 8.5pt; line-height: 1.3; }
caption { text-align: left; font-weight: bold; padding: 1mm 0; caption-side: top; break-after: avoid; }
thead { display: table-header-group; }
tr { break-inside: avoid; }
th, td { text-align: left; vertical-align: top; padding: 0.9mm 1.2mm; border-bottom: 0.2mm solid #999; overflow-wrap: break-word; }
thead th { border-bottom: 0.4mm solid #111; vertical-align: bottom; }
tbody th { font-weight: normal; }
.number { text-align: right; font-variant-numeric: tabular-nums; }
td.number { white-space: nowrap; }
tr.total th, tr.total td { font-weight: bold; border-top: 0.4mm solid #111; }
.met::before { content: "\2713\00a0"; } .unmet::before { content: "\2717\00a0"; }
.met, .unmet { font-weight: bold; white-space: nowrap; }
ol.exceptions { padding-left: 6mm; margin: 0 0 4mm; }
ol.exceptions li { margin-bottom: 1.2mm; break-inside: avoid; }
.signatures { display: grid; grid-template-columns: 1fr 1fr; gap: 10mm 10mm; margin: 11mm 0 3mm; break-inside: avoid; }
.signatures div { border-top: 0.3mm solid #111; padding-top: 1mm; font-size: 8.5pt; }
figure { margin: 0 0 4mm; break-inside: avoid; }
figure svg { display: block; max-width: 100%; height: auto; }
figcaption { font-size: 8.5pt; margin-top: 1.5mm; }
.legend { display: flex; flex-wrap: wrap; gap: 1mm 5mm; list-style: none; padding: 0; margin: 2mm 0 0; font-size: 8.5pt; }
.legend li { display: flex; align-items: center; gap: 1.5mm; }
.legend svg { flex: none; width: 7mm; height: 4mm; }
section.page { break-before: page; }
section.page > h2:first-child, section.page > h3:first-child { margin-top: 0; }
th:first-child { padding-left: 0; } th:last-child, td:last-child { padding-right: 0; }
.poses td:nth-child(2) { min-width: 20mm; } .registrations td:nth-child(3) { min-width: 44mm; } .decisions td:nth-child(2) { min-width: 26mm; }
.decisions tbody th { white-space: nowrap; }
@media print { body { padding: 0; } }
svg text { font-family: inherit; fill: #111; }
@media screen { body { padding: 8mm 6mm; max-width: 194mm; } .wide { overflow-x: auto; } }
)";

}  // namespace

Html WriteHead(const JobRecord& job, const Words& say) {
  const std::string name = job.session.display_name().empty() ? LastPart(job.session.name())
                                                              : job.session.display_name();
  Html head = Html::Raw(absl::StrCat(
      "<!DOCTYPE html>\n<html lang=\"", CodeOf(say.language()),
      "\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      // Nothing is fetched, nothing runs.
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; "
      "style-src 'unsafe-inline'\">\n",
      "<title>", Escaped(say(Text::kTitle, name)), "</title>\n<style>", kStyle,
      "</style>\n</head>\n<body>\n"));
  head += Element("h1", name);
  head += Element("p",
                  say(Text::kUnderTitle, say.Time(job.session.update_time()), say.Zone(),
                      LastPart(job.session.name()), job.session.model_version()),
                  "class=\"under\"");
  return head;
}

Html WriteEnd() { return Html::Raw("</body>\n</html>\n"); }

}  // namespace vantage::report
