#include "core/simulation/simulated_scanner.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/simulation/random_sequence.h"

namespace vantage::simulation {
namespace {

constexpr double kGrazing = sensor::Radians(80);       // from here on returns get lost
constexpr double kGlassHeadOn = sensor::Radians(5);    // up to here glass returns
constexpr double kPolishBegins = sensor::Radians(60);  // from here on polished surfaces reflect
constexpr double kPolishFull = sensor::Radians(85);    // from here on with the full probability
constexpr int kMaxReflections = 4;
constexpr float kLeaveSurface = 1e-4f;  // m, where a reflected ray begins
constexpr size_t kSubRays = 4;          // on the rim of the beam

// What one draw is for.
enum Stream : uint64_t { kNoise = 0, kDropout = 2, kMix = 3, kRoll = 4, kPitch = 6, kPolish = 8 };

// What came back along one ray, before noise.
struct Return {
  float range = 0;  // m; 0: nothing
  float cos_incidence = 0;
  Material material = Material::kMatte;
};

std::vector<double> EvenLines(double first, double last, double step) {
  const double count = std::max(2.0, std::round((last - first) / step));
  std::vector<double> lines;
  for (double i = 0; i < count; ++i) lines.push_back(first + (i + 0.5) * (last - first) / count);
  return lines;
}

bool Reflects(Material surface, float cosine, const ScanFaults& faults, double draw) {
  if (surface == Material::kMirror) return faults.mirror_reflections;
  if (surface != Material::kPolished) return false;
  const double incidence = std::acos(std::min(1.0, static_cast<double>(cosine)));
  const double share = (incidence - kPolishBegins) / (kPolishFull - kPolishBegins);
  return draw < faults.polish * std::clamp(share, 0.0, 1.0);
}

// Follows a ray from its first hit to what returns it. `draw`, uniform in [0, 1), decides what
// polished surfaces do.
Return Resolve(const Tracer& tracer, const std::vector<Material>& material,
               const ScanFaults& faults, double draw, const Eigen::Vector3f& origin,
               Eigen::Vector3f direction, TraceHit hit) {
  Return result;
  double range = 0;
  Eigen::Vector3f at = origin;
  for (int reflections = 0; hit.hit; ++reflections) {
    range += hit.distance;
    const Material surface = material[hit.triangle];
    const float cosine = std::abs(hit.normal.dot(direction));
    if (Reflects(surface, cosine, faults, draw)) {
      if (reflections == kMaxReflections) return result;
      at += hit.distance * direction;
      direction = (direction - 2 * hit.normal.dot(direction) * hit.normal).normalized();
      hit = tracer.Trace(at, direction, kLeaveSurface);
      continue;
    }
    if (surface == Material::kGlass && faults.glass_drops_out && cosine < std::cos(kGlassHeadOn)) {
      return result;
    }
    result.range = static_cast<float>(range);
    result.cos_incidence = cosine;
    result.material = surface;
    return result;
  }
  return result;
}

bool DropsOut(const Return& returned, const ScanFaults& faults, uint64_t seed, uint64_t cell) {
  static const double kCosGrazing = std::cos(kGrazing);
  double keep = 1;
  if (returned.cos_incidence < kCosGrazing) {
    const double incidence = std::acos(static_cast<double>(returned.cos_incidence));
    keep *= 1 - faults.grazing_dropout * (incidence - kGrazing) / (sensor::kPi / 2 - kGrazing);
  }
  if (returned.material == Material::kDark) keep *= 1 - faults.dark_dropout;
  return keep < 1 && RandomUniform(seed, cell, kDropout) >= keep;
}

// Whether two neighbouring cells may lie on either side of an edge.
bool EdgeBetween(float a, float b) {
  if ((a > 0) != (b > 0)) return true;
  return std::abs(a - b) > 0.03f + 0.02f * std::min(a, b);
}

}  // namespace

SimulatedScanner::SimulatedScanner(const TriangleMesh& mesh)
    : tracer_(std::make_unique<Tracer>(mesh)), material_(mesh.material) {
  material_.resize(mesh.triangles.size(), Material::kMatte);
}

SimulatedScanner::~SimulatedScanner() = default;

sensor::RangeImage SimulatedScanner::Scan(const sensor::ScannerModel& scanner,
                                          const Eigen::Isometry3d& T_scene_scan,
                                          const ScanFaults& faults, uint64_t seed,
                                          parallel::Parallel& parallel, double preview) const {
  sensor::RangeImage image;
  const double half_span = 0.5 * scanner.azimuth_span;
  image.azimuth = EvenLines(-half_span, half_span, std::max(preview, scanner.azimuth_step));
  image.elevation = EvenLines(scanner.elevation_min, scanner.elevation_max,
                              std::max(preview, scanner.elevation_step));
  image.full_turn = scanner.azimuth_span > 2 * sensor::kPi - 0.5 * scanner.azimuth_step;
  image.native_azimuth_step = scanner.azimuth_step;
  image.native_elevation_step = scanner.elevation_step;
  image.range.assign(image.cells(), sensor::RangeImage::kNoReturn);

  const Eigen::Matrix3d rotation =
      T_scene_scan.linear() *
      (Eigen::AngleAxisd(faults.tilt * RandomNormal(seed, 0, kRoll), Eigen::Vector3d::UnitX()) *
       Eigen::AngleAxisd(faults.tilt * RandomNormal(seed, 0, kPitch), Eigen::Vector3d::UnitY()))
          .toRotationMatrix();
  const Eigen::Vector3f origin = T_scene_scan.translation().cast<float>();
  const int columns = image.columns();
  const int rows = image.rows();
  // cos a and sin a of every column, cos e and sin e of every row.
  std::vector<Eigen::Vector2d> column_turn;
  std::vector<Eigen::Vector2d> row_rise;
  for (const double a : image.azimuth) column_turn.emplace_back(std::cos(a), std::sin(a));
  for (const double e : image.elevation) row_rise.emplace_back(std::cos(e), std::sin(e));
  const auto direction_of = [&](int column, int row) -> Eigen::Vector3f {
    const Eigen::Vector2d& turn = column_turn[static_cast<size_t>(column)];
    const Eigen::Vector2d& rise = row_rise[static_cast<size_t>(row)];
    const Eigen::Vector3d d(rise.x() * turn.x(), rise.x() * turn.y(), rise.y());
    return (rotation * d).cast<float>();
  };

  std::vector<Return> returns(image.cells());
  parallel.For(static_cast<size_t>(columns), [&](size_t index) {
    const int column = static_cast<int>(index);
    std::array<Eigen::Vector3f, Tracer::kPacket> directions;
    std::array<TraceHit, Tracer::kPacket> hits;
    for (int row = 0; row < rows; row += static_cast<int>(Tracer::kPacket)) {
      const size_t count =
          std::min(Tracer::kPacket, static_cast<size_t>(rows) - static_cast<size_t>(row));
      for (size_t i = 0; i < count; ++i) {
        directions[i] = direction_of(column, row + static_cast<int>(i));
      }
      tracer_->TracePacket(origin, std::span(directions).first(count),
                           std::span(hits).first(count));
      for (size_t i = 0; i < count; ++i) {
        const size_t cell = image.Index(column, row + static_cast<int>(i));
        returns[cell] = Resolve(*tracer_, material_, faults, RandomUniform(seed, cell, kPolish),
                                origin, directions[i], hits[i]);
      }
    }
  });

  // An edge inside the beam: the instrument reports something between the two surfaces.
  const auto near_edge = [&](int column, int row) {
    const float own = returns[image.Index(column, row)].range;
    if (row > 0 && EdgeBetween(own, returns[image.Index(column, row - 1)].range)) return true;
    if (row + 1 < rows && EdgeBetween(own, returns[image.Index(column, row + 1)].range))
      return true;
    for (const int side : {-1, 1}) {
      int other = column + side;
      if (image.full_turn) other = (other + columns) % columns;
      if (other < 0 || other >= columns) continue;
      if (EdgeBetween(own, returns[image.Index(other, row)].range)) return true;
    }
    return false;
  };
  const auto mixed = [&](int column, int row, float own) {
    const Eigen::Vector3f axis = direction_of(column, row);
    const Eigen::Vector3f across = axis.unitOrthogonal();
    const Eigen::Vector3f along = axis.cross(across);
    const auto radius = static_cast<float>(0.5 * faults.beam_divergence);
    const std::array<Eigen::Vector3f, kSubRays> rim = {
        (axis + radius * across).normalized(), (axis - radius * across).normalized(),
        (axis + radius * along).normalized(), (axis - radius * along).normalized()};
    std::array<TraceHit, kSubRays> hits;
    tracer_->TracePacket(origin, rim, hits);
    float nearest = own;
    float farthest = own;
    const double draw = RandomUniform(seed, image.Index(column, row), kPolish);
    for (size_t i = 0; i < kSubRays; ++i) {
      const float range = Resolve(*tracer_, material_, faults, draw, origin, rim[i], hits[i]).range;
      if (range == 0) continue;
      nearest = std::min(nearest, range);
      farthest = std::max(farthest, range);
    }
    if (!EdgeBetween(nearest, farthest)) return own;
    const double share = RandomUniform(seed, image.Index(column, row), kMix);
    return static_cast<float>(nearest + share * (farthest - nearest));
  };
  parallel.For(static_cast<size_t>(columns), [&](size_t index) {
    const int column = static_cast<int>(index);
    for (int row = 0; row < rows; ++row) {
      const size_t cell = image.Index(column, row);
      const Return& returned = returns[cell];
      if (returned.range == 0 || DropsOut(returned, faults, seed, cell)) continue;
      double range = returned.range;
      if (faults.beam_divergence > 0 && near_edge(column, row)) {
        range = mixed(column, row, returned.range);
      }
      if (faults.range_noise) range += scanner.RangeSigma(range) * RandomNormal(seed, cell, kNoise);
      if (range < scanner.range_min) {
        image.range[cell] = sensor::RangeImage::kNoInformation;
      } else if (range <= scanner.range_max) {
        image.range[cell] = static_cast<float>(range);
      }
    }
  });
  return image;
}

bool SimulatedScanner::Visible(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
  const std::array<Eigen::Vector3f, 1> from = {a.cast<float>()};
  return tracer_->VisibleFrom(b.cast<float>(), from, kLeaveSurface) != 0;
}

double SimulatedScanner::Clearance(const Eigen::Vector3d& point, double limit) const {
  return tracer_->Clearance(point, limit);
}

}  // namespace vantage::simulation
