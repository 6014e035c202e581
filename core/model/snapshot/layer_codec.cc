#include "core/model/snapshot/layer_codec.h"

#include <algorithm>
#include <cmath>

#include "core/model/snapshot/snapshot_bricks.h"
#include "core/model/snapshot/snapshot_bytes.h"

namespace vantage::model {
namespace {

constexpr uint8_t kJoinedBits = 15;

bool RisesStrictly(const std::vector<double>& angles) {
  for (size_t i = 0; i < angles.size(); ++i) {
    if (!std::isfinite(angles[i]) || (i > 0 && angles[i] <= angles[i - 1])) return false;
  }
  return angles.size() >= 2;
}

void WriteAngles(const std::vector<double>& angles, SnapshotWriter& out) {
  out.Varint(angles.size());
  for (const double angle : angles) out.Fixed(angle);
}

std::vector<double> ReadAngles(SnapshotReader& in) {
  std::vector<double> angles(in.Count(sizeof(double)));
  for (double& angle : angles) angle = in.Fixed<double>();
  return angles;
}

void WriteScanner(const sensor::ScannerModel& scanner, SnapshotWriter& out) {
  out.Text(scanner.name);
  for (const double value : {scanner.azimuth_span, scanner.elevation_min, scanner.elevation_max,
                             scanner.azimuth_step, scanner.elevation_step, scanner.range_min,
                             scanner.range_max, scanner.range_noise, scanner.range_noise_ppm,
                             scanner.max_incidence, scanner.clearance, scanner.positioning_error}) {
    out.Fixed(value);
  }
}

void ReadScanner(SnapshotReader& in, sensor::ScannerModel& scanner) {
  scanner.name = in.Text();
  for (double* value : {&scanner.azimuth_span, &scanner.elevation_min, &scanner.elevation_max,
                        &scanner.azimuth_step, &scanner.elevation_step, &scanner.range_min,
                        &scanner.range_max, &scanner.range_noise, &scanner.range_noise_ppm,
                        &scanner.max_incidence, &scanner.clearance, &scanner.positioning_error}) {
    *value = in.Fixed<double>();
  }
}

}  // namespace

void LayerCodec::WriteSuspects(const ScanLayer& layer, SnapshotWriter& out) {
  out.Varint(layer.suspects.size());
  for (const SuspectedReflector& suspect : layer.suspects) {
    out.Matrix(suspect.plane.normal);
    out.Fixed(suspect.plane.distance);
    out.Fixed(suspect.plane.behind);
    out.Varint(suspect.asked.size());
    for (const ScanCell& cell : suspect.asked) {
      out.Varint(static_cast<uint64_t>(cell.column));
      out.Varint(static_cast<uint64_t>(cell.row));
    }
    WriteAperture(suspect.aperture, out);
    out.Varint(suspect.wall ? 1 : 0);
    if (suspect.wall) out.Matrix(*suspect.wall);
  }
}

void LayerCodec::ReadSuspects(SnapshotReader& in, ScanLayer& layer) {
  const size_t suspects = in.Count(sizeof(double) * 5);
  for (size_t i = 0; i < suspects && in.ok(); ++i) {
    SuspectedReflector suspect{
        .plane = {}, .asked = {}, .aperture = {Eigen::Vector3d::UnitZ(), 0, {}}, .wall = {}};
    in.Matrix(suspect.plane.normal);
    suspect.plane.distance = in.Fixed<double>();
    suspect.plane.behind = in.Fixed<double>();
    if (!suspect.plane.normal.allFinite() || !std::isfinite(suspect.plane.distance)) in.Fail();
    const size_t asked = in.Count(2);
    for (size_t k = 0; k < asked && in.ok(); ++k) {
      const uint64_t column = in.Varint();
      const uint64_t row = in.Varint();
      if (column >= static_cast<uint64_t>(layer.range_surface.columns()) ||
          row >= static_cast<uint64_t>(layer.range_surface.rows())) {
        in.Fail();
        break;
      }
      suspect.asked.push_back({static_cast<int>(column), static_cast<int>(row)});
    }
    suspect.aperture = ReadAperture(in);
    if (in.Varint() != 0) {
      in.Matrix(suspect.wall.emplace());
      if (!suspect.wall->allFinite()) in.Fail();
    }
    layer.suspects.push_back(std::move(suspect));
  }
}

void LayerCodec::WriteAperture(const Aperture& aperture, SnapshotWriter& out) {
  out.Matrix(aperture.normal_);
  out.Fixed(aperture.distance_);
  out.Matrix(aperture.origin_);
  out.Matrix(aperture.axis_u_);
  out.Matrix(aperture.axis_v_);
  out.Varint(static_cast<uint64_t>(aperture.columns_));
  out.Varint(static_cast<uint64_t>(aperture.rows_));
  out.Raw(aperture.inside_.data(), aperture.inside_.size());
}

Aperture LayerCodec::ReadAperture(SnapshotReader& in) {
  Aperture aperture(Eigen::Vector3d::UnitZ(), 0, {});
  in.Matrix(aperture.normal_);
  aperture.distance_ = in.Fixed<double>();
  in.Matrix(aperture.origin_);
  in.Matrix(aperture.axis_u_);
  in.Matrix(aperture.axis_v_);
  const size_t columns = in.Count(1);
  const size_t rows = in.Count(std::max<size_t>(columns, 1));
  const bool finite = aperture.normal_.allFinite() && std::isfinite(aperture.distance_) &&
                      aperture.origin_.allFinite() && aperture.axis_u_.allFinite() &&
                      aperture.axis_v_.allFinite();
  if (!finite) in.Fail();
  const char* inside = in.Raw(columns * rows);
  if (inside == nullptr) return aperture;
  aperture.columns_ = static_cast<int>(columns);
  aperture.rows_ = static_cast<int>(rows);
  aperture.inside_.assign(inside, inside + columns * rows);
  return aperture;
}

// The bytes of the ranges plane by plane: those of the exponents are nearly all alike.
void LayerCodec::WriteSurface(const RangeSurface& surface, SnapshotWriter& out) {
  out.Fixed(static_cast<uint8_t>(surface.azimuth_.closed() ? 1 : 0));
  WriteAngles(surface.azimuth_.angles(), out);
  WriteAngles(surface.elevation_.angles(), out);
  const size_t cells = surface.range_.size();
  std::string planes(4 * cells, '\0');
  const char* bytes = reinterpret_cast<const char*>(surface.range_.data());
  for (size_t i = 0; i < cells; ++i) {
    for (size_t plane = 0; plane < 4; ++plane) planes[plane * cells + i] = bytes[4 * i + plane];
  }
  out.Raw(planes.data(), planes.size());
  out.Raw(surface.joined_.data(), cells);
}

std::optional<RangeSurface> LayerCodec::ReadSurface(SnapshotReader& in) {
  const bool closed = in.Fixed<uint8_t>() != 0;
  std::vector<double> azimuth = ReadAngles(in);
  std::vector<double> elevation = ReadAngles(in);
  if (!in.ok() || !RisesStrictly(azimuth) || !RisesStrictly(elevation)) return std::nullopt;
  if (!(azimuth.back() - azimuth.front() < 2 * sensor::kPi) || elevation.front() < -2 ||
      elevation.back() > 2) {
    return std::nullopt;
  }
  constexpr size_t kBytesPerCell = 5;
  if (azimuth.size() > in.left() / kBytesPerCell / elevation.size()) return std::nullopt;
  const size_t cells = azimuth.size() * elevation.size();
  const char* planes = in.Raw(4 * cells);
  const char* joined_bytes = in.Raw(cells);
  if (planes == nullptr || joined_bytes == nullptr) return std::nullopt;
  std::vector<float> range(cells);
  char* bytes = reinterpret_cast<char*>(range.data());
  for (size_t i = 0; i < cells; ++i) {
    for (size_t plane = 0; plane < 4; ++plane) bytes[4 * i + plane] = planes[plane * cells + i];
  }
  std::vector<uint8_t> joined(joined_bytes, joined_bytes + cells);
  for (size_t i = 0; i < cells; ++i) {
    if (!std::isfinite(range[i]) ||
        (range[i] < 0 && range[i] != sensor::RangeImage::kNoInformation) ||
        joined[i] > kJoinedBits) {
      return std::nullopt;
    }
  }
  return RangeSurface(AngularAxis(std::move(azimuth), closed),
                      AngularAxis(std::move(elevation), false), std::move(range),
                      std::move(joined));
}

std::string LayerCodec::Write(const ScanLayer& layer) {
  SnapshotWriter out;
  out.Varint(layer.algorithm_version);
  WriteSurface(layer.range_surface, out);
  WriteScanner(layer.scanner, out);
  out.Fixed(layer.elevation_first);
  out.Fixed(layer.elevation_last);
  out.Matrix(layer.T_model_scan.matrix().topRows<3>());
  out.Matrix(layer.station.position);
  out.Fixed(layer.station.floor_height);
  out.Fixed(static_cast<uint8_t>(layer.station.floor_found ? 1 : 0));
  out.Fixed(layer.station.clearance);
  out.Varint(layer.samples);
  out.Varint(layer.empty_voxels);
  out.Varint(layer.surface_voxels);
  out.Varint(layer.reflectors.size());
  for (const Reflector& reflector : layer.reflectors) {
    out.Matrix(reflector.normal);
    out.Fixed(reflector.distance);
    out.Varint(reflector.cells);
    WriteAperture(reflector.aperture, out);
  }
  if (layer.algorithm_version >= kSuspectsReflectors) WriteSuspects(layer, out);
  std::vector<std::pair<BrickKey, const LayerBrick*>> whole;
  for (const auto& [key, brick] : layer.set_aside) whole.emplace_back(key, &brick);
  layer.bricks.ForEach([&](BrickKey key, const LayerBrick& brick) {
    if (!layer.set_aside.contains(key)) whole.emplace_back(key, &brick);
  });
  std::sort(whole.begin(), whole.end());
  out.Varint(whole.size());
  BrickKey last = 0;
  for (const auto& [key, brick] : whole) {
    out.Varint(key - last);
    last = key;
    WriteMasksAndSums(brick->empty, brick->surface, brick->sums, out);
  }
  return out.Take();
}

std::unique_ptr<ScanLayer> LayerCodec::Read(absl::string_view bytes, const SnapshotHeader& header) {
  SnapshotReader in(bytes);
  // Format 1 had one version for all.
  const uint64_t algorithm_version =
      header.format_version == 1 ? header.algorithm_version : in.Varint();
  if (algorithm_version < header.algorithm_version || algorithm_version > UINT32_MAX) {
    return nullptr;
  }
  std::optional<RangeSurface> surface = ReadSurface(in);
  if (!surface.has_value()) return nullptr;
  auto layer = std::unique_ptr<ScanLayer>(
      new ScanLayer{.range_surface = *std::move(surface), .scanner = {}});
  layer->holes = HoleMap(layer->range_surface);
  layer->algorithm_version = static_cast<uint32_t>(algorithm_version);
  ReadScanner(in, layer->scanner);
  layer->range_surface.range_sigma_ = layer->scanner.RangeSigma(layer->scanner.range_max);
  layer->elevation_first = in.Fixed<double>();
  layer->elevation_last = in.Fixed<double>();
  Eigen::Matrix<double, 3, 4> pose;
  in.Matrix(pose);
  layer->T_model_scan.matrix().topRows<3>() = pose;
  in.Matrix(layer->station.position);
  layer->station.floor_height = in.Fixed<double>();
  layer->station.floor_found = in.Fixed<uint8_t>() != 0;
  layer->station.clearance = in.Fixed<double>();
  layer->samples = static_cast<size_t>(in.Varint());
  layer->empty_voxels = static_cast<size_t>(in.Varint());
  layer->surface_voxels = static_cast<size_t>(in.Varint());
  // No voxel is beyond any limit on a site's extent (ModelConfig).
  if (!in.ok() || !layer->scanner.Validate().ok() || !pose.allFinite() ||
      !layer->station.position.allFinite()) {
    return nullptr;
  }
  const size_t reflectors = in.Count(sizeof(double) * 4);
  for (size_t i = 0; i < reflectors && in.ok(); ++i) {
    Reflector reflector{.aperture = Aperture(Eigen::Vector3d::UnitZ(), 0, {})};
    in.Matrix(reflector.normal);
    reflector.distance = in.Fixed<double>();
    reflector.cells = static_cast<size_t>(in.Varint());
    reflector.aperture = ReadAperture(in);
    layer->reflectors.push_back(std::move(reflector));
  }
  if (layer->algorithm_version >= kSuspectsReflectors) ReadSuspects(in, *layer);
  const size_t bricks = in.Count(2);
  BrickKey key = 0;
  for (size_t i = 0; i < bricks && in.ok(); ++i) {
    const uint64_t step = in.Varint();
    if ((i > 0 && step == 0) || step > ~key) in.Fail();
    key += step;
    if (!IsInOctree(BrickOf(key)) || KeyOf(BrickOf(key)) != key) in.Fail();
    LayerBrick brick;
    ReadMasksAndSums(in, brick.empty, brick.surface, brick.sums);
    layer->bricks.Put(key, std::move(brick));
  }
  if (!in.ok() || in.left() > 0) return nullptr;
  return layer;
}

}  // namespace vantage::model
