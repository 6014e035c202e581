#include "core/sensor/presets.h"

#include <algorithm>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace vantage::sensor {
namespace {

// Data sheets give spacings in mm at 10 m.
constexpr double At10m(double millimetres) { return millimetres / 10'000; }

// A head that turns about the vertical, with a mirror that leaves a cone of 360 degrees less
// `vertical` (degrees, as data sheets count it, across the zenith) below it.
ScannerModel Dome(const char* name, double vertical, double range_min, double range_max,
                  double noise, double noise_ppm) {
  ScannerModel model;
  model.name = name;
  model.elevation_min = Radians(90 - vertical / 2);
  model.elevation_max = Radians(90);
  model.range_min = range_min;
  model.range_max = range_max;
  model.range_noise = noise;
  model.range_noise_ppm = noise_ppm;
  return model;
}

Preset Make(ScannerModel model, const char* title, std::vector<ScanSetting> settings, size_t usual,
            const char* source) {
  model.azimuth_step = model.elevation_step = settings[usual].step;
  Preset preset;
  preset.name = model.name;
  preset.title = title;
  preset.model = std::move(model);
  preset.settings = std::move(settings);
  preset.usual = usual;
  preset.source = source;
  return preset;
}

// Figures are those that the named documents state. None of the documents could be opened when the
// table was written, so each has still to be compared with its sheet; what is known to be derived
// rather than stated is said in `source`. Range noise is one sigma on bright surfaces (90 %), as
// a + b r through the distances for which the sheet has it.
std::vector<Preset> MakePresets() {
  std::vector<Preset> presets;
  // Ranging noise 0.1 to 0.3 mm at 10 and 25 m. Resolution 1/1 has 40,960 points a turn, 1.5 mm at
  // 10 m. Minutes: points over 488,000 a second (quality 2x).
  presets.push_back(Make(Dome("faro-focus", 300, 0.6, 150, 0.0003, 0), "FARO Focus S 150",
                         {{"1/2", At10m(3.07), 6.0},
                          {"1/4", At10m(6.14), 1.5},
                          {"1/5", At10m(7.67), 1.0},
                          {"1/8", At10m(12.3), 0.4}},
                         1,
                         "FARO Laser Scanner Focus S 150, technical specification sheet, 2016; "
                         "minutes are derived from its points and rate at quality 2x"));
  // Ranging accuracy 4 mm at 10 m and 7 mm at 20 m; its noise is not stated, so accuracy stands for
  // it.
  presets.push_back(
      Make(Dome("leica-blk360", 300, 0.6, 60, 0.001, 300), "Leica BLK360",
           {{"high", At10m(5), 5.7}, {"medium", At10m(10), 1.8}, {"low", At10m(20), 0.7}}, 1,
           "Leica BLK360 Imaging Laser Scanner (first generation), data sheet, 2017; "
           "range noise is its ranging accuracy; minutes are in doubt"));
  // 0.4 mm at 10 m, 0.5 mm at 20 m. 1 min 42 s, 51 s and 26 s.
  presets.push_back(
      Make(Dome("leica-rtc360", 300, 0.5, 130, 0.0003, 10), "Leica RTC360",
           {{"3mm", At10m(3), 1.7}, {"6mm", At10m(6), 0.85}, {"12mm", At10m(12), 0.43}}, 1,
           "Leica RTC360 3D Reality Capture Solution, data sheet, 2018"));
  // +60 to -40 degrees. Precision 3 mm at 100 m, of which a third is taken to grow with range.
  // Panorama patterns of 20, 40 and 60 millidegrees at 500,000 measurements a second, up to 250 m.
  ScannerModel riegl = Dome("riegl-vz-400i", 260, 0.5, 250, 0.002, 10);
  riegl.elevation_max = Radians(60);
  presets.push_back(Make(std::move(riegl), "RIEGL VZ-400i",
                         {{"panorama-20", Radians(0.02), 3.0},
                          {"panorama-40", Radians(0.04), 0.75},
                          {"panorama-60", Radians(0.06), 0.35}},
                         1,
                         "RIEGL VZ-400i, data sheet, 2019-03; minutes are derived from angles and "
                         "rate; how noise grows with range is assumed"));
  // Below 2.5 mm at 30 m. 1 min 34 s, 3 min 35 s and 6 min 39 s.
  presets.push_back(Make(Dome("trimble-x7", 282, 0.6, 80, 0.002, 17), "Trimble X7",
                         {{"4mm", At10m(4), 6.7}, {"5mm", At10m(5), 3.6}, {"11mm", At10m(11), 1.6}},
                         2,
                         "Trimble X7 3D laser scanning system, datasheet, 2020; how noise grows "
                         "with range is assumed"));
  // Below 1.5 mm at 30 m, at twice the rate of the X7.
  presets.push_back(Make(Dome("trimble-x9", 282, 0.6, 150, 0.001, 17), "Trimble X9",
                         {{"4mm", At10m(4), 3.4}, {"5mm", At10m(5), 1.9}, {"11mm", At10m(11), 1.0}},
                         2,
                         "Trimble X9 3D laser scanner, datasheet, 2023; spacings and minutes are "
                         "derived from the X7's and the rate; how noise grows with range is "
                         "assumed"));
  return presets;
}

}  // namespace

absl::StatusOr<ScanSetting> Preset::Setting(absl::string_view setting) const {
  if (setting.empty()) return settings[usual];
  std::vector<std::string> names;
  for (const ScanSetting& candidate : settings) {
    if (candidate.name == setting) return candidate;
    names.push_back(candidate.name);
  }
  return absl::InvalidArgumentError(absl::StrCat("'", setting, "' is no setting of ", name,
                                                 ", which has ", absl::StrJoin(names, ", ")));
}

ScannerModel Preset::At(const ScanSetting& setting) const {
  ScannerModel at = model;
  at.azimuth_step = at.elevation_step = setting.step;
  return at;
}

ScannerModel Preset::Changed(const ScannerModel& of, const ScanSetting& from,
                             const ScanSetting& to) const {
  ScannerModel changed = of;
  if (changed.azimuth_step == from.step) changed.azimuth_step = to.step;
  if (changed.elevation_step == from.step) changed.elevation_step = to.step;
  return changed;
}

std::span<const Preset> Presets() {
  static const std::vector<Preset> presets = MakePresets();
  return presets;
}

absl::StatusOr<Preset> FindPreset(absl::string_view name) {
  std::vector<std::string> names;
  for (const Preset& preset : Presets()) {
    if (preset.name == name) return preset;
    names.push_back(preset.name);
  }
  return absl::InvalidArgumentError(
      absl::StrCat("'", name, "' is no preset; there are ", absl::StrJoin(names, ", ")));
}

}  // namespace vantage::sensor
