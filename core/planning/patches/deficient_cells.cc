#include "core/planning/patches/deficient_cells.h"

#include <cstring>
#include <utility>

#include "absl/hash/hash.h"
#include "absl/strings/string_view.h"

namespace vantage::planning {

DeficientCell DeficientCells::operator[](size_t i) const {
  const Packed& packed = cells_[i];
  const bool own_shape = OwnShape(i);
  const Shared& shared = shared_[own_shape ? own_[packed.shape].shared : packed.shape];
  DeficientCell cell;
  cell.voxel = Voxel(i);
  cell.kind = Kind(i);
  if (own_shape) {
    const Own& own = own_[packed.shape];
    cell.position = own.position;
    cell.normal = own.normal;
    cell.area = own.area;
    cell.density = own.density;
  } else {
    cell.position = Centre(cell.voxel, voxel_);
    cell.normal = shared.normal;
    cell.area = shared.area;
    cell.density = shared.density;
  }
  cell.spread = shared.spread;
  cell.required = shared.required;
  cell.enough = shared.enough;
  cell.expected = Expected(i);
  cell.success = shared.success;
  cell.worth = shared.worth;
  cell.skyline = shared.skyline;
  cell.dropouts = shared.dropouts;
  cell.dropout_count = shared.dropout_count;
  return cell;
}

void DeficientCells::Reorder(std::vector<uint32_t>& order) {
  for (uint32_t begin = 0; begin < order.size(); ++begin) {
    // Along a cycle of the permutation; what is in its place is marked by its own number.
    if (order[begin] == begin) continue;
    const Packed first = cells_[begin];
    uint32_t to = begin;
    while (order[to] != begin) {
      const uint32_t from = order[to];
      cells_[to] = cells_[from];
      order[to] = to;
      to = from;
    }
    cells_[to] = first;
    order[to] = to;
  }
}

void DeficientCells::SetExpected(size_t i) { cells_[i].place |= kExpected; }

size_t DeficientCells::bytes() const {
  return bricks_.capacity() * sizeof(model::VoxelIndex) + cells_.capacity() * sizeof(Packed) +
         shared_.capacity() * sizeof(Shared) + own_.capacity() * sizeof(Own);
}

DeficientCells::Builder::Builder(double voxel)
    : numbers_(0, Hash{&made_.shared_}, Equal{&made_.shared_}) {
  made_.voxel_ = voxel;
}

void DeficientCells::Builder::Add(const DeficientCell& cell) {
  const model::VoxelIndex brick = model::Brick::Of(cell.voxel);
  if (made_.bricks_.empty() || made_.bricks_.back() != brick) made_.bricks_.push_back(brick);
  Packed packed;
  packed.brick = static_cast<uint32_t>(made_.bricks_.size() - 1);
  packed.place = static_cast<uint32_t>(model::Brick::LocalOf(cell.voxel)) |
                 static_cast<uint32_t>(cell.kind) << kKindBit;
  Shared shared;
  shared.normal.setZero();
  shared.spread = cell.spread;
  shared.required = cell.required;
  shared.enough = cell.enough;
  shared.success = cell.success;
  shared.worth = cell.worth;
  shared.skyline = cell.skyline;
  if (cell.dropout_count > 0) {
    shared.dropouts = cell.dropouts;
    shared.dropout_count = cell.dropout_count;
  }
  if (cell.position == Centre(cell.voxel, made_.voxel_)) {
    shared.normal = cell.normal;
    shared.area = cell.area;
    shared.density = cell.density;
    packed.shape = NumberOf(shared);
  } else {
    packed.place |= kOwn;
    packed.shape = static_cast<uint32_t>(made_.own_.size());
    made_.own_.push_back({cell.position, cell.normal, cell.area, cell.density, NumberOf(shared)});
  }
  made_.cells_.push_back(packed);
}

DeficientCells DeficientCells::Builder::Build() && {
  made_.bricks_.shrink_to_fit();
  made_.cells_.shrink_to_fit();
  made_.shared_.shrink_to_fit();
  made_.own_.shrink_to_fit();
  return std::move(made_);
}

size_t DeficientCells::Builder::Hash::operator()(const Shared& shared) const {
  return absl::Hash<absl::string_view>()(
      absl::string_view(reinterpret_cast<const char*>(&shared), sizeof(Shared)));
}

bool DeficientCells::Builder::Equal::operator()(uint32_t a, const Shared& b) const {
  return std::memcmp(static_cast<const void*>(&(*all)[a]), static_cast<const void*>(&b),
                     sizeof(Shared)) == 0;
}

uint32_t DeficientCells::Builder::NumberOf(const Shared& shared) {
  std::vector<Shared>& all = made_.shared_;
  const Equal equal{&all};
  if (last_ < all.size() && equal(last_, shared)) return last_;
  const auto next = static_cast<uint32_t>(all.size());
  // Places of dropouts are of one cell alone.
  if (shared.dropout_count > 0) {
    all.push_back(shared);
    return next;
  }
  const auto found = numbers_.find(shared);
  last_ = found != numbers_.end() ? *found : next;
  if (last_ != next) return last_;
  all.push_back(shared);
  numbers_.insert(next);
  return next;
}

}  // namespace vantage::planning
