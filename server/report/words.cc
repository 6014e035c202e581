#include "server/report/words.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "server/conversion/to_proto.h"

namespace vantage::report {
namespace {

struct InBoth {
  absl::string_view english;
  absl::string_view german;
};

constexpr InBoth kTexts[] = {
#define VANTAGE_TEXT(name, english, german) {english, german},
#include "server/report/texts.inc"
#undef VANTAGE_TEXT
};

struct LanguageCode {
  absl::string_view code;
  Language language;
};
constexpr std::array<LanguageCode, 2> kLanguages = {
    {{"en", Language::kEnglish}, {"de", Language::kGerman}}};

}  // namespace

absl::string_view TextIn(Language language, Text text) {
  const InBoth& both = kTexts[static_cast<size_t>(text)];
  return language == Language::kGerman ? both.german : both.english;
}

std::optional<Language> LanguageOf(absl::string_view code) {
  for (const LanguageCode& known : kLanguages) {
    if (known.code == code) return known.language;
  }
  return std::nullopt;
}

absl::string_view CodeOf(Language language) { return language == Language::kGerman ? "de" : "en"; }

std::string Words::Fixed(double value, int decimals) const {
  std::string text = absl::StrFormat("%.*f", decimals, value);
  // '-0.0' is 0.
  if (text.find_first_of("123456789") == std::string::npos && text[0] == '-') text.erase(0, 1);
  if (options_.language == Language::kGerman) std::replace(text.begin(), text.end(), '.', ',');
  if (text[0] == '-') text.replace(0, 1, "\u2212");
  return text;
}

std::string Words::Number(double value, int decimals) const {
  std::string text = Fixed(value, decimals);
  const char point = options_.language == Language::kGerman ? ',' : '.';
  const size_t digits = text.find_first_of("0123456789");
  const size_t end = std::min(text.find(point), text.size());
  // Four digits are read at a glance.
  if (digits == std::string::npos || end - digits < 5) return text;
  for (size_t at = end - 3; at > digits && at < text.size(); at -= 3) {
    text.insert(at, 1, point == ',' ? '.' : ',');
  }
  return text;
}

std::string Words::Area(double m2) const { return absl::StrCat(Number(m2, 1), " m\u00b2"); }

std::string Words::Millimetres(double m) const { return Number(1000 * m, m < 0.0995 ? 1 : 0); }

std::string Words::Length(double m) const {
  if (std::abs(m) < 0.0995) return absl::StrCat(Millimetres(m), " mm");
  return std::abs(m) < 0.995 ? absl::StrCat(Number(100 * m, std::abs(m) < 0.2 ? 1 : 0), " cm")
                             : absl::StrCat(Number(m, 2), " m");
}

std::string Words::Percent(double share) const {
  return absl::StrCat(Number(std::floor(1000 * share + 1e-9) / 10, 1), " %");
}

std::string Words::Place(const v1::Vector3& at) const {
  const char* apart = options_.language == Language::kGerman ? "; " : ", ";
  return absl::StrCat("(", Fixed(at.x(), 2), apart, Fixed(at.y(), 2), apart, Fixed(at.z(), 2), ")");
}

std::string Words::Time(absl::Time time) const {
  const absl::TimeZone zone =
      absl::FixedTimeZone(static_cast<int>(absl::ToInt64Seconds(options_.utc_offset)));
  return absl::FormatTime(
      options_.language == Language::kGerman ? "%d.%m.%Y %H:%M" : "%Y-%m-%d %H:%M", time, zone);
}

std::string Words::Time(const google::protobuf::Timestamp& time) const {
  return Time(conversion::ReadTime(time));
}

std::string Words::Day(const google::protobuf::Timestamp& time) const {
  const std::string whole = Time(time);
  return whole.substr(0, whole.find(' '));
}

std::string Words::Zone() const {
  const int64_t minutes = absl::ToInt64Minutes(options_.utc_offset);
  if (minutes == 0) return "UTC";
  return absl::StrFormat("UTC%s%02d:%02d", minutes < 0 ? "\u2212" : "+", std::abs(minutes) / 60,
                         std::abs(minutes) % 60);
}

}  // namespace vantage::report
