#include "core/model/snapshot/snapshot.h"

#include <algorithm>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/bytes/byte_order.h"
#include "core/bytes/checksum.h"
#include "core/bytes/compression.h"
#include "core/model/snapshot/layer_codec.h"
#include "core/model/snapshot/snapshot_bricks.h"
#include "core/model/snapshot/snapshot_bytes.h"
#include "core/model/snapshot/snapshot_header.h"
#include "core/model/view/algorithm_version.h"

namespace vantage::model {
namespace {

constexpr size_t kBricksPerSection = 2048;
constexpr int kLevel = 1;  // higher ones save a tenth of the bytes for three times the time

enum Kind : uint32_t { kSite = 1, kLayer = 2, kBricks = 3 };

struct Section {
  uint32_t kind = 0;
  uint32_t crc32c = 0;
  uint64_t size = 0;
  uint64_t decompressed = 0;
  absl::string_view bytes;
};

std::string WriteSite(const SavedSite& site, const std::vector<std::string>& order) {
  SnapshotWriter out;
  out.Fixed(site.config.voxel_size);
  out.Fixed(site.config.discontinuity_angle);
  out.Matrix(site.config.max_half_extent);
  out.Varint(site.version);
  out.Varint(order.size());
  for (const std::string& id : order) out.Text(id);
  return out.Take();
}

absl::Status ReadSite(absl::string_view bytes, ModelParts& parts) {
  SnapshotReader in(bytes);
  ModelConfig& config = parts.site.config;
  config.voxel_size = in.Fixed<double>();
  config.discontinuity_angle = in.Fixed<double>();
  in.Matrix(config.max_half_extent);
  parts.site.version = in.Varint();
  parts.order.resize(in.Count(1));
  for (std::string& id : parts.order) id = in.Text();
  if (!in.ok() || in.left() > 0) return SnapshotDamaged("what it says of the site is unreadable");
  if (!config.Validate().ok()) return SnapshotDamaged("its model configuration is impossible");
  const std::set<std::string> ids(parts.order.begin(), parts.order.end());
  if (ids.size() != parts.order.size()) return SnapshotDamaged("two of its scans have one id");
  return absl::OkStatus();
}

// Of a snapshot whose header is as it should be.
absl::StatusOr<std::vector<Section>> ReadSections(absl::string_view bytes) {
  const auto count = bytes::LoadLittleEndian<uint32_t>(bytes.data() + 12);
  std::vector<Section> sections(count);
  size_t at = kSnapshotHeadSize + count * kSnapshotEntrySize + kSnapshotChecksumSize;
  for (size_t i = 0; i < count; ++i) {
    const char* entry = bytes.data() + kSnapshotHeadSize + i * kSnapshotEntrySize;
    Section& section = sections[i];
    section.kind = bytes::LoadLittleEndian<uint32_t>(entry);
    section.crc32c = bytes::LoadLittleEndian<uint32_t>(entry + 4);
    section.size = bytes::LoadLittleEndian<uint64_t>(entry + 8);
    section.decompressed = bytes::LoadLittleEndian<uint64_t>(entry + 16);
    if (section.size > bytes.size() - at) return SnapshotDamaged("it is cut short");
    section.bytes = bytes.substr(at, static_cast<size_t>(section.size));
    at += section.bytes.size();
  }
  if (at != bytes.size()) return SnapshotDamaged("it is longer than it says");
  return sections;
}

}  // namespace

std::string EncodeSnapshot(const SavedSite& site, const std::vector<std::string>& order,
                           const std::map<std::string, std::unique_ptr<ScanLayer>>& layers,
                           const std::vector<BrickAt>& bricks, const ModelLeaf& all_empty,
                           parallel::Parallel& parallel) {
  std::vector<const ScanLayer*> all;
  all.reserve(order.size());
  for (const std::string& id : order) all.push_back(layers.at(id).get());
  const size_t runs = (bricks.size() + kBricksPerSection - 1) / kBricksPerSection;
  const size_t count = 1 + all.size() + runs;
  std::vector<Section> sections(count);
  std::vector<std::string> frames(count);
  parallel.For(count, [&](size_t i) {
    std::string bytes;
    if (i == 0) {
      sections[i].kind = kSite;
      bytes = WriteSite(site, order);
    } else if (i <= all.size()) {
      sections[i].kind = kLayer;
      bytes = LayerCodec::Write(*all[i - 1]);
    } else {
      sections[i].kind = kBricks;
      const size_t first = (i - 1 - all.size()) * kBricksPerSection;
      bytes = WriteBricks(
          std::span(bricks).subspan(first, std::min(kBricksPerSection, bricks.size() - first)),
          all_empty);
    }
    sections[i].decompressed = bytes.size();
    frames[i] = bytes::ZstdCompress(bytes, kLevel);
    sections[i].crc32c = bytes::Crc32c(frames[i]);
  });
  SnapshotWriter out;
  out.Raw(kSnapshotMagic, kSnapshotMagicSize);
  out.Fixed(kSnapshotFormatVersion);
  out.Fixed(uint16_t{0});
  out.Fixed(site.algorithm_version);
  out.Fixed(static_cast<uint32_t>(count));
  for (size_t i = 0; i < count; ++i) {
    out.Fixed(sections[i].kind);
    out.Fixed(sections[i].crc32c);
    out.Fixed(uint64_t{frames[i].size()});
    out.Fixed(sections[i].decompressed);
  }
  std::string snapshot = out.Take();
  bytes::AppendLittleEndian(bytes::Crc32c(snapshot), snapshot);
  size_t size = snapshot.size();
  for (const std::string& frame : frames) size += frame.size();
  snapshot.reserve(size);
  for (std::string& frame : frames) {
    snapshot += frame;
    std::string().swap(frame);
  }
  return snapshot;
}

absl::StatusOr<ModelParts> DecodeSnapshot(absl::string_view bytes, size_t max_bytes,
                                          const ModelLeaf& all_empty,
                                          parallel::Parallel& parallel) {
  const absl::StatusOr<SnapshotHeader> header = ReadSnapshotHeader(bytes);
  if (!header.ok()) return header.status();
  const absl::StatusOr<std::vector<Section>> sections = ReadSections(bytes);
  if (!sections.ok()) return sections.status();
  uint64_t total = 0;
  for (const Section& section : *sections) {
    if (section.decompressed > max_bytes - total) {
      return absl::ResourceExhaustedError(
          absl::StrCat("snapshot: it holds more than ", max_bytes, " bytes"));
    }
    total += section.decompressed;
  }
  ModelParts parts;
  parts.site.algorithm_version = header->algorithm_version;
  std::vector<absl::Status> read(sections->size());
  std::vector<std::unique_ptr<ScanLayer>> layers(sections->size());
  std::vector<std::vector<BrickAt>> bricks(sections->size());
  const auto read_section = [&](size_t i) {
    const Section& section = (*sections)[i];
    if (bytes::Crc32c(section.bytes) != section.crc32c) {
      read[i] = SnapshotDamaged(absl::StrCat("section ", i, " is damaged"));
      return;
    }
    const absl::StatusOr<std::string> contents =
        bytes::ZstdDecompress(section.bytes, static_cast<size_t>(section.decompressed));
    if (!contents.ok()) {
      read[i] = SnapshotDamaged(contents.status().message());
    } else if ((i == 0) != (section.kind == kSite)) {
      read[i] = SnapshotDamaged("its sections are not those of a snapshot");
    } else if (section.kind == kSite) {
      read[i] = ReadSite(*contents, parts);
    } else if (section.kind == kLayer) {
      layers[i] = LayerCodec::Read(*contents, *header);
      if (layers[i] == nullptr) {
        read[i] = SnapshotDamaged("what it says of a scan is unreadable");
      } else if (layers[i]->algorithm_version > kModelAlgorithmVersion) {
        read[i] = SnapshotOfNewerAlgorithms(layers[i]->algorithm_version);
      }
    } else if (section.kind == kBricks) {
      std::optional<std::vector<BrickAt>> run =
          ReadBricks(*contents, header->format_version, parts.site.config.voxel_size, all_empty);
      if (run.has_value()) {
        bricks[i] = *std::move(run);
      } else {
        read[i] = SnapshotDamaged("what it says of the model is unreadable");
      }
    } else {
      read[i] = SnapshotDamaged("it has a section of an unknown kind");
    }
  };
  // The site first: it has the size of the voxels.
  if (!sections->empty()) read_section(0);
  parallel.For(sections->empty() ? 0 : sections->size() - 1,
               [&](size_t i) { read_section(i + 1); });
  for (const absl::Status& status : read) {
    if (!status.ok()) return status;
  }
  if (sections->empty()) return SnapshotDamaged("it is empty");
  size_t known = 0;
  for (std::unique_ptr<ScanLayer>& layer : layers) {
    if (layer == nullptr) continue;
    if (known == parts.order.size()) return SnapshotDamaged("it has more layers than scans");
    parts.layers.emplace(parts.order[known++], std::move(layer));
  }
  if (known < parts.order.size()) return SnapshotDamaged("it has fewer layers than scans");
  for (std::vector<BrickAt>& run : bricks) {
    if (!run.empty() && !parts.bricks.empty() &&
        KeyOf(run.front().brick) <= KeyOf(parts.bricks.back().brick)) {
      return SnapshotDamaged("its bricks are out of order");
    }
    std::move(run.begin(), run.end(), std::back_inserter(parts.bricks));
  }
  return parts;
}

}  // namespace vantage::model
