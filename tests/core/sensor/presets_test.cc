#include "core/sensor/presets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace vantage::sensor {
namespace {

using ::testing::HasSubstr;

TEST(PresetsTest, AllArePossibleScanners) {
  ASSERT_GE(Presets().size(), 6u);
  for (const Preset& preset : Presets()) {
    SCOPED_TRACE(preset.name);
    ASSERT_LT(preset.usual, preset.settings.size());
    EXPECT_FALSE(preset.source.empty());
    EXPECT_EQ(FindPreset(preset.name)->title, preset.title);
    EXPECT_EQ(preset.model.name, preset.name);
    EXPECT_EQ(preset.model.azimuth_step, preset.settings[preset.usual].step);
    double step = 0;
    double minutes = 1e9;
    for (const ScanSetting& setting : preset.settings) {
      EXPECT_TRUE(preset.At(setting).Validate().ok()) << preset.At(setting).Validate();
      EXPECT_EQ(preset.Setting(setting.name)->step, setting.step);
      // The finest first, and what is finer takes longer.
      EXPECT_GT(setting.step, step);
      EXPECT_LT(setting.minutes, minutes);
      step = setting.step;
      minutes = setting.minutes;
    }
  }
  EXPECT_TRUE(std::is_sorted(Presets().begin(), Presets().end(),
                             [](const Preset& a, const Preset& b) { return a.name < b.name; }));
}

// A scan cannot be faster than the instrument's rate (measurements a second, as data sheets state
// it).
TEST(PresetsTest, NoScanIsFasterThanItsInstrument) {
  const std::pair<const char*, double> rates[] = {
      {"faro-focus", 976'000},    {"leica-blk360", 360'000}, {"leica-rtc360", 2'000'000},
      {"riegl-vz-400i", 500'000}, {"trimble-x7", 500'000},   {"trimble-x9", 1'000'000}};
  ASSERT_EQ(std::size(rates), Presets().size());
  for (const auto& [name, rate] : rates) {
    const Preset preset = FindPreset(name).value();
    for (const ScanSetting& setting : preset.settings) {
      const double points =
          2 * kPi / setting.step *
          ((preset.model.elevation_max - preset.model.elevation_min) / setting.step);
      EXPECT_LT(points / rate / 60, setting.minutes * 1.05) << name << " " << setting.name;
    }
  }
}

TEST(PresetsTest, UnknownNamesListThoseThatExist) {
  const absl::Status preset = FindPreset("leica-rtc").status();
  EXPECT_EQ(preset.code(), absl::StatusCode::kInvalidArgument);
  for (const Preset& known : Presets()) EXPECT_THAT(preset.message(), HasSubstr(known.name));
  const absl::Status setting = FindPreset("leica-rtc360")->Setting("7mm").status();
  EXPECT_EQ(setting.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(setting.message(), HasSubstr("3mm, 6mm, 12mm"));
  EXPECT_EQ(FindPreset("leica-rtc360")->Setting("")->name, "6mm");
}

}  // namespace
}  // namespace vantage::sensor
