#include "core/sensor/e57.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/e57/index.h"
#include "core/e57/paged_bytes.h"
#include "core/e57/records.h"
#include "core/sensor/grid_columns.h"
#include "core/sensor/grid_directions.h"

namespace vantage::sensor {
namespace {

using FieldNames = std::array<absl::string_view, 3>;
constexpr FieldNames kCartesian = {"cartesianX", "cartesianY", "cartesianZ"};
constexpr FieldNames kColours = {"colorRed", "colorGreen", "colorBlue"};
constexpr FieldNames kSpherical = {"sphericalRange", "sphericalAzimuth", "sphericalElevation"};

std::string NameOf(const e57::ScanSetup& setup, size_t number) {
  return absl::StrCat("E57 set-up ", number + 1,
                      setup.name.empty() ? "" : absl::StrCat(" (", setup.name, ")"));
}

// The fields of a record that tell where its point is, by their places.
struct PointFields {
  std::array<size_t, 3> coordinates{};
  bool spherical = false;
  std::optional<size_t> invalid;
  std::optional<size_t> row;
  std::optional<size_t> column;
  std::optional<size_t> return_index;
  std::optional<size_t> intensity;
  std::optional<std::array<size_t, 3>> colour;

  AppearanceKinds appearance() const { return {intensity.has_value(), colour.has_value()}; }
  bool gridded() const { return row.has_value() && column.has_value(); }
};

absl::StatusOr<PointFields> FindFields(const e57::ScanSetup& setup, const std::string& name) {
  PointFields fields;
  const auto all = [&](const FieldNames& names, std::array<size_t, 3>& places) {
    for (size_t i = 0; i < names.size(); ++i) {
      const std::optional<size_t> place = setup.FieldOf(names[i]);
      if (!place.has_value()) return false;
      places[i] = *place;
    }
    return true;
  };
  if (!all(kCartesian, fields.coordinates)) {
    if (!all(kSpherical, fields.coordinates)) {
      return absl::InvalidArgumentError(
          absl::StrCat(name,
                       ": its records have neither cartesian nor spherical coordinates; "
                       "export it with one of them"));
    }
    fields.spherical = true;
  }
  fields.invalid =
      setup.FieldOf(fields.spherical ? "sphericalInvalidState" : "cartesianInvalidState");
  fields.row = setup.FieldOf("rowIndex");
  fields.column = setup.FieldOf("columnIndex");
  fields.return_index = setup.FieldOf("returnIndex");
  fields.intensity = setup.FieldOf("intensity");
  if (std::array<size_t, 3> colours{}; all(kColours, colours)) fields.colour = colours;
  for (const std::optional<size_t>& place :
       {std::optional(fields.coordinates[0]), std::optional(fields.coordinates[1]),
        std::optional(fields.coordinates[2]), fields.invalid, fields.row, fields.column,
        fields.return_index}) {
    if (place.has_value() && setup.fields[*place].type == e57::FieldType::kString) {
      return absl::InvalidArgumentError(absl::StrCat(
          name, ": its field ", setup.fields[*place].name, " is a text; export the file again"));
    }
  }
  // A text tells no brightness.
  const auto is_text = [&](size_t place) {
    return setup.fields[place].type == e57::FieldType::kString;
  };
  if (fields.intensity.has_value() && is_text(*fields.intensity)) fields.intensity.reset();
  if (fields.colour.has_value() &&
      std::any_of(fields.colour->begin(), fields.colour->end(), is_text)) {
    fields.colour.reset();
  }
  return fields;
}

// What the values of a field may be: as the set-up says, else all that can be stored.
e57::ValueLimits LimitsOf(const std::optional<e57::ValueLimits>& stated, const e57::Field& field) {
  if (stated.has_value()) return *stated;
  if (field.type != e57::FieldType::kInteger && field.type != e57::FieldType::kScaledInteger) {
    return {};
  }
  const auto value = [&](int64_t stored) {
    return static_cast<double>(stored) * field.scale + field.offset;
  };
  return {value(field.minimum), value(field.maximum)};
}

// Inclusive; empty while max < min.
struct IndexRange {
  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();

