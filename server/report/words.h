// What a report says, in the language that was asked for: sentences from texts.inc, figures, places
// and times as people there write them.
#ifndef VANTAGE_SERVER_REPORT_WORDS_H_
#define VANTAGE_SERVER_REPORT_WORDS_H_

#include <optional>
#include <string>

#include "absl/strings/string_view.h"
#include "absl/strings/substitute.h"
#include "absl/time/time.h"
#include "google/protobuf/timestamp.pb.h"
#include "server/report/job_record.h"
#include "vantage/v1/geometry.pb.h"

namespace vantage::report {

// The sentences, by name; texts.inc has them.
enum class Text {
#define VANTAGE_TEXT(name, english, german) k##name,
#include "server/report/texts.inc"
#undef VANTAGE_TEXT
};

// In all languages, as texts.inc has it, with $0, $1, ... for what is filled in.
absl::string_view TextIn(Language language, Text text);

// 'en' and the like; nothing where there is no such language.
std::optional<Language> LanguageOf(absl::string_view code);
absl::string_view CodeOf(Language language);

class Words {
 public:
  explicit Words(const ReportOptions& options) : options_(options) {}

  Language language() const { return options_.language; }

  // A sentence with its parameters filled in.
  template <typename... Parameters>
  std::string operator()(Text text, const Parameters&... parameters) const {
    return absl::Substitute(TextIn(options_.language, text), parameters...);
  }

  // With thousands apart.
  std::string Count(int64_t count) const { return Number(static_cast<double>(count), 0); }
  std::string Number(double value, int decimals) const;
  // Without: for coordinates.
  std::string Fixed(double value, int decimals) const;
  std::string Area(double m2) const;        // '12.3 m²'
  std::string Length(double m) const;       // in mm below 0.1 m, in cm below 1 m
  std::string Millimetres(double m) const;  // the figure alone
  // '97.3 %', never rounded up: 94.96 % is not 95.0.
  std::string Percent(double share) const;
  std::string Place(const v1::Vector3& at) const;  // '(1.20, 3.40, 0.10)'
  std::string Time(absl::Time time) const;
  std::string Time(const google::protobuf::Timestamp& time) const;
  std::string Day(const google::protobuf::Timestamp& time) const;
  std::string Zone() const;  // 'UTC+02:00'

 private:
  ReportOptions options_;
};

}  // namespace vantage::report

#endif  // VANTAGE_SERVER_REPORT_WORDS_H_
