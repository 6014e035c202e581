#include "core/model/reflections/reflection_regions.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <tuple>
#include <utility>

#include "core/model/reflections/mirror_fit.h"

namespace vantage::model {
namespace {

// A region is judged by shares of its cells: of 150 they are off by 4 % at most, one sigma. Where
// cells are coarser than 0.75 degrees, by those of a mirror nine degrees wide and high, which is
// half a metre three metres away; from there on shares are off by more, 5 % at a degree.
constexpr double kLeastRegion = 150;                                                       // cells
constexpr double kLeastRegionAngle = 150 * sensor::Radians(0.75) * sensor::Radians(0.75);  // sr
// Of these, cells that are looked at, however few of the image's: a first look decides by them.
constexpr size_t kLeastJudged = 8;
constexpr size_t kLeastTelling = 30;  // cells that say something: a fifth of the least region

// How far one has to look, as angles, so that it is as far at any step, three metres away: Ahead()
// makes cells of them, at least one.
constexpr double kWallBeside = sensor::Radians(1.5);  // 8 cm: a jamb has gone away from its wall
constexpr double kThroughPlane = 2 * kWallBeside;  // from a reflection's edge to before its plane
constexpr double kRevealDepth = sensor::Radians(1.5);  // 8 cm of a thin wall's reveal, seen askew
// Rays, not lengths: a polished floor returns some rays itself, whatever their step, and so leaves
// gaps of a ray or two in what it reflects, and has rays of its own within three.
constexpr int kGap = 2;
constexpr int kOwnWithin = 3;

// Shares of a region that decide what it is, each of cells or of pairs of cells at its border. Half
// is what most of it says. Of the 150 cells of the least region a share is off by 4 % at most, one
// sigma, and of the some 50 pairs of its border by 7 %: a twelfth (8 %) and an eighth (13 %) are
// two of these sigmas from nothing, and a quarter is four.
constexpr double kMostContradicted = 1.0 / 12;
constexpr double kMostBehind = 1.0 / 8;
constexpr double kMostConnected = 1.0 / 8;
constexpr double kMostDoubtful = 1.0 / 4;  // where other evidence decides
// Of a region's width, which is the side of a square as large: a mirror of which furniture hides
// three sides shows nearly one.
constexpr double kLeastEdge = 0.75;
// What is reflected twice, and edges: up to so many cells wherever they are, and to this share of
// the reflection where it surrounds a quarter of them.
constexpr size_t kSpeck = 4;
constexpr double kSpeckShare = 1.0 / 50;
// A region that is as large as this share of what was found must be told by itself.
constexpr double kMinor = 1.0 / 4;

// Every `stride`-th column and row of the image, judged by one plane.
class Judgement {
 public:
  Judgement(const RangeSurface& surface, const ReflectingPlane& plane, int stride)
      : surface_(surface),
        plane_(plane),
        tester_(surface),
        stride_(stride),
        columns_((surface.columns() + stride - 1) / stride),
        rows_((surface.rows() + stride - 1) / stride),
        taken_(static_cast<size_t>(columns_) * static_cast<size_t>(rows_), 0) {
    back_.reserve(taken_.size());
    for (int c = 0; c < columns_; ++c) {
      for (int r = 0; r < rows_; ++r) {
        back_.push_back(tester_.Test(plane, c * stride, r * stride));
      }
    }
  }

  // The cells of the whole image, not every `stride`-th alone, that are reflections.
  std::vector<ScanCell> AllReflections() {
    if (Reflections().empty()) return {};
    // A cell between sampled ones is taken like the sampled one next to it, or, when that one's
    // return is from before the plane, like those around it.
    std::vector<uint8_t> near(taken_);
    for (int c = 0; c < columns_; ++c) {
      for (int r = 0; r < rows_; ++r) {
        const ScanCell cell{c, r};
        if (taken_[Index(cell)] != 0 || BackOf(cell) != Back::kInFront) continue;
        ForNeighbours(cell, 1, [&](const ScanCell& n) { near[Index(cell)] |= taken_[Index(n)]; });
      }
    }
    std::vector<ScanCell> found;
    for (int c = 0; c < surface_.columns(); ++c) {
      int next_c = (c + stride_ / 2) / stride_;
      if (next_c == columns_) next_c = surface_.azimuth().closed() ? 0 : columns_ - 1;
      for (int r = 0; r < surface_.rows(); ++r) {
        const int next_r = std::min((r + stride_ / 2) / stride_, rows_ - 1);
        const bool among = near[Index({next_c, next_r})] != 0;
        if ((!among && !scattered_) || !surface_.Returned(c, r)) continue;
        if (plane_.Above(tester_.Point(c, r)) > -plane_.behind) continue;
        if (among || AmongThePlanesOwn(c, r, 1)) found.push_back({c, r});
      }
    }
    return found;
  }

