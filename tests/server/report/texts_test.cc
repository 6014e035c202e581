// The texts of a report, in both languages.
#include <gtest/gtest.h>

#include <set>
#include <string>

#include "server/contract/valid_text.h"
#include "server/report/words.h"

namespace vantage::report {
namespace {

struct NamedText {
  const char* name;
  Text text;
};
constexpr NamedText kAll[] = {
#define VANTAGE_TEXT(name, english, german) {#name, Text::k##name},
#include "server/report/texts.inc"
#undef VANTAGE_TEXT
};

std::set<char> ParametersOf(absl::string_view text) {
  std::set<char> parameters;
  for (size_t at = text.find('$'); at != absl::string_view::npos; at = text.find('$', at + 1)) {
    parameters.insert(at + 1 < text.size() ? text[at + 1] : '$');
  }
  return parameters;
}

TEST(Texts, SayTheSameInBothLanguages) {
  for (const NamedText& of : kAll) {
    const absl::string_view english = TextIn(Language::kEnglish, of.text);
    const absl::string_view german = TextIn(Language::kGerman, of.text);
    EXPECT_FALSE(english.empty()) << of.name;
    EXPECT_FALSE(german.empty()) << of.name;
    EXPECT_EQ(ParametersOf(english), ParametersOf(german)) << of.name;
    char next = '0';
    for (const char parameter : ParametersOf(english)) EXPECT_EQ(parameter, next++) << of.name;
    for (const absl::string_view text : {english, german}) {
      EXPECT_EQ(contract::ValidText(text, text.size()), text) << of.name;
      EXPECT_EQ(text.find('<'), absl::string_view::npos) << of.name;
    }
  }
}

TEST(Texts, AreKnownByTheCodesOfTheirLanguages) {
  EXPECT_EQ(LanguageOf("en"), Language::kEnglish);
  EXPECT_EQ(LanguageOf("de"), Language::kGerman);
  EXPECT_EQ(LanguageOf("DE"), std::nullopt);
  EXPECT_EQ(LanguageOf(""), std::nullopt);
  EXPECT_EQ(CodeOf(Language::kGerman), "de");
}

TEST(Words, WriteFiguresAsPeopleThereDo) {
  const Words english(ReportOptions{});
  const Words german(ReportOptions{Language::kGerman, absl::Hours(2), 0.95});
  EXPECT_EQ(english.Number(1234567.25, 1), "1,234,567.2");
  EXPECT_EQ(german.Number(1234567.25, 1), "1.234.567,2");
  EXPECT_EQ(english.Number(1234, 0), "1234");
  EXPECT_EQ(english.Number(-12345, 0), "\u221212,345");
  EXPECT_EQ(english.Fixed(450000.254, 2), "450000.25");
  EXPECT_EQ(german.Fixed(-0.001, 2), "0,00");
  EXPECT_EQ(english.Length(0.0043), "4.3 mm");
  EXPECT_EQ(english.Length(0.1534), "15.3 cm");
  EXPECT_EQ(german.Length(2.5), "2,50 m");
  EXPECT_EQ(english.Length(0.0999), "10.0 cm");
  // Never rounded up to what is required.
  EXPECT_EQ(english.Percent(0.9499999), "94.9 %");
  EXPECT_EQ(english.Percent(0.95), "95.0 %");
  EXPECT_EQ(german.Percent(1), "100,0 %");
  const absl::Time noon = absl::FromUnixSeconds(1'700'000'000);  // 2023-11-14 22:13:20 UTC
  EXPECT_EQ(english.Time(noon), "2023-11-14 22:13");
  EXPECT_EQ(german.Time(noon), "15.11.2023 00:13");
  EXPECT_EQ(english.Zone(), "UTC");
  EXPECT_EQ(german.Zone(), "UTC+02:00");
  EXPECT_EQ(Words(ReportOptions{Language::kEnglish, absl::Minutes(-210), 1}).Zone(),
            "UTC\u221203:30");
}

}  // namespace
}  // namespace vantage::report
