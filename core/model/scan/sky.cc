#include "core/model/scan/sky.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

namespace vantage::model {
namespace {

using Eigen::Vector3d;

// The energy that comes back falls with reflectivity and with the square of the range. Data sheets
// state ranges for a fifth of the light; building materials hardly go below a twentieth (black
// paint, tar). Four times darker is seen half as far.
constexpr double kDarkestRangeShare = 0.5;

// Around a cell that is sky no return is seen this far, but for stray ones: birds, insects, rain.
// Dark and grazing surfaces drop out in part, and what they return lies closer together.
constexpr double kPureRadius = sensor::Radians(1.5);
// Cells to all sides, at least: of 49, where one in seven returns, none does so in one of 2000
// places; of 25 it would be one of 50.
constexpr int kLeastPureCells = 3;
constexpr double kMostStray = 0.03;  // of the cells

// Something is there where cells on top of each other return over so large an angle, or that many
// of them where it is coarser: a bird and a wire do not, nor does noise, of which three in a row
// are one in 40,000 where kMostStray returns at most.
constexpr double kLeastRun = sensor::Radians(0.75);
constexpr int kLeastRunCells = 3;

// The sky covers most of the highest directions that the scanner sees. What returns anything at all
// does so overhead, where it is nearest and met head on; and no window is overhead.
constexpr double kOverhead = sensor::Radians(10);  // from the highest direction down
constexpr double kLeastOverhead = 0.5;             // share of that
constexpr double kLooksUp = sensor::Radians(40);  // a scanner that does not look as high can't tell
// A room that is closed all around and whose ceiling returns nothing looks like a yard. It is taken
// for a room if almost all around it is bounded no higher than this over the scanner, m: rooms in
// which that much of a ceiling is black or glass are no higher (five metres from the floor).
constexpr double kRoomHeight = 3.5;
constexpr double kLeastHeight = 0.3;    // m over the scanner: no ceiling is lower
constexpr double kMostRoomLike = 0.75;  // share of all directions in the horizontal

// Sine: a direction that is parallel to a surface up to this may meet it, by what is not level
// about it (1 degree).
constexpr double kRelief = 0.02;
// A surface that goes on fades out. kFading: in each quadrant around a cell at the sky's border at
// least this share of the rays does not return; or (kEndOfRange) the cell lies beyond this share of
// the range. Else the surface breaks off.
constexpr double kFading = 0.15;
constexpr double kEndOfRange = 0.8;
// A surface that fades ends all the same where it would have been measured beyond its border. What
// comes back is proportional to the cosine of the incidence over the range squared. Either that
// suffices for the darkest building material (kDarkestRangeShare); or it suffices for one that
// returns a fifth, and most of the last part of the surface came back (kLastReturned): a surface
// that fades does so over a fifth of its range at least, since no ground is all alike. That part is
// the cells below the last one that came back, within a tenth of its elevation (kLastPart), in the
// columns within 5 degrees (kLastAround).
constexpr double kLastReturned = 0.6;
constexpr double kLastPart = 0.1;
constexpr int kLeastLastRows = 2;  // or rows are too far apart to tell
constexpr double kLastAround = sensor::Radians(5);
// A surface also ends if elsewhere in the scan surface was measured that was met at least as
// grazingly and returned at most a quarter as much; building materials differ by as much. At least
// kFewestFainter cells have to: a sill or a shelf is no evidence.
constexpr double kFainter = 4;
constexpr double kStillReturns = 0.3;      // share of the cells around: no sky is as full
constexpr double kFewestFainter = 1.9e-3;  // sr: 2.5 degrees wide and high, half a metre at 12 m
// rad between the columns, and the rows, that are looked at for it; and how many of those there
// have to be, which is more than that where cells are coarse.
constexpr double kFaintStep = sensor::Radians(0.75);
constexpr int64_t kFewestLookedAt = 12;
// Samples of two surfaces may seem to lie in a plane that the scanner looks along. So this share of
// the columns around has to agree.
constexpr double kLeastFadingAround = 0.25;
// Of two surfaces one may be the continuation of the other: cosine, 26 degrees between them; and
// share of the greater distance from the scanner, half of it.
constexpr double kSameNormal = 0.9;
constexpr double kSameDistance = 0.5;
constexpr double kInLine = 0.05;      // of a chord: samples of one surface are in line by that
constexpr double kLeastTripod = 0.3;  // m over the ground
// What is seen so far below the horizon is the ground on which the scanner stands: from a tripod
// of 1.5 m, within 2.6 m of it. And rad between the columns that are looked at: 10 cm there.
constexpr double kStandsOn = sensor::Radians(30);
constexpr double kStandsOnStep = sensor::Radians(2);
// Ground faces up within 30 degrees, as floor does.
constexpr double kLeastGroundUp = 0.866;

class SkyFinder {
 public:
  SkyFinder(const RangeSurface& surface, const sensor::ScannerModel& scanner, const Vector3d& up)
      : surface_(surface),
        scanner_(scanner),
        up_(up),
        columns_(surface.columns()),
        rows_(surface.rows()),
        row_radius_(std::max(kLeastPureCells, static_cast<int>(std::lround(
                                                  kPureRadius / surface.elevation().mean_step())))),
        least_run_(std::max(kLeastRunCells, CellsIn(kLeastRun, surface.elevation()))),
        faint_columns_(CellsIn(kFaintStep, surface.azimuth())),
        faint_rows_(CellsIn(kFaintStep, surface.elevation())) {}

