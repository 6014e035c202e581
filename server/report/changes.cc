#include "absl/strings/str_cat.h"
#include "server/report/sections.h"

namespace vantage::report {
namespace {

using Column = HtmlTable::Column;

constexpr int kMostChanges = 300;

}  // namespace

Html WriteChanges(const JobRecord& job, const Words& say) {
  const std::vector<NumberedScan> scans = NumberedScans(job);
  Html out = Html::Raw("<section id=\"changes\">\n");
  out += Element("h2", say(Text::kChanges));
  HtmlTable table(say(Text::kChangesCaption), {{say(Text::kSeenByColumn)},
                                               {say(Text::kWhatColumn)},
                                               {say(Text::kSinceStationColumn)},
                                               {say(Text::kWhereColumn)},
                                               {say(Text::kBoxColumn), Column::kNumber},
                                               {say(Text::kAreaColumn), Column::kNumber}});
  int count = 0;
  for (const NumberedScan& of : scans) {
    for (const v1::SiteChange& change : of.scan->merge().changes()) {
      if (++count > kMostChanges) continue;
      const v1::Box& box = change.box();
      table.Add(
          {StationWords(scans, of.scan->name(), say),
           say(change.kind() == v1::SITE_CHANGE_KIND_CAME ? Text::kCame : Text::kGone),
           change.since().empty() ? say(Text::kNotKnown) : StationWords(scans, change.since(), say),
           say.Place(change.centre()),
           absl::StrCat(say.Number(box.max().x() - box.min().x(), 1), " \u00d7 ",
                        say.Number(box.max().y() - box.min().y(), 1), " \u00d7 ",
                        say.Number(box.max().z() - box.min().z(), 1), " m"),
           say.Area(change.area_m2())});
    }
  }
  if (count == 0) {
    out += Element("p", say(Text::kNoChanges));
  } else {
    out += Element("p", say(Text::kChangesNote), "class=\"note\"") + table.Done();
  }
  if (count > kMostChanges) {
    out += Element("p", say(Text::kMoreRows, count - kMostChanges), "class=\"note\"");
  }
  return out + Html::Raw("</section>\n");
}

}  // namespace vantage::report
