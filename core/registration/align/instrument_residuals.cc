#include "core/registration/align/instrument_residuals.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "core/registration/align/correlation_block.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {
namespace {

// Samples: of fewer, neither the mean of a block nor their scatter says much.
constexpr double kFewestOfBlock = 4;
// Blocks: of less than so many more nothing is learned: 5 m2 of surface in all.
constexpr double kFewestBlocks = 20;
// Side of the blocks that are looked at besides, over that of a block: with those around them they
// tell errors that are shared over up to four correlation lengths.
constexpr double kWideBlock = 2;
// Standard deviations: what white noise makes of the means of blocks is not shared, 97.7 %.
constexpr double kBeyondChance = 2;

template <size_t kEnds>
size_t ClassOf(double value, const std::array<double, kEnds>& ends) {
  return static_cast<size_t>(std::upper_bound(ends.begin(), ends.end(), value) - ends.begin());
}

// What one class shows, drawn towards what all show.
double Drawn(double sum, double count, double overall) {
  return (sum + kPriorBlocks * overall) / (count + kPriorBlocks);
}

// The residuals of one block.
struct BlockSums {
  double pieces = 0;  // of the side of a block that it consists of: 1 unless it is a wide one
  double count = 0;
  double range = 0;
  double cos_incidence = 0;
  double sum = 0;
  double squares = 0;
  double expected = 0;

  double Mean() const { return sum / count; }
  double Scatter() const { return std::max(0.0, squares - count * Mean() * Mean()); }
  // m^2, what the scatter makes of the mean.
  double VarianceOfMean() const { return Scatter() / (count - 1) / count; }
};

// What the means of blocks add up to, m^2, over pieces of surface of one block's side: each block
// by itself, and with those around it.
struct SharedMeans {
  double pieces = 0;
  double alone = 0;
  double together = 0;
  double around = 0;  // pieces that are met in this way, over all pieces
  double noise = 0;   // of `alone`, by chance: one sigma
};

// Parts of the surface with residuals enough, in the order in which these come.
class Blocks {
 public:
  // Each consists of pieces of side `piece`, m.
  Blocks(std::span<const ClassedResidual> residuals, double side, double piece) {
    std::vector<BlockSums> all;
    std::vector<uint64_t> keys;
    absl::flat_hash_map<uint64_t, size_t> at;
    absl::flat_hash_set<uint64_t> pieces;
    for (const ClassedResidual& r : residuals) {
      const uint64_t key = CorrelationBlock(r.position, r.normal, side);
      const auto [it, fresh] = at.try_emplace(key, all.size());
      if (fresh) {
        all.emplace_back();
        keys.push_back(key);
      }
      BlockSums& block = all[it->second];
      if (pieces.insert(CorrelationBlock(r.position, r.normal, piece)).second) block.pieces += 1;
      block.count += 1;
      block.range += r.range;
      block.cos_incidence += r.cos_incidence;
      block.sum += r.residual;
      block.squares += r.residual * r.residual;
      block.expected += r.expected;
    }
    for (size_t i = 0; i < all.size(); ++i) {
      if (all[i].count < kFewestOfBlock) continue;
      index_.emplace(keys[i], counted_.size());
      keys_.push_back(keys[i]);
      counted_.push_back(all[i]);
    }
  }

  const std::vector<BlockSums>& counted() const { return counted_; }

  SharedMeans Shared() const {
    SharedMeans shared;
    for (size_t i = 0; i < counted_.size(); ++i) {
      const double pieces = counted_[i].pieces;
      const double sum = pieces * counted_[i].Mean();
      const double noise = pieces * pieces * counted_[i].VarianceOfMean();
      double sum_around = 0;
      for (const BlockBeside& beside : BlocksAround(keys_[i])) {
        const auto it = index_.find(beside.block);
        if (it == index_.end()) continue;
        const BlockSums& other = counted_[it->second];
        sum_around += beside.weight * other.pieces * other.Mean();
        shared.around += beside.weight * pieces * other.pieces;
      }
      shared.pieces += pieces;
      shared.alone += sum * sum - noise;
      shared.together += sum * sum_around - noise;
      shared.noise += 2 * noise * noise;
    }
    shared.noise = std::sqrt(shared.noise);
    return shared;
  }

 private:
  std::vector<BlockSums> counted_;
  std::vector<uint64_t> keys_;
  absl::flat_hash_map<uint64_t, size_t> index_;
};

// What blocks and those around them share, m^2 for each piece of surface.
double Together(const SharedMeans& shared) {
  if (!(shared.pieces > 0)) return 0;
  return FactorOfSumsAround(shared.pieces, shared.around) * shared.together / shared.pieces;
}

// Means of blocks that hang together over more than a block add up to more than their squares say:
// over a large surface, by the area over which the errors are shared, over that of a block. 1 where
// nothing shows that. `wide`: of larger blocks, of the same pieces.
double TogetherOverAlone(const Blocks& blocks, const Blocks& wide) {
  const SharedMeans shared = blocks.Shared();
  if (shared.alone <= kBeyondChance * shared.noise) return 1;
  const double alone = shared.alone / (shared.pieces - kPoseFreedom);
  const double together = std::max(Together(shared), Together(wide.Shared()));
  return std::max(1.0, together / alone);
}

}  // namespace

size_t ResidualClass(double range, double cos_incidence) {
  const double incidence = sensor::Degrees(std::acos(std::clamp(cos_incidence, -1.0, 1.0)));
  return ClassOf(range, kRangeClassEnds) * (kIncidenceClassEnds.size() + 1) +
         ClassOf(incidence, kIncidenceClassEnds);
}

PairResiduals SumResiduals(std::span<const ClassedResidual> residuals, double correlation_length) {
  const Blocks blocks(residuals, correlation_length, correlation_length);
  const double counted = static_cast<double>(blocks.counted().size());
  if (counted < kFewestBlocks + kPoseFreedom) return PairResiduals{};
  PairResiduals pair{};
  for (const BlockSums& block : blocks.counted()) {
    ClassResiduals& of =
        pair[ResidualClass(block.range / block.count, block.cos_incidence / block.count)];
    of.blocks += 1;
    of.shared += block.Mean() * block.Mean() - block.VarianceOfMean();
    of.freedom += block.count - 1;
    of.scatter += block.Scatter();
    of.expected += block.expected * (block.count - 1) / block.count;
  }
  const double hangs_together = TogetherOverAlone(
      blocks, Blocks(residuals, kWideBlock * correlation_length, correlation_length));
  for (ClassResiduals& of : pair) {
    of.shared *= hangs_together * counted / (counted - kPoseFreedom);
  }
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
