// The scanners that surveyors carry, with the figures of their data sheets as far as they are
// known: none has been compared with its document yet (presets.cc).
#ifndef VANTAGE_CORE_SENSOR_PRESETS_H_
#define VANTAGE_CORE_SENSOR_PRESETS_H_

#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/sensor/scanner_model.h"

namespace vantage::sensor {

// How densely an instrument scans, and how long that takes.
struct ScanSetting {
  std::string name;    // unique within its preset
  double step = 0;     // rad, native, in azimuth and elevation
  double minutes = 0;  // of one scan without images and without setting up
};

struct Preset {
  std::string name;   // 'leica-rtc360'
  std::string title;  // for people
  // With the steps of the usual setting. Clearance, positioning error and the largest usable
  // incidence are no matter of the instrument and have their defaults.
  ScannerModel model;
  std::vector<ScanSetting> settings;  // the finest first
  size_t usual = 0;                   // into `settings`
  std::string source;                 // the document, and what of it is in doubt

  // INVALID_ARGUMENT: there is no such setting; the message lists those that exist. Empty: the
  // usual one.
  absl::StatusOr<ScanSetting> Setting(absl::string_view setting) const;
  // The model at a setting.
  ScannerModel At(const ScanSetting& setting) const;
  // `of`, which is the preset's model at setting `from` but for what somebody has set, at setting
  // `to`. What was set stays.
  ScannerModel Changed(const ScannerModel& of, const ScanSetting& from,
                       const ScanSetting& to) const;
};

// All of them, by name.
std::span<const Preset> Presets();

// INVALID_ARGUMENT: there is no such preset; the message lists those that exist.
absl::StatusOr<Preset> FindPreset(absl::string_view name);

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_PRESETS_H_