  std::vector<SkyRay> Find() {
    if (!LooksOpenOverhead()) return {};
    FindSkyline();
    if (LooksLikeRoom()) return {};
    CountCells();
    GrowFromOverhead();
    FindFaintReturns();
    BoundBySurfacesThatGoOn();
    return Rays();
  }

 private:
  enum State : uint8_t { kOther = 0, kSkyCell = 1 };

  // How many make an angle (rad), at least one.
  static int CellsIn(double angle, const AngularAxis& axis) {
    return std::max(1, static_cast<int>(std::lround(angle / axis.mean_step())));
  }

  size_t Index(int column, int row) const {
    return static_cast<size_t>(column) * static_cast<size_t>(rows_) + static_cast<size_t>(row);
  }
  bool NoReturn(int column, int row) const {
    return surface_.at(column, row) == sensor::RangeImage::kNoReturn;
  }
  bool HasRange(int column, int row) const {
    return sensor::RangeImage::IsRange(surface_.at(column, row));
  }
  Vector3d PointAt(int column, int row) const {
    return static_cast<double>(surface_.at(column, row)) * surface_.Direction(column, row);
  }
  // -1 where there is none.
  int Beside(int column, int step) const {
    const int c = column + step;
    if (surface_.azimuth().closed()) return (c % columns_ + columns_) % columns_;
    return c >= 0 && c < columns_ ? c : -1;
  }

  // The cells around the highest direction that the scan has.
  template <typename Fn>
  void ForEachOverhead(Fn&& fn) const {
    const double tilt = std::acos(std::clamp(up_.z(), -1.0, 1.0));
    const double highest = std::min(surface_.elevation().last() + tilt, sensor::kPi / 2);
    const double least = std::sin(highest - kOverhead);
    for (int r = rows_ - 1; r >= 0; --r) {
      if (surface_.elevation().angles()[static_cast<size_t>(r)] < highest - kOverhead - tilt) break;
      for (int c = 0; c < columns_; ++c) {
        if (surface_.Direction(c, r).dot(up_) >= least) fn(c, r);
      }
    }
  }

  bool LooksOpenOverhead() const {
    if (surface_.elevation().last() < kLooksUp) return false;
    double open = 0;
    double all = 0;
    ForEachOverhead([&](int c, int r) {
      const double solid_angle = surface_.cos_elevation()[static_cast<size_t>(r)];
      open += NoReturn(c, r) ? solid_angle : 0;
      all += NoReturn(c, r) || HasRange(c, r) ? solid_angle : 0;
    });
    return all > 0 && open >= kLeastOverhead * all;
  }

