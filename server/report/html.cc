#include "server/report/html.h"

#include "absl/strings/str_cat.h"
#include "server/contract/valid_text.h"

namespace vantage::report {

std::string Escaped(absl::string_view text) {
  std::string out;
  for (const char c : contract::ValidText(text, text.size())) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

Html Element(absl::string_view name, const Html& content, absl::string_view attributes) {
  return Html::Raw(absl::StrCat("<", name, attributes.empty() ? "" : " ", attributes, ">",
                                content.markup(), "</", name, ">\n"));
}

void HtmlTable::Add(const std::vector<Html>& cells, absl::string_view row_class) {
  absl::StrAppend(&rows_, "<tr");
  if (!row_class.empty()) absl::StrAppend(&rows_, " class=\"", row_class, "\"");
  rows_ += ">";
  for (size_t i = 0; i < cells.size(); ++i) {
    const bool number = i < headings_.size() && headings_[i].column == Column::kNumber;
    absl::StrAppend(&rows_, i == 0 ? "<th scope=\"row\"" : "<td", number ? " class=\"number\"" : "",
                    ">", cells[i].markup(), i == 0 ? "</th>" : "</td>");
  }
  rows_ += "</tr>\n";
}

Html HtmlTable::Done(absl::string_view table_class) const {
  std::string head;
  for (const Heading& heading : headings_) {
    absl::StrAppend(&head, "<th scope=\"col\"",
                    heading.column == Column::kNumber ? " class=\"number\"" : "", ">",
                    heading.words.markup(), "</th>");
  }
  return Html::Raw(absl::StrCat("<table", table_class.empty() ? "" : " class=\"", table_class,
                                table_class.empty() ? "" : "\"", "><caption>", caption_.markup(),
                                "</caption>\n<thead><tr>", head, "</tr></thead>\n<tbody>\n", rows_,
                                "</tbody></table>\n"));
}

}  // namespace vantage::report
