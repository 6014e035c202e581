#include "server/report/html.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace vantage::report {
namespace {

using ::testing::HasSubstr;

TEST(Html, TextIsEscaped) {
  EXPECT_EQ(Html("<script>alert('1') & \"2\"</script>").markup(),
            "&lt;script&gt;alert(&#39;1&#39;) &amp; &quot;2&quot;&lt;/script&gt;");
  EXPECT_EQ(Html(std::string("Raum 1 \u00fc")).markup(), "Raum 1 \u00fc");
  // What is no UTF-8, and control characters.
  EXPECT_EQ(Html(std::string("a\x80\x01z")).markup(), "a? z");
  EXPECT_EQ(Html::Raw("<b>").markup(), "<b>");
}

TEST(Html, TablesRepeatTheirHeads) {
  HtmlTable table("<rooms>", {{"room"}, {"area", HtmlTable::Column::kNumber}});
  EXPECT_TRUE(table.empty());
  table.Add({"<i>", "3"}, "total");
  EXPECT_FALSE(table.empty());
  const std::string markup = table.Done("wide").markup();
  EXPECT_THAT(markup, HasSubstr("<table class=\"wide\"><caption>&lt;rooms&gt;</caption>"));
  EXPECT_THAT(markup, HasSubstr("<thead><tr><th scope=\"col\">room</th>"
                                "<th scope=\"col\" class=\"number\">area</th></tr></thead>"));
  EXPECT_THAT(markup, HasSubstr("<tr class=\"total\"><th scope=\"row\">&lt;i&gt;</th>"
                                "<td class=\"number\">3</td></tr>"));
}

}  // namespace
}  // namespace vantage::report