  void Include(double value) {
    min = std::min(min, value);
    max = std::max(max, value);
  }
  double count() const { return max - min + 1; }
};

struct Grid {
  IndexRange columns;
  IndexRange rows;
};

// As large as the file says, and as its records need.
absl::StatusOr<Grid> FindGrid(e57::PagedBytes& file, const e57::ScanSetup& setup,
                              const PointFields& fields, const std::string& name,
                              const ImportLimits& limits) {
  Grid grid;
  if (setup.bounds.has_value()) {
    grid.rows.Include(static_cast<double>(setup.bounds->row_min));
    grid.rows.Include(static_cast<double>(setup.bounds->row_max));
    grid.columns.Include(static_cast<double>(setup.bounds->column_min));
    grid.columns.Include(static_cast<double>(setup.bounds->column_max));
  }
  const std::array<size_t, 2> indices{*fields.row, *fields.column};
  absl::Status read = e57::ReadRecords(file, setup, indices, [&](e57::RecordBlock block) {
    for (size_t k = 0; k < 2; ++k) {
      IndexRange& range = k == 0 ? grid.rows : grid.columns;
      for (const double index : block[k]) {
        if (!(index == std::floor(index))) {
          return absl::InvalidArgumentError(
              absl::StrCat(name, ": a ", k == 0 ? "rowIndex" : "columnIndex",
                           " is no whole number; export the file again"));
        }
        range.Include(index);
      }
    }
    return absl::OkStatus();
  });
  if (!read.ok()) return read;
  const double columns = grid.columns.count();
  const double rows = grid.rows.count();
  if (columns < 2 || rows < 2) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "%s: %.0f columns x %.0f rows; at least 2 x 2 are needed", name, columns, rows));
  }
  if (columns * rows > static_cast<double>(limits.max_points)) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "%s: %.0f columns x %.0f rows are more than the limit of %d points; export the scan at a "
        "lower resolution",
        name, columns, rows, limits.max_points));
  }
  return grid;
}

Eigen::Vector3d FromSpherical(double range, double azimuth, double elevation) {
  const double horizontal = range * std::cos(elevation);
  return {horizontal * std::cos(azimuth), horizontal * std::sin(azimuth),
          range * std::sin(elevation)};
}

// Puts the returns of a set-up where they belong.
class PointReader {
 public:
  PointReader(const e57::ScanSetup& setup, const PointFields& fields, std::string name,
              const ImportLimits& limits)
      : setup_(setup), spherical_(fields.spherical), name_(std::move(name)), far_(limits.unit) {
    places_.assign(fields.coordinates.begin(), fields.coordinates.end());
    const auto add = [&](const std::optional<size_t>& place) -> std::optional<size_t> {
      if (!place.has_value()) return std::nullopt;
      places_.push_back(*place);
      return places_.size() - 1;
    };
    invalid_ = add(fields.invalid);
    return_index_ = add(fields.return_index);
    if (fields.gridded()) {
      row_ = add(fields.row);
      column_ = add(fields.column);
    }
    if (limits.appearance.intensity && fields.intensity.has_value()) {
      intensity_ = add(fields.intensity);
      intensity_limits_ = LimitsOf(setup.intensity_limits, setup.fields[*fields.intensity]);
    }
    if (limits.appearance.colour && fields.colour.has_value()) {
      for (size_t i = 0; i < 3; ++i) colour_[i] = *add((*fields.colour)[i]);
      colour_limits_ = LimitsOf(setup.colour_limits, setup.fields[(*fields.colour)[0]]);
    }
  }

  // The returns, in the file's order.
  absl::StatusOr<std::vector<Eigen::Vector3f>> Read(e57::PagedBytes& file) {
    std::vector<Eigen::Vector3f> points;
    absl::Status read = ForEachReturn(
        file, [&](e57::RecordBlock, size_t, const Eigen::Vector3f& p) { points.push_back(p); });
    if (!read.ok()) return read;
    return points;
  }

