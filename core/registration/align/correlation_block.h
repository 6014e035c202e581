// The pieces of surface over which a scanner's errors hang together (algorithm.md section 9, 'How
// far off it may be').
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_CORRELATION_BLOCK_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_CORRELATION_BLOCK_H_

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace vantage::registration {

// The block of correlated residuals that a point belongs to: a cell of one correlation length (m)
// and similar normals. Sites wrap after a million cells.
uint64_t CorrelationBlock(const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                          double correlation_length);

// A block and the 26 around it with normals like its own, and what each counts when errors that are
// shared across borders are added up: half for each axis along which it lies beside the first
// (Bartlett's kernel, with which such sums are covariances).
struct BlockBeside {
  uint64_t block = 0;
  double weight = 1;
};
std::array<BlockBeside, 27> BlocksAround(uint64_t block);

// Degrees of freedom that an alignment has taken out of residuals.
inline constexpr double kPoseFreedom = 6;

// What a sum over `count` blocks, each with those around it, has to be multiplied by. `around`:
// what the blocks count that are met in this way, in all. An alignment has taken six modes out of
// the residuals, each of which spans all of what is added up with a block; that is made up for, and
// one sigma of chance is taken off. 0 where more than half would be made up for, as in a single
// small room: nothing is to be believed of that sum.
double FactorOfSumsAround(double count, double around);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_CORRELATION_BLOCK_H_
