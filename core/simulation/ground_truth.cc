#include "core/simulation/ground_truth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/simulation/random_sequence.h"

namespace vantage::simulation {
namespace {

constexpr uint64_t kSampleSeed = 20060301;
constexpr float kGap = 1e-3f;   // m kept from the surface when asking what lies between
constexpr size_t kChunk = 256;  // samples per parallel body

struct SurfaceSample {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;  // unit, either side
};

// The density at which an unobstructed scanner would measure a sample; 0 when it would not.
double PotentialDensity(const sensor::ScannerModel& scanner, const SurfaceSample& sample,
                        const Eigen::Vector3d& position) {
  const Eigen::Vector3d way = sample.point - position;
  const double range = way.norm();
  if (range < scanner.range_min || range > scanner.range_max) return 0;
  const double cosine = std::abs(sample.normal.dot(way)) / range;
  if (cosine < std::cos(scanner.max_incidence)) return 0;
  const double sine = std::clamp(way.z() / range, -1.0, 1.0);
  const double elevation = std::asin(sine);
  if (elevation < scanner.elevation_min || elevation > scanner.elevation_max) return 0;
  return scanner.SamplingDensityAtSine(sine, cosine, range);
}

}  // namespace

struct GroundTruth::State {
  const Tracer* tracer = nullptr;
  sensor::ScannerModel scanner;
  double required_density = 0;
  std::vector<SurfaceSample> samples;
  double area_per_sample = 0;
  std::vector<uint8_t> attainable;             // per sample
  std::vector<uint8_t> attainable_at_density;  // per sample
  std::vector<double> density;                 // per sample, of the best scan so far; 0: not seen

  // Calls body(begin, end) over chunks of samples.
  template <typename Body>
  void ForChunks(parallel::Parallel& parallel, const Body& body) const {
    parallel.For((samples.size() + kChunk - 1) / kChunk, [&](size_t chunk) {
      body(chunk * kChunk, std::min(samples.size(), (chunk + 1) * kChunk));
    });
  }

  bool Visible(const SurfaceSample& sample, const Eigen::Vector3d& position) const {
    const std::array<Eigen::Vector3f, 1> from = {position.cast<float>()};
    return tracer->VisibleFrom(sample.point.cast<float>(), from, kGap) != 0;
  }

  void FindAttainable(const std::vector<Eigen::Vector3d>& positions, parallel::Parallel& parallel);
};

// The positions are tried in any order, since the answer does not depend on it: first those from
// which neighbouring samples were seen, until one measures the sample at density.
void GroundTruth::State::FindAttainable(const std::vector<Eigen::Vector3d>& positions,
                                        parallel::Parallel& parallel) {
  ForChunks(parallel, [&](size_t begin, size_t end) {
    std::vector<size_t> order(positions.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::array<size_t, Tracer::kPacket> asked;  // places in `order`
    std::array<double, Tracer::kPacket> potential;
    std::array<Eigen::Vector3f, Tracer::kPacket> from;
    for (size_t i = begin; i < end; ++i) {
      const SurfaceSample& sample = samples[i];
      size_t count = 0;
      const auto ask = [&] {
        const uint32_t visible =
            tracer->VisibleFrom(sample.point.cast<float>(), std::span(from).first(count), kGap);
        for (size_t k = 0; k < count; ++k) {
          if ((visible >> k & 1) == 0) continue;
          attainable[i] = 1;
          if (potential[k] < required_density) continue;
          attainable_at_density[i] = 1;
          std::swap(order[asked[k]], order[0]);
          break;
        }
        count = 0;
      };
      for (size_t k = 0; k < order.size() && attainable_at_density[i] == 0; ++k) {
        const Eigen::Vector3d& position = positions[order[k]];
        const double density_there = PotentialDensity(scanner, sample, position);
        // Once it is seen, only a position that would measure it at density is worth a ray.
        if (density_there <= 0 || (attainable[i] != 0 && density_there < required_density))
          continue;
        asked[count] = k;
        potential[count] = density_there;
        from[count] = position.cast<float>();
        // The first ones are traced alone: most samples are decided by the positions from which
        // their neighbours were seen.
        if (++count == Tracer::kPacket || k == 0) ask();
      }
      if (count > 0 && attainable_at_density[i] == 0) ask();
    }
  });
}

GroundTruth::GroundTruth(const TriangleMesh& mesh, const SimulatedScanner& tracer,
                         const sensor::ScannerModel& scanner, double required_density,
                         const std::vector<Eigen::Vector3d>& positions, size_t samples,
                         parallel::Parallel& parallel)
    : state_(std::make_unique<State>()) {
  State& state = *state_;
  state.tracer = &tracer.tracer();
  state.scanner = scanner;
  state.required_density = required_density;
  std::vector<double> cumulative;  // area up to and including each triangle
  double total = 0;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    const bool measurable = i >= mesh.material.size() || (mesh.material[i] != Material::kGlass &&
                                                          mesh.material[i] != Material::kMirror);
    if (measurable) {
      const Eigen::Vector3d ab = (mesh.vertices[b] - mesh.vertices[a]).cast<double>();
      const Eigen::Vector3d ac = (mesh.vertices[c] - mesh.vertices[a]).cast<double>();
      total += 0.5 * ab.cross(ac).norm();
    }
    cumulative.push_back(total);
  }
  if (!(total > 0) || samples == 0) return;
  state.area_per_sample = total / static_cast<double>(samples);
  for (size_t i = 0; i < samples; ++i) {
    // Stratified: one sample in each equal share of the area.
    const double share =
        (static_cast<double>(i) + RandomUniform(kSampleSeed, i, 0)) / static_cast<double>(samples);
    const auto above = std::upper_bound(cumulative.begin(), cumulative.end(), share * total);
    const size_t triangle =
        std::min(static_cast<size_t>(above - cumulative.begin()), mesh.triangles.size() - 1);
    const auto& [ia, ib, ic] = mesh.triangles[triangle];
    const Eigen::Vector3d a = mesh.vertices[ia].cast<double>();
    const Eigen::Vector3d ab = mesh.vertices[ib].cast<double>() - a;
    const Eigen::Vector3d ac = mesh.vertices[ic].cast<double>() - a;
    double u = RandomUniform(kSampleSeed, i, 1);
    double v = RandomUniform(kSampleSeed, i, 2);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const Eigen::Vector3d normal = ab.cross(ac);
    if (!(normal.norm() > 0)) continue;
    state.samples.push_back({a + u * ab + v * ac, normal.normalized()});
  }
  state.attainable.assign(state.samples.size(), 0);
  state.attainable_at_density.assign(state.samples.size(), 0);
  state.density.assign(state.samples.size(), 0);
  state.FindAttainable(positions, parallel);
}

GroundTruth::~GroundTruth() = default;
GroundTruth::GroundTruth(const GroundTruth& other)
    : state_(std::make_unique<State>(*other.state_)) {}
GroundTruth::GroundTruth(GroundTruth&&) noexcept = default;
GroundTruth& GroundTruth::operator=(GroundTruth&&) noexcept = default;

void GroundTruth::AddScan(const Eigen::Vector3d& position, parallel::Parallel& parallel,
                          std::optional<double> heading) {
  State& state = *state_;
  const auto in_sector = [&](const Eigen::Vector3d& at) {
    if (!heading.has_value()) return true;
    const double azimuth = std::atan2(at.y() - position.y(), at.x() - position.x());
    return std::abs(std::remainder(azimuth - *heading, 2 * sensor::kPi)) <=
           state.scanner.azimuth_span / 2;
  };
  state.ForChunks(parallel, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const double there = PotentialDensity(state.scanner, state.samples[i], position);
      if (there <= state.density[i] || !in_sector(state.samples[i].point)) continue;
      if (!state.Visible(state.samples[i], position)) continue;
      state.density[i] = there;
    }
  });
}