  // Each in its cell.
  absl::StatusOr<KnownGrid> Read(e57::PagedBytes& file, const Grid& grid) {
    KnownGrid points(static_cast<size_t>(grid.columns.count()),
                     static_cast<size_t>(grid.rows.count()),
                     intensity_.has_value() || colour_limits_.has_value());
    uint32_t returns = 0;
    absl::Status read =
        ForEachReturn(file, [&](e57::RecordBlock block, size_t i, const Eigen::Vector3f& p) {
          const auto column = static_cast<size_t>(block[*column_][i] - grid.columns.min);
          const auto row = static_cast<size_t>(block[*row_][i] - grid.rows.min);
          duplicates_ += points.Put(column, row, p, returns++) ? 0 : 1;
        });
    if (!read.ok()) return read;
    return points;
  }

  // Of the returns, in the order in which they were read: what is wanted and there is.
  Appearance TakeAppearance() { return std::move(appearance_); }
  size_t far() const { return far_.count(); }
  size_t duplicates() const { return duplicates_; }

 private:
  using TakeReturn =
      absl::FunctionRef<void(e57::RecordBlock block, size_t i, const Eigen::Vector3f&)>;

  absl::Status ForEachReturn(e57::PagedBytes& file, TakeReturn take) {
    uint64_t record = 0;
    absl::Status read =
        e57::ReadRecords(file, setup_, places_, [&](e57::RecordBlock block) -> absl::Status {
          for (size_t i = 0; i < block[0].size(); ++i, ++record) {
            const std::optional<Eigen::Vector3f> point = Take(block, i, record);
            if (!point.has_value()) continue;
            Look(block, i);
            take(block, i, *point);
          }
          return absl::OkStatus();
        });
    if (!read.ok()) return read;
    if (absl::Status near = far_.Check(); !near.ok()) return near;
    if (returns_ > 0) return absl::OkStatus();
    return absl::InvalidArgumentError(
        absl::StrCat(name_, ": none of its ", setup_.records, " records is a return"));
  }

  // Takes note of how a return looked.
  void Look(e57::RecordBlock block, size_t i) {
    const auto share = [](double value, const e57::ValueLimits& limits) {
      return (value - limits.min) / (limits.max - limits.min);
    };
    if (intensity_.has_value()) {
      appearance_.intensity.push_back(IntensityOf(share(block[*intensity_][i], intensity_limits_)));
    }
    if (colour_limits_.has_value()) {
      Colour& colour = appearance_.colour.emplace_back();
      for (size_t k = 0; k < 3; ++k) {
        colour[k] = ColourOf(share(block[colour_[k]][i], *colour_limits_));
      }
    }
  }

  // The point of a record that is a return.
  std::optional<Eigen::Vector3f> Take(e57::RecordBlock block, size_t i, uint64_t record) {
    if (invalid_.has_value() && block[*invalid_][i] != 0) return std::nullopt;
    if (return_index_.has_value() && block[*return_index_][i] != 0) {
      ++duplicates_;
      return std::nullopt;
    }
    const Eigen::Vector3d point = spherical_
                                      ? FromSpherical(block[0][i], block[1][i], block[2][i])
                                      : Eigen::Vector3d(block[0][i], block[1][i], block[2][i]);
    if (!point.allFinite() || point.isZero(0)) return std::nullopt;
    ++returns_;
    return far_.Near(point, [&] { return absl::StrCat(name_, " record ", record); });
  }

  const e57::ScanSetup& setup_;
  const bool spherical_;
  const std::string name_;
  std::vector<size_t> places_;  // of the fields that are read
  // Among these.
  std::optional<size_t> invalid_;
  std::optional<size_t> return_index_;
  std::optional<size_t> row_;
  std::optional<size_t> column_;
  std::optional<size_t> intensity_;
  std::array<size_t, 3> colour_{};
  e57::ValueLimits intensity_limits_;
  std::optional<e57::ValueLimits> colour_limits_;  // where colour is wanted and there is some
  Appearance appearance_;
  FarReturns far_;
  size_t returns_ = 0;
  size_t duplicates_ = 0;
};

}  // namespace