  // The regions of cells that have the shape of reflections in a mirror, to be told by what other
  // scans measured. `roughly`: without a look at their borders.
  std::vector<SuspectedRegion> Suspected(bool roughly, Hangs hangs) {
    FindLevel();
    FindFloor();
    MarkWhatGoesThrough();
    std::vector<SuspectedRegion> suspected;
    std::vector<uint8_t> seen(back_.size(), 0);
    for (size_t i = 0; i < seen.size(); ++i) seen[i] = role_[i] == Role::kNone ? 0 : 1;
    for (int c = 0; c < columns_; ++c) {
      for (int r = 0; r < rows_; ++r) {
        if (!InQuestion(Index({c, r})) || seen[Index({c, r})] != 0) continue;
        SuspectedRegion region{Gather({c, r}, 1, seen), std::nullopt};
        if (!IsLarge(region.cells)) continue;
        if (!roughly && !EndsLikeAMirror(region, hangs)) continue;
        suspected.push_back(std::move(region));
      }
    }
    return suspected;
  }

  // The cells of all regions that are reflections.
  std::vector<ScanCell> Reflections() {
    std::vector<std::vector<ScanCell>> regions;
    std::vector<uint8_t> seen(back_.size(), 0);
    for (int c = 0; c < columns_; ++c) {
      for (int r = 0; r < rows_; ++r) {
        if (InQuestion(Index({c, r})) && seen[Index({c, r})] == 0) {
          regions.push_back(Gather({c, r}, kGap, seen));
        }
      }
    }
    std::vector<ScanCell> found;
    for (std::vector<ScanCell>& region : regions) {
      if (!IsReflection(region)) continue;
      Take(region, found);
      region.clear();
    }
    if (found.empty()) return found;
    // Since the plane is known to reflect now, other regions need less evidence.
    BoundReflector(found);
    const size_t largest = found.size();
    for (const std::vector<ScanCell>& region : regions) {
      if (Share(region.size(), largest) <= kMinor && IsMoreOfIt(region)) Take(region, found);
    }
    TakeAmongThePlanesOwn(found);
    TakeSpecks(found);
    return found;
  }

 private:
  size_t Index(const ScanCell& cell) const {
    return static_cast<size_t>(cell.column) * static_cast<size_t>(rows_) +
           static_cast<size_t>(cell.row);
  }
  Back BackOf(const ScanCell& cell) const { return back_[Index(cell)]; }
  bool InQuestion(size_t i) const { return back_[i] == Back::kAgrees || back_[i] == Back::kHidden; }
  std::optional<ScanCell> Beside(const ScanCell& cell, int dc, int dr) const {
    int c = cell.column + dc;
    const int r = cell.row + dr;
    if (surface_.azimuth().closed()) c = (c + columns_) % columns_;
    if (c < 0 || c >= columns_ || r < 0 || r >= rows_) return std::nullopt;
    return ScanCell{c, r};
  }
  template <typename Fn>
  void ForNeighbours(const ScanCell& cell, int reach, Fn&& fn) const {
    for (int dc = -reach; dc <= reach; ++dc) {
      for (int dr = -reach; dr <= reach; ++dr) {
        if (dc == 0 && dr == 0) continue;
        const std::optional<ScanCell> beside = Beside(cell, dc, dr);
        if (beside) fn(*beside);
      }
    }
  }
  bool Returned(const ScanCell& cell) const {
    return surface_.Returned(cell.column * stride_, cell.row * stride_);
  }
  Eigen::Vector3d Point(const ScanCell& cell) const {
    return tester_.Point(cell.column * stride_, cell.row * stride_);
  }

  std::vector<ScanCell> Gather(const ScanCell& seed, int reach, std::vector<uint8_t>& seen) const {
    std::vector<ScanCell> region = {seed};
    seen[Index(seed)] = 1;
    for (size_t i = 0; i < region.size(); ++i) {
      ForNeighbours(ScanCell(region[i]), reach, [&](const ScanCell& n) {
        if (seen[Index(n)] != 0 || !InQuestion(Index(n))) return;
        seen[Index(n)] = 1;
        region.push_back(n);
      });
    }
    return region;
  }

