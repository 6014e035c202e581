#include "core/registration/align/correlation_block.h"

#include <cmath>
#include <cstddef>

namespace vantage::registration {
namespace {

// Bits of a key: twenty for each axis, three for the side.
constexpr int kCellBits = 20;
constexpr uint64_t kCells = (uint64_t{1} << kCellBits) - 1;
constexpr int kSideBits = 3;
constexpr std::array<int, 3> kShifts = {2 * kCellBits + kSideBits, kCellBits + kSideBits,
                                        kSideBits};

}  // namespace

uint64_t CorrelationBlock(const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                          double correlation_length) {
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  auto key = static_cast<uint64_t>(2 * axis + (normal[axis] < 0 ? 1 : 0));
  for (size_t k = 0; k < 3; ++k) {
    const double cell = std::floor(position[static_cast<Eigen::Index>(k)] / correlation_length);
    key |= (static_cast<uint64_t>(static_cast<int64_t>(cell)) & kCells) << kShifts[k];
  }
  return key;
}

std::array<BlockBeside, 27> BlocksAround(uint64_t block) {
  std::array<BlockBeside, 27> around{};
  for (size_t i = 0; i < around.size(); ++i) {
    const std::array<size_t, 3> step = {i / 9, i / 3 % 3, i % 3};  // 1: the same cell
    BlockBeside& beside = around[i];
    beside.block = block & ((uint64_t{1} << kSideBits) - 1);
    for (size_t k = 0; k < 3; ++k) {
      const uint64_t cell = (block >> kShifts[k]) + step[k] - 1;
      beside.block |= (cell & kCells) << kShifts[k];
      if (step[k] != 1) beside.weight *= 0.5;
    }
  }
  return around;
}

double FactorOfSumsAround(double count, double around) {
  if (!(count > 0)) return 0;
  const double left = count - kPoseFreedom * around / count;
  if (!(left > 0.5 * count)) return 0;
  return (1 - std::sqrt(2 * around) / count) * count / left;
}

}  // namespace vantage::registration