  // The row of the highest thing in each column; -1 where there is none.
  void FindSkyline() {
    skyline_.assign(static_cast<size_t>(columns_), -1);
    for (int c = 0; c < columns_; ++c) {
      int run = 0;  // of returns
      for (int r = rows_ - 1; r >= 0; --r) {
        run = surface_.Returned(c, r) ? run + 1 : 0;
        if (run < least_run_) continue;
        skyline_[static_cast<size_t>(c)] = r + least_run_ - 1;
        break;
      }
    }
  }

  // True when it is as high as ceilings are in almost every column.
  bool LooksLikeRoom() const {
    int room_like = 0;
    for (int c = 0; c < columns_; ++c) {
      const int row = skyline_[static_cast<size_t>(c)];
      room_like += row >= 0 && IsCeilingHigh(c, row) ? 1 : 0;
    }
    return room_like > kMostRoomLike * columns_;
  }

  bool IsCeilingHigh(int column, int row) const {
    const Vector3d top = PointAt(column, row);
    const double height = top.dot(up_);
    if (height < kLeastHeight || height > kRoomHeight) return false;
    // Ground that rises goes away from the scanner as it does so; a wall or a ceiling does not.
    for (int below = std::max(0, row - row_radius_); below < row; ++below) {
      if (!surface_.Returned(column, below)) continue;
      const Vector3d foot = PointAt(column, below);
      const auto aside = [&](const Vector3d& p) { return (p - p.dot(up_) * up_).norm(); };
      const double rise = height - foot.dot(up_);
      return !(aside(top) - aside(foot) >= std::abs(rise));
    }
    return true;
  }

  // Sums of cells from the first column and row on, so that those in any part of the image take
  // four look-ups.
  void CountCells() {
    const auto width = static_cast<size_t>(rows_) + 1;
    sums_.assign((static_cast<size_t>(columns_) + 1) * width, {0, 0});
    for (int c = 0; c < columns_; ++c) {
      std::array<int32_t, 2> column{0, 0};
      for (int r = 0; r < rows_; ++r) {
        column[0] += NoReturn(c, r) ? 1 : 0;
        column[1] += HasRange(c, r) ? 1 : 0;
        const size_t at = (static_cast<size_t>(c) + 1) * width + static_cast<size_t>(r) + 1;
        for (size_t k = 0; k < 2; ++k) sums_[at][k] = sums_[at - width][k] + column[k];
      }
    }
  }
  std::array<int32_t, 2> CountIn(int first_column, int last_column, int first_row,
                                 int last_row) const {
    const auto width = static_cast<size_t>(rows_) + 1;
    const auto at = [&](int c, int r) -> const std::array<int32_t, 2>& {
      return sums_[static_cast<size_t>(c) * width + static_cast<size_t>(r)];
    };
    std::array<int32_t, 2> count{};
    for (size_t k = 0; k < 2; ++k) {
      count[k] = at(last_column + 1, last_row + 1)[k] - at(first_column, last_row + 1)[k] -
                 at(last_column + 1, first_row)[k] + at(first_column, first_row)[k];
    }
    return count;
  }

  // Calls fn(first column, last column, first row, last row) for the parts (two where it wraps) of
  // the image within kPureRadius of a cell.
  template <typename Fn>
  void ForEachPartAround(int column, int row, Fn&& fn) const {
    const double across = surface_.azimuth().mean_step() *
                          std::max(surface_.cos_elevation()[static_cast<size_t>(row)], 1e-3);
    const int radius = static_cast<int>(std::clamp<double>(
        std::round(kPureRadius / across), kLeastPureCells, std::max(1.0, (columns_ - 1) / 2.0)));
    const int low = std::max(0, row - row_radius_);
    const int high = std::min(rows_ - 1, row + row_radius_);
    const int first = column - radius;
    const int last = column + radius;
    fn(std::max(0, first), std::min(columns_ - 1, last), low, high);
    if (!surface_.azimuth().closed()) return;
    if (first < 0) fn(first + columns_, columns_ - 1, low, high);
    if (last >= columns_) fn(0, last - columns_, low, high);
  }