TrueCoverage GroundTruth::Measure() const {
  const State& state = *state_;
  std::array<size_t, 5> counts{};
  double equivalent = 0;
  for (size_t i = 0; i < state.samples.size(); ++i) {
    if (state.attainable[i] == 0) continue;
    ++counts[0];
    counts[1] += state.attainable_at_density[i];
    counts[2] += state.density[i] > 0 ? 1 : 0;
    const bool at_density = state.density[i] >= state.required_density;
    counts[3] += at_density ? 1 : 0;
    counts[4] += at_density && state.attainable_at_density[i] != 0 ? 1 : 0;
    equivalent += std::min(state.density[i] / state.required_density, 1.0);
  }
  const auto area = [&](size_t count) {
    return static_cast<double>(count) * state.area_per_sample;
  };
  return {area(counts[0]), area(counts[1]), area(counts[2]),
          area(counts[3]), area(counts[4]), equivalent * state.area_per_sample};
}

std::vector<double> GroundTruth::GainAtDensity(const std::vector<Eigen::Vector3d>& positions,
                                               parallel::Parallel& parallel) const {
  const State& state = *state_;
  std::vector<double> gain(positions.size(), 0);
  parallel.For(positions.size(), [&](size_t p) {
    size_t newly = 0;
    for (size_t i = 0; i < state.samples.size(); ++i) {
      if (state.attainable[i] == 0 || state.density[i] >= state.required_density) continue;
      const double there = PotentialDensity(state.scanner, state.samples[i], positions[p]);
      if (there < state.required_density) continue;
      newly += state.Visible(state.samples[i], positions[p]) ? 1 : 0;
    }
    gain[p] = static_cast<double>(newly) * state.area_per_sample;
  });
  return gain;
}

std::vector<SampleSet> GroundTruth::MeasuredAtDensity(const std::vector<Eigen::Vector3d>& positions,
                                                      parallel::Parallel& parallel) const {
  const State& state = *state_;
  std::vector<SampleSet> sets(positions.size());
  parallel.For(positions.size(), [&](size_t p) {
    sets[p].assign((state.samples.size() + 63) / 64, 0);
    for (size_t i = 0; i < state.samples.size(); ++i) {
      if (state.attainable_at_density[i] == 0) continue;
      const double there = PotentialDensity(state.scanner, state.samples[i], positions[p]);
      if (there < state.required_density || !state.Visible(state.samples[i], positions[p]))
        continue;
      sets[p][i / 64] |= uint64_t{1} << (i % 64);
    }
  });
  return sets;
}

SampleSet GroundTruth::AtDensity() const {
  const State& state = *state_;
  SampleSet set((state.samples.size() + 63) / 64, 0);
  for (size_t i = 0; i < state.samples.size(); ++i) {
    if (state.attainable_at_density[i] == 0 || state.density[i] < state.required_density) continue;
    set[i / 64] |= uint64_t{1} << (i % 64);
  }
  return set;
}

double GroundTruth::area_per_sample() const { return state_->area_per_sample; }

}  // namespace vantage::simulation
