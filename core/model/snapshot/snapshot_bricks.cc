#include "core/model/snapshot/snapshot_bricks.h"

#include <algorithm>
#include <bit>

#include "core/model/snapshot/snapshot_bytes.h"

namespace vantage::model {
namespace {

// What a mask or a leaf is, where it is simple.
constexpr size_t kDropout = 1 + 3 * sizeof(float);  // bytes, at least

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

void WriteContents(const Brick& brick, SnapshotWriter& out) {
  out.Raw(brick.state.data(), brick.state.size());
  for (const SurfaceVoxel& voxel : brick.surface) {
    out.Matrix(voxel.centroid);
    out.Matrix(voxel.normal);
    out.Fixed(voxel.area);
    out.Fixed(voxel.density);
    out.Varint(voxel.samples);
    out.Fixed(voxel.missed);
    out.Fixed(voxel.spread);
    out.Fixed(static_cast<uint8_t>((voxel.ambiguous ? 1 : 0) + (voxel.given_up ? 2 : 0)));
  }
  out.Varint(brick.dropouts.size());
  for (const Dropout& dropout : brick.dropouts) {
    out.Varint(dropout.local);
    out.Matrix(dropout.from);
  }
}

std::shared_ptr<const Brick> ReadContents(SnapshotReader& in, uint16_t format_version,
                                          const VoxelIndex& at, double voxel_size) {
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
  brick->surface = SurfaceVoxels(at, voxel_size);
  brick->surface.reserve(count);
  for (int local = 0; local < Brick::kVoxels && in.ok(); ++local) {
    const VoxelState state = brick->state[static_cast<size_t>(local)];
    if (!HasArea(state)) continue;
    SurfaceVoxel voxel;
    in.Matrix(voxel.centroid);
    in.Matrix(voxel.normal);
    voxel.area = in.Fixed<float>();
    voxel.density = in.Fixed<float>();
    voxel.samples = static_cast<uint32_t>(in.Varint());
    voxel.missed = in.Fixed<uint8_t>();
    voxel.spread = in.Fixed<uint8_t>();
    const auto flags = in.Fixed<uint8_t>();
    voxel.ambiguous = (flags & 1) != 0;
    voxel.given_up = (flags & 2) != 0;
    if (IsFalseSurface(state)) {
      brick->surface.AddFalse(voxel, local);
    } else {
      brick->surface.push_back(voxel);
    }
  }
  brick->surface.shrink_to_fit();
  if (format_version < 3) return brick;
  brick->dropouts.resize(in.Count(kDropout));
  uint32_t last = 0;
  for (Dropout& dropout : brick->dropouts) {
    dropout.local = static_cast<uint32_t>(in.Varint());
    in.Matrix(dropout.from);
    if (dropout.local >= Brick::kVoxels || dropout.local < last) in.Fail();
    last = dropout.local;
    if (!in.ok()) break;
  }
  return brick;
}

// What format 1 also said of a brick: what it was merged from.
void SkipMerged(SnapshotReader& in) {
  if (in.Fixed<uint8_t>() != 0) {
    BrickMask empty;
    BrickMask surface;
    PackedSums sums;
    ReadMasksAndSums(in, empty, surface, sums);
  }
  constexpr size_t kPlane = 8 * sizeof(float);
  in.Raw(in.Count(kPlane) * kPlane);  // fitted
  const size_t planes = in.Count(1);
  for (size_t i = 0; i < planes; ++i) {
    if (in.Fixed<uint8_t>() != 0) in.Raw(kPlane);  // not the one that was fitted
  }
  in.Raw(in.Count(1));  // dominated
  in.Raw(in.Count(1));  // absorbed
}

}  // namespace

void WriteMasksAndSums(const BrickMask& empty, const BrickMask& surface, const PackedSums& sums,
                       SnapshotWriter& out) {
  WriteMask(empty, out);
  WriteMask(surface, out);
  for (size_t i = 0; i < sums.size(); ++i) {
    const SurfaceSums sum = sums[i];
    out.Varint(sum.samples);
    out.Varint(sum.points - sum.samples);
    for (const uint64_t value : sum.sample_sum) out.Varint(value);
    for (size_t k = 0; k < 3; ++k) out.Varint(sum.point_sum[k] - sum.sample_sum[k]);
    for (const uint64_t value : sum.product_sum) out.Varint(value);
  }
}

void ReadMasksAndSums(SnapshotReader& in, BrickMask& empty, BrickMask& surface, PackedSums& sums) {
  empty = ReadMask(in);
  surface = ReadMask(in);
  for (size_t w = 0; w < empty.word.size(); ++w) {
    if ((empty.word[w] & surface.word[w]) != 0) in.Fail();
  }
  if (!in.ok()) return;
  std::vector<SurfaceSums> read(static_cast<size_t>(surface.Count()));
  for (SurfaceSums& sum : read) {
    sum.samples = static_cast<uint32_t>(in.Varint());
    sum.points = sum.samples + static_cast<uint32_t>(in.Varint());
    for (uint64_t& value : sum.sample_sum) value = in.Varint();
    for (size_t i = 0; i < 3; ++i) sum.point_sum[i] = sum.sample_sum[i] + in.Varint();
    for (uint64_t& value : sum.product_sum) value = in.Varint();
    // A plane cannot be fitted to no points.
    if (sum.points == 0) in.Fail();
  }
  sums = PackedSums(read);
}

std::string WriteBricks(std::span<const BrickAt> bricks, const ModelLeaf& all_empty) {
  SnapshotWriter out;
  out.Varint(bricks.size());
  BrickKey last = 0;
  for (const BrickAt& at : bricks) {
    const BrickKey key = KeyOf(at.brick);
    out.Varint(key - last);
    last = key;
    out.Fixed(static_cast<uint8_t>(at.contents == all_empty ? kAll : kMixed));
    if (at.contents != all_empty) WriteContents(*at.contents, out);
  }
  return out.Take();
}

std::optional<std::vector<BrickAt>> ReadBricks(absl::string_view bytes, uint16_t format_version,
                                               double voxel_size, const ModelLeaf& all_empty) {
  SnapshotReader in(bytes);
  std::vector<BrickAt> bricks(in.Count(2));
  BrickKey key = 0;
  for (size_t i = 0; i < bricks.size() && in.ok(); ++i) {
    const uint64_t step = in.Varint();
    if ((i > 0 && step == 0) || step > ~key) in.Fail();
    key += step;
    bricks[i].brick = BrickOf(key);
    if (!IsInOctree(bricks[i].brick) || KeyOf(bricks[i].brick) != key) in.Fail();
    const auto shape = in.Fixed<uint8_t>();
    if (shape != kAll && shape != kMixed) in.Fail();
    if (shape == kAll) {
      bricks[i].contents = all_empty;
      continue;
    }
    if (format_version == 1) SkipMerged(in);
    bricks[i].contents = ReadContents(in, format_version, bricks[i].brick, voxel_size);
  }
  if (!in.ok() || in.left() > 0) return std::nullopt;
  return bricks;
}

}  // namespace vantage::model
