// Markup that is safe to put on a page: text becomes markup by escaping alone, so that what
// somebody named can be shown and never runs.
#ifndef VANTAGE_SERVER_REPORT_HTML_H_
#define VANTAGE_SERVER_REPORT_HTML_H_

#include <string>
#include <utility>
#include <vector>

#include "absl/strings/string_view.h"

namespace vantage::report {

// The text as the content of an element or a quoted attribute: valid UTF-8, without control
// characters.
std::string Escaped(absl::string_view text);

// A piece of markup.
class Html {
 public:
  Html() = default;
  // Text, which is escaped.
  Html(absl::string_view text) : markup_(Escaped(text)) {}  // NOLINT(google-explicit-constructor)
  Html(const std::string& text) : Html(absl::string_view(text)) {}  // NOLINT: the same
  Html(const char* text) : Html(absl::string_view(text)) {}         // NOLINT: the same
  // Markup of ours, in which nothing is anybody else's.
  static Html Raw(std::string markup) {
    Html html;
    html.markup_ = std::move(markup);
    return html;
  }

  const std::string& markup() const { return markup_; }
  bool empty() const { return markup_.empty(); }
  Html& operator+=(const Html& more) {
    markup_ += more.markup_;
    return *this;
  }
  friend Html operator+(Html first, const Html& second) { return first += second; }

 private:
  std::string markup_;
};

// '<name attributes>content</name>'. `attributes` is ours, as 'class="figure"'.
Html Element(absl::string_view name, const Html& content, absl::string_view attributes = "");

// A table whose head is repeated on every page that it is printed on.
class HtmlTable {
 public:
  enum class Column { kText, kNumber };
  struct Heading {
    Html words;
    Column column = Column::kText;
  };

  // `caption` names it for who cannot see it, and is shown above it.
  HtmlTable(const Html& caption, std::vector<Heading> headings)
      : caption_(caption), headings_(std::move(headings)) {}

  // As many cells as there are headings. The first is the row's heading.
  void Add(const std::vector<Html>& cells, absl::string_view row_class = "");
  bool empty() const { return rows_.empty(); }
  Html Done(absl::string_view table_class = "") const;

 private:
  const Html caption_;
  const std::vector<Heading> headings_;
  std::string rows_;
};

}  // namespace vantage::report

#endif  // VANTAGE_SERVER_REPORT_HTML_H_