  bool Pure(int column, int row) const {
    if (!NoReturn(column, row)) return false;
    std::array<int32_t, 2> count{};
    ForEachPartAround(column, row, [&](int first, int last, int low, int high) {
      const std::array<int32_t, 2> part = CountIn(first, last, low, high);
      for (size_t k = 0; k < 2; ++k) count[k] += part[k];
    });
    return count[1] <= kMostStray * (count[0] + count[1]);
  }

  // Everything above the skyline that is pure and hangs together with what is overhead, and the rim
  // of it.
  void GrowFromOverhead() {
    state_.assign(static_cast<size_t>(columns_) * static_cast<size_t>(rows_), kOther);
    std::vector<std::pair<int, int>> front;
    const auto take = [&](int c, int r) {
      state_[Index(c, r)] = kSkyCell;
      front.emplace_back(c, r);
    };
    ForEachOverhead([&](int c, int r) {
      if (r > skyline_[static_cast<size_t>(c)] && Pure(c, r)) take(c, r);
    });
    const auto grow = [&](size_t begin, size_t end, auto&& belongs) {
      for (size_t i = begin; i < end; ++i) {
        const auto [c, r] = front[i];
        for (const auto& [dc, dr] : kFaces) {
          const int beside = Beside(c, dc);
          if (beside < 0 || r + dr < 0 || r + dr >= rows_) continue;
          if (r + dr <= skyline_[static_cast<size_t>(beside)]) continue;
          if (state_[Index(beside, r + dr)] != kOther || !belongs(beside, r + dr)) continue;
          take(beside, r + dr);
        }
      }
    };
    size_t begin = 0;
    while (begin < front.size()) {
      const size_t end = front.size();
      grow(begin, end, [&](int c, int r) { return Pure(c, r); });
      begin = end;
    }
    TakeRim();
  }

  // The cells without return around which there is sky: what kept them from being pure is beside
  // it.
  void TakeRim() {
    std::vector<int32_t> sky((static_cast<size_t>(columns_) + 1) *
                             (static_cast<size_t>(rows_) + 1));
    const auto width = static_cast<size_t>(rows_) + 1;
    for (int c = 0; c < columns_; ++c) {
      int32_t column = 0;
      for (int r = 0; r < rows_; ++r) {
        column += state_[Index(c, r)] == kSkyCell ? 1 : 0;
        const size_t at = (static_cast<size_t>(c) + 1) * width + static_cast<size_t>(r) + 1;
        sky[at] = sky[at - width] + column;
      }
    }
    for (int c = 0; c < columns_; ++c) {
      for (int r = skyline_[static_cast<size_t>(c)] + 1; r < rows_; ++r) {
        if (state_[Index(c, r)] != kOther || !NoReturn(c, r)) continue;
        int32_t count = 0;
        ForEachPartAround(c, r, [&](int first, int last, int low, int high) {
          const auto at = [&](int column, int row) {
            return sky[static_cast<size_t>(column) * width + static_cast<size_t>(row)];
          };
          count +=
              at(last + 1, high + 1) - at(first, high + 1) - at(last + 1, low) + at(first, low);
        });
        if (count > 0) state_[Index(c, r)] = kSkyCell;
      }
    }
  }

  struct Plane {
    Vector3d normal;      // unit, towards the scanner
    double distance = 0;  // m
  };

