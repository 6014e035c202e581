// What the residuals of a job's own scans tell of the instrument, beyond its data sheet: by range
// and incidence, how far neighbouring samples lie off together, and how much they scatter
// (algorithm.md section 9, 'What the instrument shows').
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_INSTRUMENT_RESIDUALS_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_INSTRUMENT_RESIDUALS_H_

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace vantage::registration {

// Upper ends of the classes of range, m: doubling, from a small room to the reach of terrestrial
// scanners; the last has none.
inline constexpr std::array<double, 5> kRangeClassEnds = {2, 4, 8, 16, 32};
// Upper ends of the classes of incidence, degrees: about equal steps of the cosine; the last has
// none.
inline constexpr std::array<double, 3> kIncidenceClassEnds = {40, 60, 70};
inline constexpr size_t kResidualClasses =
    (kRangeClassEnds.size() + 1) * (kIncidenceClassEnds.size() + 1);
// By range, then by incidence. `range` in m.
size_t ResidualClass(double range, double cos_incidence);

// Residuals of one class, as sums over blocks of one correlation length and similar normals
// (CorrelationBlock()).
struct ClassResiduals {
  double blocks = 0;    // pieces of surface with enough samples
  double shared = 0;    // m^2, over the blocks: the mean residual squared, less what the scatter
                        // of its samples makes of it, times what blocks share with those around;
                        // may be negative
  double freedom = 0;   // degrees of freedom of the scatter
  double scatter = 0;   // m^2, squares of the residuals about their block's mean
  double expected = 0;  // m^2, what the data sheet explains of `scatter`

  bool operator==(const ClassResiduals&) const = default;
};
// Of one aligned scan against the model.
using PairResiduals = std::array<ClassResiduals, kResidualClasses>;

// A residual of an aligned scan.
struct ClassedResidual {
  Eigen::Vector3d position;  // m, in the frame of the site
  Eigen::Vector3d normal;    // unit, of the surface, in the same frame
  double range = 0;          // m, from the scanner
  double cos_incidence = 1;
  double residual = 0;  // m, along the normal
  double expected = 0;  // m^2, its variance by the data sheet
};
// Sums of residuals, in the order in which they come. A block belongs to the class of its samples'
// mean range and incidence. `correlation_length`: side of a block, m.
PairResiduals SumResiduals(std::span<const ClassedResidual> residuals, double correlation_length);

// What the instrument adds to its data sheet, as variances, m^2, by class.
struct InstrumentExcess {
  std::array<double, kResidualClasses> shared{};   // beyond correlated_sigma
  std::array<double, kResidualClasses> scatter{};  // of a residual, beyond its noise
  bool any = false;                                // some element is not 0
};

// The residuals of several scans together.
class InstrumentResiduals {
 public:
  // The same for any order of the scans, to the bit.
  static InstrumentResiduals Of(std::vector<PairResiduals> scans);

  void Add(const PairResiduals& scan);
  size_t scans() const { return scans_; }
  const PairResiduals& sums() const { return sums_; }
  bool empty() const { return scans_ == 0; }
  // What they show beyond the data sheet, whose part that averaging does not remove is
  // `correlated_sigma` (m). Of little surface less is believed than it shows: the data sheet counts
  // as kPriorBlocks blocks beside all, and what all classes show together as so many in each class.
  InstrumentExcess Excess(double correlated_sigma) const;

 private:
  size_t scans_ = 0;
  PairResiduals sums_{};
};

// The prior weight of the data sheet, and in each class that of what all classes show together,
// blocks: as many of half a metre are 10 m2 of surface, and tell a variance to a quarter. A scan of
// a furnished room has some 500, of which 93 % is believed; one that overlaps by a wall and its
// floor has 60.
inline constexpr double kPriorBlocks = 40;

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_INSTRUMENT_RESIDUALS_H_
