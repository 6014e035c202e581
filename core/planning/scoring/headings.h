// The headings that a scanner which sees a sector is planned for (algorithm.md section 8,
// 'Headings').
#ifndef VANTAGE_CORE_PLANNING_SCORING_HEADINGS_H_
#define VANTAGE_CORE_PLANNING_SCORING_HEADINGS_H_

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/planning/scoring/constraints.h"
#include "core/sensor/scanner_model.h"

namespace vantage::planning {

// Headings are the directions of the scanner's +x, rad, counter-clockwise from the model's +x; they
// lie evenly around. A scan with heading t sees the azimuths in [t - span / 2, t + span / 2). Their
// borders cut the circle into bins, so the sums of bins are exact for every heading. A scanner that
// turns all around has one heading and one bin.
class Headings {
 public:
  // `first` (rad) is one of them.
  explicit Headings(const sensor::ScannerModel& scanner, double first = 0);

  bool all_around() const { return size_ == 1; }
  size_t size() const { return size_; }
  // The angle of a heading, rad, in [first, first + 2 pi).
  double Angle(size_t heading) const { return first_ + static_cast<double>(heading) * step_; }
  // The angle between two neighbours, rad.
  double step() const { return step_; }

  size_t bins() const { return all_around() ? 1 : 2 * size_; }
  // The bin of a direction, given by its horizontal part in any unit of length.
  size_t BinOf(float x, float y) const;
  bool Sees(size_t heading, size_t bin) const;
  // Sets by_heading[i] to the sum of the bins that heading i sees. `by_bin` has bins() elements,
  // `by_heading` size() elements.
  void Sum(std::span<const double> by_bin, std::span<double> by_heading) const;
  // Adds `value` to each heading that may see any of the horizontal `offsets` (from view to
  // surface, m).
  void AddWhereSeen(const Eigen::AlignedBox2d& offsets, double value,
                    std::span<double> by_heading) const;

 private:
  void OrderBins();

  double first_;
  size_t size_ = 1;
  double step_ = 2 * sensor::kPi;
  double half_span_ = sensor::kPi;
  // The span is this many whole steps and a part of one, [0, 1). Bin 2 i is that part of the i-th
  // step, counted from the first heading's lower border, bin 2 i + 1 the rest of the step.
  size_t whole_ = 1;
  double part_ = 0;
  // Where bins begin, ascending, and which those are; in diamond angles, which take a division
  // where azimuths take an arc tangent. `near_` has, for each of equal parts of the turn, the last
  // of `begins_` that is not beyond its beginning.
  std::vector<float> begins_;
  std::vector<uint16_t> bins_;
  std::vector<uint16_t> near_;
};

// The heading with the largest value, of equal ones the first.
struct BestHeading {
  size_t heading = 0;
  double score = 0;
};
BestHeading BestOf(std::span<const double> by_heading);

// The part of space that a scan with one heading sees.
class Sector {
 public:
  // Without a heading (rad), or of a scanner that turns all around: everything.
  Sector(const sensor::ScannerModel& scanner, std::optional<double> heading);

  // `x`, `y`: the horizontal part of the direction from the view.
  bool Sees(float x, float y) const {
    return everything_ || headings_.Sees(heading_, headings_.BinOf(x, y));
  }
  bool everything() const { return everything_; }

 private:
  Headings headings_;
  size_t heading_ = 0;
  bool everything_;
};

// What each heading gains: the sum of the scores of the cells that it sees from `view` (m),
// samples.
std::vector<double> SumByHeading(const Headings& headings, const Eigen::Vector3d& view,
                                 const CellArrays& cells, std::span<const float> cell_scores);

// Sets the scores of the cells to 0 that the sector does not see from `view` (m). Returns the sum
// of the others, samples.
double KeepSector(const Sector& sector, const Eigen::Vector3d& view, const CellArrays& cells,
                  std::span<float> cell_scores);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_SCORING_HEADINGS_H_