  // True when the surface that a cell returned from does not break off beside it.
  bool FadesOut(int column, int row) const {
    if (surface_.at(column, row) > kEndOfRange * scanner_.range_max) return true;
    const int k = row_radius_;
    const auto fades = [&](int first_column, int last_column, int first_row, int last_row) {
      const std::array<int32_t, 2> count =
          CountIn(std::max(0, first_column), std::min(columns_ - 1, last_column),
                  std::max(0, first_row), std::min(rows_ - 1, last_row));
      return count[0] >= kFading * (count[0] + count[1]);
    };
    return fades(column - k, column, row - k, row) && fades(column, column + k, row - k, row) &&
           fades(column - k, column, row, row + k) && fades(column, column + k, row, row + k);
  }

  // True when one of two surfaces may be the continuation of the other.
  static bool MayBeOne(const Plane& a, const Plane& b) {
    return a.normal.dot(b.normal) >= kSameNormal &&
           std::abs(a.distance - b.distance) <= kSameDistance * std::max(a.distance, b.distance);
  }

  // How many cells returned that met their surface at a cosine of at most `cosine` and with an
  // energy of at most `energy` (1 / m^2), of surface that came back in good part.
  class FaintReturns {
   public:
    void Add(double cosine, double energy) { ++counts_[Bin(cosine)][Bin(energy)]; }
    void Sum() {
      for (size_t i = 0; i < kBins; ++i) {
        for (size_t k = 0; k < kBins; ++k) {
          if (i > 0) counts_[i][k] += counts_[i - 1][k];
          if (k > 0) counts_[i][k] += counts_[i][k - 1];
          if (i > 0 && k > 0) counts_[i][k] -= counts_[i - 1][k - 1];
        }
      }
    }
    // Of those whose bins lie below.
    int64_t Below(double cosine, double energy) const {
      const size_t i = Bin(cosine);
      const size_t k = Bin(energy);
      return i > 0 && k > 0 ? counts_[i - 1][k - 1] : 0;
    }

   private:
    static constexpr size_t kBins = 128;
    static constexpr double kBinsPerOctave = 5;  // 15 %; from 1 down to 2^-25
    static size_t Bin(double value) {
      const double bin = kBins - 1 + kBinsPerOctave * std::log2(std::max(value, 1e-12));
      return static_cast<size_t>(std::clamp(bin, 0.0, static_cast<double>(kBins - 1)));
    }
    std::array<std::array<int64_t, kBins>, kBins> counts_{};
  };

  double ReturnedShareAround(int column, int row) const {
    std::array<int32_t, 2> count{};
    ForEachPartAround(column, row, [&](int first, int last, int low, int high) {
      const std::array<int32_t, 2> part = CountIn(first, last, low, high);
      for (size_t k = 0; k < 2; ++k) count[k] += part[k];
    });
    const int32_t all = count[0] + count[1];
    return all > 0 ? static_cast<double>(count[1]) / all : 0;
  }

  static double EnergyOf(double cosine, double range) { return cosine / (range * range); }

  void FindFaintReturns() {
    for (int c = 0; c < columns_; c += faint_columns_) {
      for (int r = 0; r < rows_; r += faint_rows_) {
        if (!surface_.Returned(c, r)) continue;
        const std::optional<Plane> plane = SurfaceAt(c, r);
        if (!plane || ReturnedShareAround(c, r) < kStillReturns) continue;
        const double cosine = CosineAt(c, r, *plane);
        if (!Grazed(cosine)) continue;
        faint_.Add(cosine, EnergyOf(cosine, static_cast<double>(surface_.at(c, r))));
      }
    }
    faint_.Sum();
  }