  static double Share(size_t part, size_t all) {
    return static_cast<double>(part) / static_cast<double>(std::max<size_t>(1, all));
  }
  // Judged columns or rows that make an angle (rad), at least `least`.
  int Ahead(double angle, const AngularAxis& axis, int least = 1) const {
    return std::max(least, static_cast<int>(std::lround(angle / axis.mean_step())) / stride_);
  }
  const AngularAxis& AxisOf(int dc) const {
    return dc != 0 ? surface_.azimuth() : surface_.elevation();
  }

  // True when a cell of the image has the plane's own returns on both sides, left and right or
  // above and below, within kOwnWithin steps of `step` cells.
  bool AmongThePlanesOwn(int column, int row, int step) const {
    const auto own = [&](int dc, int dr) {
      for (int k = step; k <= kOwnWithin * step; k += step) {
        int c = column + k * dc;
        const int r = row + k * dr;
        if (surface_.azimuth().closed()) c = (c + surface_.columns()) % surface_.columns();
        if (c < 0 || c >= surface_.columns() || r < 0 || r >= surface_.rows()) continue;
        if (surface_.Returned(c, r) &&
            std::abs(plane_.Above(tester_.Point(c, r))) < plane_.behind) {
          return true;
        }
      }
      return false;
    };
    return (own(-1, 0) && own(1, 0)) || (own(0, -1) && own(0, 1));
  }
  bool AmongThePlanesOwn(const ScanCell& cell) const {
    return AmongThePlanesOwn(cell.column * stride_, cell.row * stride_, stride_);
  }

  // The number of cells of the region beside a cell that contradicts.
  size_t Contradicted(const std::vector<ScanCell>& region) const {
    size_t contradicted = 0;
    for (const ScanCell& cell : region) {
      bool beside = false;
      ForNeighbours(cell, 1, [&](const ScanCell& n) { beside |= BackOf(n) == Back::kContradicts; });
      contradicted += beside ? 1 : 0;
    }
    return contradicted;
  }

  // True when every sample on the way to a neighbour is joined to the next.
  bool Connected(const ScanCell& cell, int dc, int dr) const {
    int c = cell.column * stride_;
    int r = cell.row * stride_;
    const std::optional<ScanCell> beside = Beside(cell, dc, dr);
    const int to_c = beside->column * stride_;
    const int to_r = beside->row * stride_;
    for (int step = 0; step < 2 * stride_ && (c != to_c || r != to_r); ++step) {
      if (dc > 0) {
        if (!surface_.JoinedToNextColumn(c, r)) return false;
        c = surface_.NextColumn(c);
      } else if (dc < 0) {
        c = c > 0 ? c - 1 : surface_.columns() - 1;
        if (!surface_.JoinedToNextColumn(c, r)) return false;
      } else if (dr > 0) {
        if (!surface_.JoinedToNextRow(c, r++)) return false;
      } else if (!surface_.JoinedToNextRow(c, --r)) {
        return false;
      }
    }
    return true;
  }

  // True when the surface that begins at a cell continues along the plane; a jamb goes away from
  // it.
  bool LiesInPlane(const ScanCell& cell, int dc, int dr) const {
    const int further = Ahead(kWallBeside, AxisOf(dc));
    const std::optional<ScanCell> on = Beside(cell, further * dc, further * dr);
    return on && Returned(*on) && InPlane(*on);
  }
  bool InPlane(const ScanCell& cell) const {
    const double above = plane_.Above(Point(cell));
    return above > -ReflectingPlane::kProud && above < ReflectingPlane::kFrame;
  }

  // True when the surface at a cell, behind the plane, continues to the side in front of it. That
  // it continues into the plane is not enough: at a mirror's lower edge the floor that it shows is
  // as far away as its frame.
  bool GoesThrough(const ScanCell& cell, int dc, int dr) const {
    ScanCell at = cell;
    const int ahead = Ahead(kThroughPlane, AxisOf(dc), 2);
    for (int i = 0; i < ahead; ++i) {
      const std::optional<ScanCell> next = Beside(at, dc, dr);
      if (!next || BackOf(*next) != Back::kInFront || !Returned(*next)) return false;
      if (!Connected(at, dc, dr)) return false;
      if (!InPlane(*next)) return true;
      at = *next;
    }
    return false;
  }

