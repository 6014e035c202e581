#include "core/registration/align/instrument_residuals.h"

#include <algorithm>
#include <cmath>

#include "core/sensor/scanner_model.h"

namespace vantage::registration {
namespace {

// Samples: of fewer, neither the mean of a block nor their scatter says much.
constexpr double kFewestOfBlock = 4;
// Degrees of freedom that the alignment has taken from the blocks' means.
constexpr double kPoseFreedom = 6;
// Blocks: of less than so many more nothing is learned: 5 m2 of surface in all.
constexpr double kFewestBlocks = 20;

template <size_t kEnds>
size_t ClassOf(double value, const std::array<double, kEnds>& ends) {
  return static_cast<size_t>(std::upper_bound(ends.begin(), ends.end(), value) - ends.begin());
}

// What one class shows, drawn towards what all show.
double Drawn(double sum, double count, double overall) {
  return (sum + kPriorBlocks * overall) / (count + kPriorBlocks);
}

}  // namespace

size_t ResidualClass(double range, double cos_incidence) {
  const double incidence = sensor::Degrees(std::acos(std::clamp(cos_incidence, -1.0, 1.0)));
  return ClassOf(range, kRangeClassEnds) * (kIncidenceClassEnds.size() + 1) +
         ClassOf(incidence, kIncidenceClassEnds);
}

PairResiduals SumResiduals(std::span<const ClassedResidual> residuals) {
  struct Block {
    double count = 0;
    double range = 0;
    double cos_incidence = 0;
    double sum = 0;
    double squares = 0;
    double expected = 0;
  };
  std::vector<Block> blocks;
  for (const ClassedResidual& r : residuals) {
    if (r.block >= blocks.size()) blocks.resize(r.block + 1);
    Block& block = blocks[r.block];
    block.count += 1;
    block.range += r.range;
    block.cos_incidence += r.cos_incidence;
    block.sum += r.residual;
    block.squares += r.residual * r.residual;
    block.expected += r.expected;
  }
  PairResiduals pair{};
  double counted = 0;
  for (const Block& block : blocks) {
    if (block.count < kFewestOfBlock) continue;
    const double mean = block.sum / block.count;
    const double scatter = std::max(0.0, block.squares - block.count * mean * mean);
    const double freedom = block.count - 1;
    ClassResiduals& of =
        pair[ResidualClass(block.range / block.count, block.cos_incidence / block.count)];
    of.blocks += 1;
    of.shared += mean * mean - scatter / freedom / block.count;
    of.freedom += freedom;
    of.scatter += scatter;
    of.expected += block.expected * freedom / block.count;
    counted += 1;
  }
  if (counted < kFewestBlocks + kPoseFreedom) return PairResiduals{};
  for (ClassResiduals& of : pair) of.shared *= counted / (counted - kPoseFreedom);
  return pair;
}

InstrumentResiduals InstrumentResiduals::Of(std::vector<PairResiduals> scans) {
  const auto key = [](const PairResiduals& pair) {
    std::array<double, 5 * kResidualClasses> values{};
    size_t at = 0;
    for (const ClassResiduals& of : pair) {
      for (const double value : {of.blocks, of.shared, of.freedom, of.scatter, of.expected}) {
        values[at++] = value;
      }
    }
    return values;
  };
  std::sort(scans.begin(), scans.end(),
            [&](const PairResiduals& a, const PairResiduals& b) { return key(a) < key(b); });
  InstrumentResiduals all;
  for (const PairResiduals& pair : scans) all.Add(pair);
  return all;
}

void InstrumentResiduals::Add(const PairResiduals& scan) {
  const bool any =
      std::any_of(scan.begin(), scan.end(), [](const ClassResiduals& of) { return of.blocks > 0; });
  if (!any) return;
  ++scans_;
  for (size_t k = 0; k < kResidualClasses; ++k) {
    sums_[k].blocks += scan[k].blocks;
    sums_[k].shared += scan[k].shared;
    sums_[k].freedom += scan[k].freedom;
    sums_[k].scatter += scan[k].scatter;
    sums_[k].expected += scan[k].expected;
  }
}

InstrumentExcess InstrumentResiduals::Excess(double correlated_sigma) const {
  InstrumentExcess excess;
  if (empty()) return excess;
  const double sheet = correlated_sigma * correlated_sigma;
  ClassResiduals all;
  for (const ClassResiduals& of : sums_) {
    all.blocks += of.blocks;
    all.shared += of.shared;
    all.freedom += of.freedom;
    all.scatter += of.scatter;
    all.expected += of.expected;
  }
  const double believed = all.blocks / (all.blocks + kPriorBlocks);
  const double shared = all.shared / all.blocks - sheet;
  const double scatter = (all.scatter - all.expected) / all.freedom;
  for (size_t k = 0; k < kResidualClasses; ++k) {
    const ClassResiduals& of = sums_[k];
    excess.shared[k] =
        std::max(0.0, believed * Drawn(of.shared - of.blocks * sheet, of.blocks, shared));
    // A block's scatter counts as one figure, whatever its samples.
    const double per_block = of.blocks > 0 ? of.freedom / of.blocks : 1;
    excess.scatter[k] =
        std::max(0.0, believed * Drawn((of.scatter - of.expected) / per_block, of.blocks, scatter));
    excess.any = excess.any || excess.shared[k] > 0 || excess.scatter[k] > 0;
  }
  return excess;
}

}  // namespace vantage::registration