  // True when the surface at a cell would have been measured beyond it, too, if it went on there.
  bool BreaksOff(int column, int row, const Plane& plane) const {
    const double cosine = CosineAt(column, row, plane);
    if (!Grazed(cosine)) return true;
    const double energy = EnergyOf(cosine, static_cast<double>(surface_.at(column, row)));
    const double darkest = EnergyOf(1, kDarkestRangeShare * scanner_.range_max);
    const double fifth = EnergyOf(1, scanner_.range_max);
    // Of what came back fainter: how many cells were looked at, and for how much each stands, sr,
    // near the horizon, where what is met grazingly lies.
    const int64_t fainter = faint_.Below(cosine, energy / kFainter);
    const double stands_for = faint_columns_ * surface_.azimuth().mean_step() * faint_rows_ *
                              surface_.elevation().mean_step();
    return energy >= darkest || (energy >= fifth && LastReturned(column, row) >= kLastReturned) ||
           (fainter >= kFewestLookedAt &&
            static_cast<double>(fainter) * stands_for >= kFewestFainter);
  }

  // Of the cells right below the last ones that returned, in the columns around: the share that
  // did. 0 where rows are too far apart to tell.
  double LastReturned(int column, int row) const {
    const double below = -surface_.elevation().angles()[static_cast<size_t>(row)];
    const int rows = static_cast<int>(kLastPart * below / surface_.elevation().mean_step());
    if (rows < kLeastLastRows) return 0;
    const int around = static_cast<int>(kLastAround / surface_.azimuth().mean_step());
    int all = 0;
    int returned = 0;
    for (int k = -around; k <= around; ++k) {
      const int c = Beside(column, k);
      if (c < 0) continue;
      // Its last row is about as high as this one, or it is of another border.
      int last = std::min(row + 2 * rows, rows_ - 1);
      while (last > row - 2 * rows && last > 0 && !surface_.Returned(c, last)) --last;
      for (int r = last - rows; r < last && r >= 0; ++r) {
        ++all;
        returned += surface_.Returned(c, r) ? 1 : 0;
      }
    }
    return all > 0 ? static_cast<double>(returned) / all : 0;
  }

  // True when a ray meets the surface beyond the maximum incidence.
  bool Grazed(double cosine) const { return cosine <= std::cos(scanner_.max_incidence); }
  double CosineAt(int column, int row, const Plane& plane) const {
    return plane.distance / static_cast<double>(surface_.at(column, row));
  }

  // The surface around a cell that returned.
  std::optional<Plane> SurfaceAt(int column, int row) const {
    const Vector3d here = PointAt(column, row);
    const auto find = [&](int dc, int dr) -> std::optional<Vector3d> {
      std::optional<Vector3d> near;
      std::optional<Vector3d> far;
      for (int k = 1; k <= row_radius_; ++k) {
        const int c = Beside(column, k * dc);
        const int r = row + k * dr;
        if (c < 0 || r < 0 || r >= rows_ || !surface_.Returned(c, r)) continue;
        (near ? far : near) = PointAt(c, r);
      }
      if (!far) return std::nullopt;
      // In line with each other, or they are of several surfaces.
      const Vector3d line = (*far - here).normalized();
      const Vector3d between = *near - here;
      const double off = (between - between.dot(line) * line).norm();
      if (off > kInLine * (*far - here).norm()) return std::nullopt;
      return far;
    };
    std::optional<Vector3d> along = find(0, -1);
    if (!along) along = find(0, 1);
    std::optional<Vector3d> across = find(1, 0);
    if (!across) across = find(-1, 0);
    if (!along || !across) return std::nullopt;
    Vector3d normal = (*along - here).cross(*across - here);
    if (!(normal.norm() > 1e-9)) return std::nullopt;
    normal.normalize();
    if (normal.dot(here) > 0) normal = -normal;
    return Plane{normal, -normal.dot(here)};
  }

  struct Grazing {
    int column;
    int row;
    uint32_t plane;
  };