  // The border of a region: pairs of a cell in it and a neighbour outside it that has a return.
  struct Border {
    size_t all = 0;
    size_t broken = 0;     // the surface breaks off, and the neighbour lies in the plane
    size_t connected = 0;  // the surface continues through the plane
    size_t behind = 0;     // the neighbour contradicts
    size_t before = 0;     // the neighbour is well before the plane
  };
  Border BorderOf(const std::vector<ScanCell>& region) const {
    constexpr double kAtPlane = 0.25;  // m before the plane: farther than frames and shelves on it
    Border border;
    for (const ScanCell& cell : region) {
      for (const auto& [dc, dr] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
        const std::optional<ScanCell> beside = Beside(cell, dc, dr);
        if (!beside || InQuestion(Index(*beside)) || !Returned(*beside)) continue;
        ++border.all;
        if (BackOf(*beside) == Back::kContradicts) {
          ++border.behind;
        } else if (plane_.Above(Point(*beside)) > kAtPlane) {
          ++border.before;
        } else if (Connected(cell, dc, dr)) {
          ++border.connected;
        } else if (LiesInPlane(*beside, dc, dr)) {
          ++border.broken;
        }
      }
    }
    return border;
  }
  static bool BreaksOff(const Border& border) {
    return 2 * border.broken >= border.all && Share(border.behind, border.all) <= kMostBehind &&
           2 * border.before <= border.broken;
  }

  // Cells of the image.
  size_t LeastRegion() const {
    const double cell = surface_.azimuth().mean_step() * surface_.elevation().mean_step();
    return static_cast<size_t>(std::lround(std::min(kLeastRegion, kLeastRegionAngle / cell)));
  }

  bool IsReflection(const std::vector<ScanCell>& region) {
    const size_t stands_for = static_cast<size_t>(stride_) * static_cast<size_t>(stride_);
    if (region.size() < std::max<size_t>(kLeastJudged, LeastRegion() / stands_for)) return false;
    const size_t skip = std::max<size_t>(1, region.size() / 2000);
    size_t sampled = 0;
    size_t looked = 0;  // cells that are evidence
    size_t agree = 0;
    size_t telling = 0;
    size_t telling_agree = 0;
    size_t among_own = 0;
    for (size_t i = 0; i < region.size(); i += skip) {
      const ScanCell& cell = region[i];
      ++sampled;
      if (!tester_.WellBehind(plane_, cell.column * stride_, cell.row * stride_)) continue;
      const bool agrees = BackOf(cell) == Back::kAgrees;
      ++looked;
      agree += agrees ? 1 : 0;
      const bool own = AmongThePlanesOwn(cell);
      among_own += own ? 1 : 0;
      if (own || tester_.Telling(plane_, cell.column * stride_, cell.row * stride_)) {
        ++telling;
        telling_agree += agrees ? 1 : 0;
      }
    }
    if (2 * looked < sampled || 3 * agree < looked) return false;
    if (telling * skip < kLeastTelling / static_cast<size_t>(stride_)) return false;
    if (2 * telling_agree < telling) return false;
    if (Share(Contradicted(region), region.size()) > kMostContradicted) return false;
    const Border border = BorderOf(region);
    // Single returns scattered among the plane's own are not a room behind it.
    if (2 * among_own > looked && 2 * border.broken >= border.all &&
        Share(border.connected, border.all) <= kMostConnected) {
      scattered_ = true;
      return true;
    }
    const double width = std::sqrt(static_cast<double>(region.size()));
    return BreaksOff(border) && static_cast<double>(border.broken) >= kLeastEdge * width;
  }