absl::StatusOr<std::vector<std::string>> ListE57Setups(const bytes::ByteSource& source) {
  absl::StatusOr<e57::PagedBytes> file = e57::PagedBytes::Open(source);
  if (!file.ok()) return file.status();
  const absl::StatusOr<std::vector<e57::ScanSetup>> setups = e57::ReadIndex(*file);
  if (!setups.ok()) return setups.status();
  std::vector<std::string> names;
  names.reserve(setups->size());
  for (const e57::ScanSetup& setup : *setups) names.push_back(setup.name);
  return names;
}

absl::StatusOr<ImportedScan> ParseE57(const bytes::ByteSource& source, size_t number,
                                      const ImportLimits& limits) {
  absl::StatusOr<e57::PagedBytes> file = e57::PagedBytes::Open(source);
  if (!file.ok()) return file.status();
  const absl::StatusOr<std::vector<e57::ScanSetup>> setups = e57::ReadIndex(*file);
  if (!setups.ok()) return setups.status();
  if (setups->empty()) return absl::InvalidArgumentError("E57: there is no scan in it");
  if (number >= setups->size()) {
    return absl::InvalidArgumentError(
        absl::StrCat("E57: there is no set-up ", number + 1, ", it has ", setups->size()));
  }
  const e57::ScanSetup& setup = (*setups)[number];
  const std::string name = NameOf(setup, number);
  if (setup.records == 0) {
    return absl::InvalidArgumentError(absl::StrCat(name, ": it has no points"));
  }
  if (setup.records > limits.max_points) {
    return absl::InvalidArgumentError(
        absl::StrCat(name, ": ", setup.records, " records are more than the limit of ",
                     limits.max_points, " points; export the scan at a lower resolution"));
  }
  const absl::StatusOr<PointFields> fields = FindFields(setup, name);
  if (!fields.ok()) return fields.status();
  std::optional<Grid> grid;
  if (fields->gridded()) {
    absl::StatusOr<Grid> found = FindGrid(*file, setup, *fields, name, limits);
    if (!found.ok()) return found.status();
    grid = *found;
  }
  std::optional<absl::StatusOr<GriddedScan>> gridded;
  std::optional<RangeImage> leaning;
  Appearance appearance;
  size_t far = 0;
  size_t duplicates = 0;
  if (grid.has_value()) {
    PointReader reader(setup, *fields, name, limits);
    absl::StatusOr<KnownGrid> points = reader.Read(*file, *grid);
    if (!points.ok()) return points.status();
    gridded = points->ToScan();
    leaning = points->leaning();
    far = reader.far();
    duplicates = reader.duplicates();
    appearance = reader.TakeAppearance();
  }
  if (!gridded.has_value()) {  // the returns alone, by their directions
    PointReader reader(setup, *fields, name, limits);
    const absl::StatusOr<std::vector<Eigen::Vector3f>> points = reader.Read(*file);
    if (!points.ok()) return points.status();
    gridded = GridDirections(*points, leaning);
    far = reader.far();
    duplicates = reader.duplicates();
    appearance = reader.TakeAppearance();
  }
  if (!gridded->ok()) return gridded->status();
  (*gridded)->duplicates += duplicates;
  absl::StatusOr<ImportedScan> scan =
      FinishImport(**std::move(gridded), setup.records, limits, appearance);
  if (!scan.ok()) return scan.status();
  scan->appearance = fields->appearance();
  scan->far = far;
  if (setup.T_file_setup.has_value() &&
      !setup.T_file_setup->isApprox(Eigen::Isometry3d::Identity(), 1e-12)) {
    scan->T_world_scan = setup.T_file_setup;
    scan->T_world_scan->translation() *= limits.unit;
  }
  return scan;
}

}  // namespace vantage::sensor