  // True when the same surface fades out in enough of the columns around. Samples of two surfaces
  // may seem to lie in a plane that the scanner looks along. `fading`: by column.
  bool FadesAround(const Grazing& at, const std::vector<Grazing>& fading,
                   const std::vector<Plane>& planes) const {
    const int around = std::max(1, static_cast<int>(kLastAround / surface_.azimuth().mean_step()));
    int agree = 0;
    for (int k = -around; k <= around; ++k) {
      const int c = Beside(at.column, k);
      if (c < 0) continue;
      const auto first =
          std::lower_bound(fading.begin(), fading.end(), c,
                           [](const Grazing& g, int column) { return g.column < column; });
      bool same = false;
      for (auto it = first; it != fading.end() && it->column == c && !same; ++it) {
        same = MayBeOne(planes[it->plane], planes[at.plane]);
      }
      agree += same ? 1 : 0;
    }
    return agree >= kLeastFadingAround * (2 * around + 1);
  }

  // From the border of the sky inwards: a surface that was last measured at a grazing angle may go
  // on for as long as rays would meet it at one, and no such ray need come back.
  void BoundBySurfacesThatGoOn() {
    bound_.assign(state_.size(), std::numeric_limits<float>::infinity());
    std::vector<Plane> planes;
    std::vector<double> least_grazing;  // by plane, cosine
    std::vector<Grazing> front;
    std::vector<uint8_t> met(state_.size());
    ended_.assign(static_cast<size_t>(columns_), std::nullopt);
    const auto look_beside = [&](int column, int row, uint32_t plane) {
      for (const auto& [dc, dr] : kFaces) {
        const int c = Beside(column, dc);
        const int r = row + dr;
        if (c < 0 || r < 0 || r >= rows_) continue;
        const size_t at = Index(c, r);
        if (state_[at] != kSkyCell || met[at] != 0) continue;
        const std::optional<Plane>& end = ended_[static_cast<size_t>(c)];
        if (end && MayBeOne(*end, planes[plane])) continue;
        const double facing = -planes[plane].normal.dot(surface_.Direction(c, r));
        // Where a ray met it less grazingly than at its border it would have been measured.
        if (facing > least_grazing[plane] + kRelief || facing <= -kRelief) continue;
        met[at] = 1;
        bound_[at] = static_cast<float>(planes[plane].distance / (std::max(facing, 0.0) + kRelief));
        front.push_back({c, r, plane});
      }
    };
    std::vector<Grazing> fading;
    for (int c = 0; c < columns_; ++c) {
      for (int r = 0; r < rows_; ++r) {
        if (!surface_.Returned(c, r) || !BesideSky(c, r)) continue;
        const std::optional<Plane> plane = SurfaceAt(c, r);
        if (!plane) continue;
        if (BreaksOff(c, r, *plane)) {
          ended_[static_cast<size_t>(c)] = plane;
        } else if (FadesOut(c, r)) {
          fading.push_back({c, r, static_cast<uint32_t>(planes.size())});
          planes.push_back(*plane);
          least_grazing.push_back(CosineAt(c, r, *plane));
        }
      }
    }
    for (const Grazing& at : fading) {
      if (FadesAround(at, fading, planes)) look_beside(at.column, at.row, at.plane);
    }
    for (size_t i = 0; i < front.size(); ++i) {
      const Grazing at = front[i];
      look_beside(at.column, at.row, at.plane);
    }
  }

  bool BesideSky(int column, int row) const {
    return std::any_of(kFaces.begin(), kFaces.end(), [&](const auto& step) {
      const int c = Beside(column, step.first);
      const int r = row + step.second;
      return c >= 0 && r >= 0 && r < rows_ && state_[Index(c, r)] == kSkyCell;
    });
  }

  // Of the scanner over what it sees below, m.
  double HeightOverGround() const {
    const int every = CellsIn(kStandsOnStep, surface_.azimuth());
    std::vector<double> depth;
    for (int r = 0; r < rows_; ++r) {
      if (surface_.elevation().angles()[static_cast<size_t>(r)] > -kStandsOn) break;
      for (int c = 0; c < columns_; c += every) {
        if (surface_.Returned(c, r)) depth.push_back(-PointAt(c, r).dot(up_));
      }
    }
    if (depth.empty()) return kLeastTripod;
    const auto median = depth.begin() + static_cast<std::ptrdiff_t>(depth.size() / 2);
    std::nth_element(depth.begin(), median, depth.end());
    return std::max(*median, kLeastTripod);
  }

