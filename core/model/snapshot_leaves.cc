// Bricks, of layers and of the merged model, as they lie in a snapshot.
#include <algorithm>
#include <bit>

#include "core/model/snapshot_bytes.h"
#include "core/model/snapshot_sections.h"

namespace vantage {
namespace {

// What a mask or a leaf is, where it is simple.
enum Shape : uint8_t { kNone = 0, kAll = 1, kMixed = 2 };

Shape ShapeOf(const BrickMask& mask) {
  if (!mask.Any()) return kNone;
  return mask.Count() == Brick::kVoxels ? kAll : kMixed;
}

void WriteMask(const BrickMask& mask, SnapshotWriter& out) {
  const Shape shape = ShapeOf(mask);
  out.Fixed(static_cast<uint8_t>(shape));
  if (shape == kMixed) out.Raw(mask.word.data(), sizeof(mask.word));
}

BrickMask ReadMask(SnapshotReader& in) {
  BrickMask mask;
  const auto shape = in.Fixed<uint8_t>();
  if (shape > kMixed) in.Fail();
  if (shape == kAll) mask.word.fill(~uint64_t{0});
  if (shape == kMixed) {
    for (uint64_t& word : mask.word) word = in.Fixed<uint64_t>();
  }
  return mask;
}

void WritePlane(const LocalPlane& plane, SnapshotWriter& out) {
  out.Matrix(plane.centroid);
  out.Matrix(plane.normal);
  out.Fixed(plane.flatness);
  out.Fixed(plane.weight);
}

LocalPlane ReadPlane(SnapshotReader& in) {
  LocalPlane plane;
  in.Matrix(plane.centroid);
  in.Matrix(plane.normal);
  plane.flatness = in.Fixed<float>();
  plane.weight = in.Fixed<uint32_t>();
  return plane;
}

bool Same(const LocalPlane& a, const LocalPlane& b) {
  return a.centroid == b.centroid && a.normal == b.normal && a.flatness == b.flatness &&
         a.weight == b.weight;
}

void WriteContents(const Brick& brick, SnapshotWriter& out) {
  out.Raw(brick.state.data(), brick.state.size());
  for (const SurfaceVoxel& voxel : brick.surface) {
    out.Matrix(voxel.centroid);
    out.Matrix(voxel.normal);
    out.Fixed(voxel.area);
    out.Fixed(voxel.density);
    out.Varint(voxel.samples);
    out.Fixed(voxel.missed);
    out.Fixed(voxel.obtained);
    out.Fixed(static_cast<uint8_t>((voxel.ambiguous ? 1 : 0) + (voxel.given_up ? 2 : 0)));
  }
}

std::shared_ptr<const Brick> ReadContents(SnapshotReader& in) {
  auto brick = std::make_shared<Brick>();
  size_t count = 0;
  for (int local = 0; local < Brick::kVoxels; ++local) {
    const auto state = in.Fixed<uint8_t>();
    if (state >= kVoxelStates) in.Fail();
    brick->state[static_cast<size_t>(local)] = static_cast<VoxelState>(state);
    if (!HasArea(static_cast<VoxelState>(state))) continue;
    brick->surface_mask[static_cast<size_t>(local / 64)] |= uint64_t{1} << (local % 64);
    ++count;
  }
  if (!in.ok()) return brick;
  brick->surface.resize(count);
  for (SurfaceVoxel& voxel : brick->surface) {
    in.Matrix(voxel.centroid);
    in.Matrix(voxel.normal);
    voxel.area = in.Fixed<float>();
    voxel.density = in.Fixed<float>();
    voxel.samples = static_cast<uint32_t>(in.Varint());
    voxel.missed = in.Fixed<uint8_t>();
    voxel.obtained = in.Fixed<uint8_t>();
    const auto flags = in.Fixed<uint8_t>();
    voxel.ambiguous = (flags & 1) != 0;
    voxel.given_up = (flags & 2) != 0;
  }
  return brick;
}

void WriteLeaf(const MergedBrick& leaf, SnapshotWriter& out) {
  out.Fixed(static_cast<uint8_t>(leaf.united != nullptr ? 1 : 0));
  if (leaf.united != nullptr) {
    WriteMasksAndSums(leaf.united->empty, leaf.united->surface, leaf.united->sums, out);
  }
  out.Varint(leaf.fitted.size());
  for (const LocalPlane& plane : leaf.fitted) WritePlane(plane, out);
  out.Varint(leaf.plane.size());
  for (size_t i = 0; i < leaf.plane.size(); ++i) {
    const bool own = i < leaf.fitted.size() && Same(leaf.plane[i], leaf.fitted[i]);
    out.Fixed(static_cast<uint8_t>(own ? 0 : 1));
    if (!own) WritePlane(leaf.plane[i], out);
  }
  out.Varint(leaf.dominated.size());
  out.Raw(leaf.dominated.data(), leaf.dominated.size());
  out.Varint(leaf.absorbed.size());
  out.Raw(leaf.absorbed.data(), leaf.absorbed.size());
  WriteContents(*leaf.contents, out);
}

ModelLeaf ReadLeaf(SnapshotReader& in) {
  auto leaf = std::make_shared<MergedBrick>();
  if (in.Fixed<uint8_t>() != 0) {
    auto united = std::make_shared<UnitedBrick>();
    ReadMasksAndSums(in, united->empty, united->surface, united->sums);
    leaf->united = std::move(united);
  }
  const size_t surfaces = leaf->united == nullptr ? 0 : leaf->united->sums.size();
  // Each part is there for all surface voxels or for none.
  const auto parts = [&](size_t least) {
    const size_t count = in.Count(least);
    if (count != 0 && count != surfaces) in.Fail();
    return in.ok() ? count : 0;
  };
  leaf->fitted.resize(parts(8 * sizeof(float)));
  for (LocalPlane& plane : leaf->fitted) plane = ReadPlane(in);
  leaf->plane.resize(parts(1));
  for (size_t i = 0; i < leaf->plane.size(); ++i) {
    const bool own = in.Fixed<uint8_t>() == 0;
    if (own && leaf->fitted.empty()) in.Fail();
    if (!in.ok()) return leaf;
    leaf->plane[i] = own ? leaf->fitted[i] : ReadPlane(in);
  }
  leaf->dominated.resize(parts(1));
  for (uint8_t& dominated : leaf->dominated) dominated = in.Fixed<uint8_t>();
  leaf->absorbed.resize(parts(1));
  for (int8_t& into : leaf->absorbed) {
    into = in.Fixed<int8_t>();
    constexpr int kAround = 125;
    if (into < -1 || into >= kAround) in.Fail();
  }
  // All or none of what follows from the neighbourhood.
  if (leaf->plane.size() != leaf->fitted.size() || leaf->dominated.size() != leaf->plane.size() ||
      leaf->absorbed.size() != leaf->plane.size() || leaf->plane.size() != surfaces) {
    in.Fail();
  }
  leaf->contents = ReadContents(in);
  return leaf;
}

}  // namespace

void WriteMasksAndSums(const BrickMask& empty, const BrickMask& surface,
                       std::span<const SurfaceSums> sums, SnapshotWriter& out) {
  WriteMask(empty, out);
  WriteMask(surface, out);
  for (const SurfaceSums& sum : sums) {
    out.Varint(sum.samples);
    out.Varint(sum.points - sum.samples);
    for (const uint64_t value : sum.sample_sum) out.Varint(value);
    for (size_t i = 0; i < 3; ++i) out.Varint(sum.point_sum[i] - sum.sample_sum[i]);
    for (const uint64_t value : sum.product_sum) out.Varint(value);
  }
}

void ReadMasksAndSums(SnapshotReader& in, BrickMask& empty, BrickMask& surface,
                      std::vector<SurfaceSums>& sums) {
  empty = ReadMask(in);
  surface = ReadMask(in);
  for (size_t w = 0; w < empty.word.size(); ++w) {
    if ((empty.word[w] & surface.word[w]) != 0) in.Fail();
  }
  if (!in.ok()) return;
  sums.resize(static_cast<size_t>(surface.Count()));
  for (SurfaceSums& sum : sums) {
    sum.samples = static_cast<uint32_t>(in.Varint());
    sum.points = sum.samples + static_cast<uint32_t>(in.Varint());
    for (uint64_t& value : sum.sample_sum) value = in.Varint();
    for (size_t i = 0; i < 3; ++i) sum.point_sum[i] = sum.sample_sum[i] + in.Varint();
    for (uint64_t& value : sum.product_sum) value = in.Varint();
    // A plane cannot be fitted to no points.
    if (sum.points == 0) in.Fail();
  }
}

std::string WriteLeaves(std::span<const KeyedLeaf> leaves, const ModelLeaf& all_empty) {
  SnapshotWriter out;
  out.Varint(leaves.size());
  BrickKey last = 0;
  for (const KeyedLeaf& at : leaves) {
    const BrickKey key = KeyOf(at.brick);
    out.Varint(key - last);
    last = key;
    out.Fixed(static_cast<uint8_t>(at.leaf == all_empty ? kAll : kMixed));
    if (at.leaf != all_empty) WriteLeaf(*at.leaf, out);
  }
  return out.Take();
}

std::optional<std::vector<KeyedLeaf>> ReadLeaves(absl::string_view bytes,
                                                 const ModelLeaf& all_empty) {
  SnapshotReader in(bytes);
  std::vector<KeyedLeaf> leaves(in.Count(2));
  BrickKey key = 0;
  for (size_t i = 0; i < leaves.size() && in.ok(); ++i) {
    const uint64_t step = in.Varint();
    if ((i > 0 && step == 0) || step > ~key) in.Fail();
    key += step;
    leaves[i].brick = BrickOf(key);
    if (!IsInOctree(leaves[i].brick) || KeyOf(leaves[i].brick) != key) in.Fail();
    const auto shape = in.Fixed<uint8_t>();
    if (shape != kAll && shape != kMixed) in.Fail();
    leaves[i].leaf = shape == kAll ? all_empty : ReadLeaf(in);
  }
  if (!in.ok() || in.left() > 0) return std::nullopt;
  return leaves;
}

}  // namespace vantage