  static constexpr double kAlong = 0.1;   // cosine to the plane's normal: six degrees
  static constexpr double kLevel = 0.95;  // cosine: 18 degrees, since the scanner may lean
  static constexpr std::array<std::pair<int, int>, 4> kBeside = {
      {{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};

  // A floor or ceiling behind an upright plane coincides with its own reflection and connects
  // reflected regions to real ones. So it is left out, and added in the end.
  void FindLevel() {
    role_.assign(back_.size(), Role::kNone);
    for (int c = 0; c < columns_; ++c) {
      for (int r = 0; r < rows_; ++r) {
        const size_t i = Index({c, r});
        if (back_[i] != Back::kAgrees) continue;
        const Eigen::Vector3d normal = NormalAround(surface_, c * stride_, r * stride_);
        if (std::abs(normal.z()) > kLevel) role_[i] = Role::kLevel;
      }
    }
  }

  // The floor is the lowest of what lies, but for a tenth: steps down, and what is wrong.
  void FindFloor() {
    const int every = StrideOf(surface_, kCoarse);
    std::vector<Eigen::Vector3d> lying;
    for (int c = 0; c < surface_.columns(); c += every) {
      for (int r = 0; r < surface_.rows(); r += every) {
        const Eigen::Vector3d normal = NormalAround(surface_, c, r);
        if (normal.z() <= kLevel) continue;
        lying.push_back(tester_.Point(c, r));
        up_ += normal;
      }
    }
    if (lying.empty()) return;
    up_.normalize();
    const auto tenth = lying.begin() + static_cast<std::ptrdiff_t>(lying.size() / 10);
    std::nth_element(lying.begin(), tenth, lying.end(),
                     [&](const auto& a, const auto& b) { return up_.dot(a) < up_.dot(b); });
    floor_ = up_.dot(*tenth);
  }
  // To within three sigma, as ReturnTest::Closely is; a plinth is higher.
  bool OnFloor(const ScanCell& cell) const {
    return floor_ && std::abs(up_.dot(Point(cell)) - *floor_) < tester_.Closely();
  }

  // A wall that continues from before the plane to behind it is real, and so is all surface joined
  // to it. The search stops at cells that agree and tell, since these may be reflections.
  void MarkWhatGoesThrough() {
    std::vector<ScanCell> found;
    const auto mark = [&](const ScanCell& cell) {
      const int c = cell.column * stride_;
      const int r = cell.row * stride_;
      const bool tells = BackOf(cell) == Back::kAgrees && tester_.WellBehind(plane_, c, r) &&
                         tester_.Telling(plane_, c, r);
      if (tells) return;
      role_[Index(cell)] = Role::kGoesThrough;
      found.push_back(cell);
    };
    const auto open = [&](const ScanCell& cell) {
      return InQuestion(Index(cell)) && role_[Index(cell)] == Role::kNone;
    };
    for (int c = 0; c < columns_; ++c) {
      for (int r = 0; r < rows_; ++r) {
        if (!open({c, r})) continue;
        const bool through = std::any_of(kBeside.begin(), kBeside.end(), [&](const auto& way) {
          return GoesOn({c, r}, way.first, way.second);
        });
        if (through) mark({c, r});
      }
    }
    for (size_t i = 0; i < found.size(); ++i) {
      const ScanCell cell = found[i];
      for (const auto& [dc, dr] : kBeside) {
        const std::optional<ScanCell> beside = Beside(cell, dc, dr);
        if (beside && open(*beside) && Connected(cell, dc, dr)) mark(*beside);
      }
    }
  }

  // True for surface behind the plane that is no reflection.
  bool IsReal(const ScanCell& cell) const {
    return BackOf(cell) == Back::kContradicts || role_[Index(cell)] == Role::kGoesThrough;
  }

  // Adds the floor and the ceiling below and above the cells of a region.
  void AddLevel(std::vector<ScanCell>& region) {
    const size_t all = region.size();
    for (size_t i = 0; i < all; ++i) {
      for (const int dr : {-1, 1}) {
        ScanCell at = region[i];
        for (at.row += dr; at.row >= 0 && at.row < rows_; at.row += dr) {
          if (role_[Index(at)] != Role::kLevel) break;
          role_[Index(at)] = Role::kNone;
          region.push_back(at);
        }
      }
    }
  }

  // True for a wall at right angles to the plane that goes on from before it to behind it. Like a
  // floor it is where its own reflection would be: beside a wardrobe that stands at a side wall one
  // cannot tell that wall from its image.
  bool RunsAlong(const ScanCell& cell) const {
    if (role_[Index(cell)] != Role::kGoesThrough || BackOf(cell) != Back::kAgrees) return false;
    const Eigen::Vector3d normal =
        NormalAround(surface_, cell.column * stride_, cell.row * stride_);
    return std::abs(normal.dot(plane_.normal)) < kAlong;
  }
  // Adds such walls left and right of the cells of a region, and floor and ceiling at them.
  void AddAlong(std::vector<ScanCell>& region) {
    const size_t all = region.size();
    for (size_t i = 0; i < all; ++i) {
      for (const int dc : {-1, 1}) {
        ScanCell at = region[i];
        for (auto next = Beside(at, dc, 0); next && RunsAlong(*next) && Connected(at, dc, 0);
             next = Beside(at, dc, 0)) {
          at = *next;
          role_[Index(at)] = Role::kNone;
          region.push_back(at);
        }
      }
    }
    AddLevel(region);
  }

  // True when a region is as large as a mirror, and is hardly contradicted.
  bool IsLarge(const std::vector<ScanCell>& region) const {
    const size_t stands_for = static_cast<size_t>(stride_) * static_cast<size_t>(stride_);
    if (region.size() < std::max<size_t>(kLeastJudged, LeastRegion() / stands_for)) return false;
    const auto well_behind = std::count_if(region.begin(), region.end(), [&](const ScanCell& cell) {
      return tester_.WellBehind(plane_, cell.column * stride_, cell.row * stride_);
    });
    return 2 * static_cast<size_t>(well_behind) >= region.size() &&
           Share(Contradicted(region), region.size()) <= kMostDoubtful;
  }

  // True when a region ends in the plane as at a frame: on nearly one of its four sides at least,
  // and far more often than it goes on to real surface, also to that of an opening's reveals. What
  // stands before the plane, and what is seen past furniture's edge, says nothing. Completes the
  // region.
  bool EndsLikeAMirror(SuspectedRegion& region, Hangs hangs) {
    AddLevel(region.cells);
    std::vector<uint8_t> in_region(back_.size(), 0);
    for (const ScanCell& cell : region.cells) in_region[Index(cell)] = 1;
    size_t broken = 0;
    size_t through = 0;
    size_t reveal = 0;
    size_t along = 0;
    for (const ScanCell& cell : region.cells) {
      for (const auto& [dc, dr] : kBeside) {
        const std::optional<ScanCell> beside = Beside(cell, dc, dr);
        if (!beside || in_region[Index(*beside)] != 0 || !Returned(*beside)) continue;
        if (BackOf(*beside) == Back::kInFront) {
          if (InPlane(*beside) && !OnFloor(cell) && Connected(cell, dc, dr)) ++reveal;
          if (GoesOn(cell, dc, dr)) {
            ++through;
          } else if (InPlane(*beside) || LiesInPlane(*beside, dc, dr)) {
            ++broken;
          }
        } else if (IsReal(*beside)) {
          if (IsReveal(*beside, dc, dr)) ++reveal;
          if (Connected(cell, dc, dr)) {
            const bool beside_furniture = hangs == Hangs::kOnFurniture && RunsAlong(*beside);
            ++(beside_furniture ? along : through);
          }
        }
      }
    }
    const double width = std::sqrt(static_cast<double>(region.cells.size()));
    constexpr double kMostReveal = 0.1;  // as ShowsReveals: of an opening's border a tenth shows it
    if (Share(through, broken) > kMostDoubtful || Share(reveal, broken) > kMostReveal) return false;
    if (static_cast<double>(broken) < kLeastEdge * width || !ShowsReveals(region.cells))
      return false;
    if (FloorGoesThrough(region.cells, in_region)) return false;
    // A wall that runs along takes one of four sides from a mirror, and leaves it one that ends in
    // the plane at least. Where it is at more of the border, there is a real space beside
    // furniture: 1.5 times as much and more in two of 200 random scenes, up to 1.3 at mirrors.
    constexpr double kMostAlong = 1.4;
    if (Share(along, broken) > kMostAlong) return false;
    region.wall = WallAround(region.cells, in_region);
    if (region.wall && plane_.IsRecessed(*region.wall)) return false;
    if (hangs == Hangs::kOnFurniture) AddAlong(region.cells);
    return true;
  }

  // True when a narrow surface behind the plane goes on to what lies in the plane.
  bool IsReveal(const ScanCell& cell, int dc, int dr) const {
    constexpr double kDeepest = 0.3;  // m: thicker walls' openings are seen to be deep
    ScanCell at = cell;
    const int ahead = Ahead(kRevealDepth, AxisOf(dc));
    for (int i = 0; i < ahead; ++i) {
      if (plane_.Above(Point(at)) < -kDeepest) return false;
      const std::optional<ScanCell> next = Beside(at, dc, dr);
      if (!next || !Returned(*next) || !Connected(at, dc, dr)) return false;
      if (BackOf(*next) == Back::kInFront) return InPlane(*next);
      at = *next;
    }
    return false;
  }

  // True when a region is near enough for its scan to show the reveals of an opening, were it one:
  // on a tenth of its border, in a thin wall (0.08 m), 0.35 m beside the line of sight.
  bool ShowsReveals(const std::vector<ScanCell>& region) const {
    constexpr double kShows = 0.35 * 0.08 / 0.1;  // m^2 rad: distance squared by the step of rays
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const ScanCell& cell : region) middle += Crossing(cell);
    middle /= static_cast<double>(region.size());
    const double step =
        std::sqrt(surface_.azimuth().mean_step() * surface_.elevation().mean_step());
    return middle.squaredNorm() * step < kShows;
  }

  // As GoesThrough; but the floor only where nothing but floor leads on: below a mirror that nearly
  // reaches down to it, a plinth is as far away as the floor that the mirror shows.
  bool GoesOn(const ScanCell& cell, int dc, int dr) const {
    if (!OnFloor(cell)) return GoesThrough(cell, dc, dr);
    ScanCell at = cell;
    for (std::optional<ScanCell> next = Beside(at, dc, dr);
         next && Returned(*next) && OnFloor(*next) && Connected(at, dc, dr);
         next = Beside(at, dc, dr)) {
      at = *next;
      if (plane_.Above(Point(at)) > ReflectingPlane::kFrame) return true;
    }
    return false;
  }

  // The median, by the distance from the plane, of what lies around a region and near the plane.
  std::optional<Eigen::Vector3d> WallAround(const std::vector<ScanCell>& region,
                                            const std::vector<uint8_t>& in_region) const {
    constexpr double kPastFrame = 0.15;  // m, along the plane
    constexpr double kStillWall = 0.45;  // m: from here on it may be another wall
    constexpr double kAtWall = 0.25;     // m before and behind the plane: else it is no wall of it
    std::vector<std::pair<double, ScanCell>> walls;
    for (const ScanCell& cell : region) {
      for (const auto& [dc, dr] : kBeside) {
        const Eigen::Vector3d edge = Crossing(cell);
        for (int k = 1;; ++k) {
          const std::optional<ScanCell> at = Beside(cell, k * dc, k * dr);
          if (!at || in_region[Index(*at)] != 0 || !Meets(*at)) break;
          const double away = (Crossing(*at) - edge).norm();
          if (away > kStillWall) break;
          if (away < kPastFrame || !Returned(*at)) continue;
          const double above = plane_.Above(Point(*at));
          if (std::abs(above) > kAtWall) continue;
          walls.emplace_back(above, *at);
          break;
        }
      }
    }
    if (walls.empty()) return std::nullopt;
    const auto middle = walls.begin() + static_cast<std::ptrdiff_t>(walls.size() / 2);
    std::nth_element(walls.begin(), middle, walls.end(), [](const auto& a, const auto& b) {
      return std::tuple(a.first, a.second.column, a.second.row) <
             std::tuple(b.first, b.second.column, b.second.row);
    });
    return Point(middle->second);
  }

  // True when the floor behind the plane goes on to the floor before it below much of a region, as
  // in a doorway. A mirror ends above the floor.
  bool FloorGoesThrough(const std::vector<ScanCell>& region,
                        const std::vector<uint8_t>& in_region) const {
    std::vector<uint8_t> column(static_cast<size_t>(columns_), 0);  // 1: of the region, 2: floor
    for (const ScanCell& cell : region) {
      uint8_t& said = column[static_cast<size_t>(cell.column)];
      said |= 1;
      const std::optional<ScanCell> below = Beside(cell, 0, -1);
      if (!below || in_region[Index(*below)] != 0 || !OnFloor(cell)) continue;
      if (GoesOn(cell, 0, -1)) said |= 2;
    }
    const auto wide = std::count_if(column.begin(), column.end(), [](uint8_t c) { return c != 0; });
    const auto floor = std::count(column.begin(), column.end(), 3);
    return 3 * floor > wide;
  }
  // True when the ray of a cell meets the plane, and not too flatly.
  bool Meets(const ScanCell& cell) const {
    return plane_.normal.dot(surface_.Direction(cell.column * stride_, cell.row * stride_)) < -0.05;
  }

  // Where the ray of a cell crosses the plane, m, scanner's frame.
  Eigen::Vector3d Crossing(const ScanCell& cell) const {
    return plane_.Crossing(surface_.Direction(cell.column * stride_, cell.row * stride_));
  }

  // Limits an upright reflector to the box of the reflections found. A polished floor reflects
  // everywhere, but a mirror ends, and the floor, ceiling and walls seen through a door in the same
  // wall would agree with their reflections.
  void BoundReflector(const std::vector<ScanCell>& found) {
    // m: what a washstand before a mirror, or its frame, parts from the rest; less than from a
    // mirror to a door.
    constexpr double kAround = 0.3;
    if (plane_.IsLevel()) return;
    reflector_.emplace();
    for (const ScanCell& cell : found) reflector_->extend(Crossing(cell));
    reflector_->min().array() -= kAround;
    reflector_->max().array() += kAround;
  }
  bool OnReflector(const ScanCell& cell) const {
    return !reflector_ || reflector_->contains(Crossing(cell));
  }

  bool IsMoreOfIt(const std::vector<ScanCell>& region) const {
    size_t agree = 0;
    for (const ScanCell& cell : region) {
      if (!OnReflector(cell)) return false;
      agree += BackOf(cell) == Back::kAgrees ? 1 : 0;
    }
    return 2 * agree >= region.size() &&
           Share(Contradicted(region), region.size()) <= kMostDoubtful &&
           BreaksOff(BorderOf(region));
  }

  void Take(const std::vector<ScanCell>& cells, std::vector<ScanCell>& found) {
    for (const ScanCell& cell : cells) {
      taken_[Index(cell)] = 1;
      found.push_back(cell);
    }
  }

  void TakeAmongThePlanesOwn(std::vector<ScanCell>& found) {
    for (int c = 0; c < columns_; ++c) {
      for (int r = 0; r < rows_; ++r) {
        const ScanCell cell{c, r};
        if (BackOf(cell) == Back::kInFront || taken_[Index(cell)] != 0) continue;
        if (OnReflector(cell) && AmongThePlanesOwn(cell)) Take({cell}, found);
      }
    }
  }

  // Adds small clusters of returns from behind the plane within a reflection, whether they agree or
  // not: they are mixed pixels, edges, or were reflected twice.
  void TakeSpecks(std::vector<ScanCell>& found) {
    const size_t largest =
        static_cast<size_t>(kSpeckShare * static_cast<double>(found.size())) + kSpeck;
    std::vector<uint8_t> seen(back_.size(), 0);
    const auto open = [&](const ScanCell& cell) {
      const size_t i = Index(cell);
      return seen[i] == 0 && taken_[i] == 0 && back_[i] != Back::kInFront;
    };
    const std::vector<ScanCell> reflection = found;
    for (const ScanCell& cell : reflection) {
      ForNeighbours(cell, 2, [&](const ScanCell& start) {
        if (!open(start)) return;
        seen[Index(start)] = 1;
        std::vector<ScanCell> cluster = {start};
        size_t touching = 0;
        for (size_t i = 0; i < cluster.size(); ++i) {
          bool touches = false;
          ForNeighbours(ScanCell(cluster[i]), 1, [&](const ScanCell& n) {
            touches |= taken_[Index(n)] != 0;
            if (!open(n)) return;
            seen[Index(n)] = 1;
            cluster.push_back(n);
          });
          touching += touches ? 1 : 0;
        }
        if (cluster.size() <= kSpeck ||
            (cluster.size() <= largest && 4 * touching >= cluster.size())) {
          Take(cluster, found);
        }
      });
    }
  }

  const RangeSurface& surface_;
  ReflectingPlane plane_;
  ReturnTest tester_;
  int stride_;
  int columns_;
  int rows_;
  std::vector<Back> back_;
  std::vector<uint8_t> taken_;
  // What a cell behind the plane is besides, where a mirror is only suspected.
  enum class Role : uint8_t { kNone, kLevel, kGoesThrough };
  std::vector<Role> role_;
  Eigen::Vector3d up_ = Eigen::Vector3d::Zero();  // unit, of the floor
  std::optional<double> floor_;                   // m along it; none where there is no floor
  std::optional<Eigen::AlignedBox3d> reflector_;  // m, scanner's frame; none: all of the plane
  bool scattered_ = false;  // there are reflections among the plane's own returns
};

}  // namespace

bool HasReflections(const RangeSurface& surface, const ReflectingPlane& plane, int stride) {
  return !Judgement(surface, plane, stride).Reflections().empty();
}

std::vector<ScanCell> FindReflections(const RangeSurface& surface, const ReflectingPlane& plane,
                                      int stride) {
  return Judgement(surface, plane, stride).AllReflections();
}

bool MayHaveReflections(const RangeSurface& surface, const ReflectingPlane& plane, int stride) {
  return !Judgement(surface, plane, stride).Suspected(true, Hangs::kOnWall).empty();
}

std::vector<SuspectedRegion> FindSuspectedReflections(const RangeSurface& surface,
                                                      const ReflectingPlane& plane, int stride,
                                                      Hangs hangs) {
  std::vector<SuspectedRegion> regions = Judgement(surface, plane, stride).Suspected(false, hangs);
  for (SuspectedRegion& region : regions) {
    for (ScanCell& cell : region.cells) cell = {cell.column * stride, cell.row * stride};
  }
  return regions;
}

}  // namespace vantage::model