  // By column, the ground that breaks off there, or in the nearest column within kLastAround that
  // tells: of a few samples at an edge some have no plane.
  std::vector<std::optional<Plane>> GroundThatEnds() const {
    const int around = std::max(1, static_cast<int>(kLastAround / surface_.azimuth().mean_step()));
    std::vector<std::optional<Plane>> ground(static_cast<size_t>(columns_));
    for (int c = 0; c < columns_; ++c) {
      for (int k = 0; k <= 2 * around && !ground[static_cast<size_t>(c)]; ++k) {
        const int beside = Beside(c, k % 2 == 0 ? k / 2 : -(k + 1) / 2);
        if (beside < 0) continue;
        const std::optional<Plane>& end = ended_[static_cast<size_t>(beside)];
        if (end && end->normal.dot(up_) >= kLeastGroundUp) ground[static_cast<size_t>(c)] = end;
      }
    }
    return ground;
  }

  // m along a cell's ray, to where it would meet the ground that breaks off, if that went on: on a
  // slope, that is what is level ground elsewhere. Infinity where there is none, or the ray moves
  // away from it.
  double ToGround(const std::optional<Plane>& ground, int column, int row) const {
    const double facing = ground ? -ground->normal.dot(surface_.Direction(column, row)) : -1;
    if (facing <= -kRelief) return std::numeric_limits<double>::infinity();
    return ground->distance / (std::max(facing, 0.0) + kRelief);
  }

  std::vector<SkyRay> Rays() const {
    const double range = SkyRange(scanner_);
    const double height = HeightOverGround();
    const std::vector<std::optional<Plane>> ground = GroundThatEnds();
    std::vector<SkyRay> rays;
    for (int c = 0; c < columns_; ++c) {
      for (int r = 0; r < rows_; ++r) {
        if (state_[Index(c, r)] != kSkyCell) continue;
        auto bound = static_cast<double>(bound_[Index(c, r)]);
        const UnknownReason beyond = bound < range ? UnknownReason::kHole : UnknownReason::kSky;
        // A ray that goes down may meet ground that does not return. Where the ground beside it
        // breaks off (an edge, or water) nothing is promised.
        const double sine = surface_.Direction(c, r).dot(up_);
        if (sine < 0) {
          bound = std::min(
              {bound, height / (kRelief - sine), ToGround(ground[static_cast<size_t>(c)], c, r)});
        }
        rays.push_back({c, r, static_cast<float>(std::min(bound, range)), beyond});
      }
    }
    return rays;
  }

  static constexpr std::array<std::pair<int, int>, 4> kFaces = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};

  const RangeSurface& surface_;
  const sensor::ScannerModel& scanner_;
  const Vector3d up_;
  const int columns_;
  const int rows_;
  const int row_radius_;                      // of the surroundings that are to be pure, cells
  const int least_run_;                       // of returns on top of each other, cells
  const int faint_columns_;                   // every how many-th is looked at
  const int faint_rows_;                      // the same
  std::vector<std::array<int32_t, 2>> sums_;  // no return, a range
  std::vector<int> skyline_;                  // row, by column
  std::vector<uint8_t> state_;                // State, by cell
  std::vector<float> bound_;                  // m, by cell: a surface may go on there
  std::vector<std::optional<Plane>> ended_;   // by column: the highest surface that breaks off
  FaintReturns faint_;
};

}  // namespace

double SkyRange(const sensor::ScannerModel& scanner) {
  return kDarkestRangeShare * scanner.range_max;
}

std::vector<SkyRay> FindSkyRays(const RangeSurface& surface, const sensor::ScannerModel& scanner,
                                const Eigen::Vector3d& up) {
  return SkyFinder(surface, scanner, up).Find();
}

}  // namespace vantage::model
