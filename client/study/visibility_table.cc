#include "client/study/visibility_table.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>
#include <system_error>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/library/error.h"
#include "client/simulated_job/placement.h"
#include "client/study/job_store.h"
#include "client/study/place_file.h"

namespace vantage::study {
namespace {

constexpr char kMagic[] = "\x93NUMPY\x01";  // and a zero: version 1.0
constexpr size_t kMagicBytes = 8;
constexpr size_t kMostCandidates = 65'535;
constexpr size_t kMostSamples = 200'000;
constexpr size_t kMostCells = 4'000'000'000;

std::string VisibilityPath(const std::string& folder) { return folder + "/visibility.npy"; }
std::string CandidatePath(const std::string& folder) { return folder + "/candidates.csv"; }

// The samples that are set, in order.
std::vector<size_t> Elements(const simulation::SampleSet& set) {
  std::vector<size_t> elements;
  for (size_t e = 0; e < 64 * set.size(); ++e) {
    if ((set[e / 64] >> (e % 64) & 1) != 0) elements.push_back(e);
  }
  return elements;
}

// Candidates and samples by the header of a .npy file.
absl::StatusOr<std::pair<size_t, size_t>> ReadHeader(std::ifstream& file, const std::string& path) {
  const auto wrong = [&](absl::string_view what) {
    return client::WithFix(
        absl::InvalidArgumentError(absl::StrCat(path, ": ", what)),
        "write it with NumPy: save(path, table.astype(bool)), candidates x samples");
  };
  std::string magic(kMagicBytes, 0);
  unsigned char size[2] = {};
  if (!file.read(magic.data(), kMagicBytes) || !file.read(reinterpret_cast<char*>(size), 2) ||
      magic != std::string(kMagic, kMagicBytes)) {
    return wrong("it is no file of NumPy's format 1.0");
  }
  std::string header(size[0] + 256U * size[1], 0);
  if (!file.read(header.data(), static_cast<std::streamsize>(header.size()))) {
    return wrong("it ends within its header");
  }
  if (header.find("'descr': '|b1'") == std::string::npos) return wrong("its type is not '|b1'");
  if (header.find("'fortran_order': False") == std::string::npos) {
    return wrong("it is not in C order");
  }
  std::smatch shape;
  size_t candidates = 0;
  size_t samples = 0;
  if (!std::regex_search(header, shape, std::regex("'shape': \\(([0-9]+), ([0-9]+)\\)")) ||
      !absl::SimpleAtoi(shape[1].str(), &candidates) ||
      !absl::SimpleAtoi(shape[2].str(), &samples)) {
    return wrong("it has no shape of candidates x samples");
  }
  if (candidates == 0 || samples == 0) return wrong("there is nothing in it");
  if (candidates > kMostCandidates || samples > kMostSamples || candidates * samples > kMostCells) {
    return wrong(
        absl::StrFormat("%d candidates x %d samples are too many: at most %d, %d and %d "
                        "of both",
                        candidates, samples, kMostCandidates, kMostSamples, kMostCells));
  }
  return std::pair(candidates, samples);
}

}  // namespace

VisibilityTable MakeVisibilityTable(const StudyScene& scene, double lattice,
                                    std::optional<size_t> start_position) {
  const Eigen::Vector3d origin = scene.site().mesh.Bounds().min();
  const std::vector<size_t> elements = Elements(scene.attainable());
  VisibilityTable table;
  table.samples = elements.size();
  for (size_t i = 0; i < scene.positions().size(); ++i) {
    const Eigen::Vector2d cell = (scene.positions()[i] - origin).head<2>() / lattice;
    const bool on = (cell - cell.array().round().matrix()).cwiseAbs().maxCoeff() < 0.1;
    if (!on && i != start_position) continue;
    if (i == start_position) table.start = table.candidates.size();
    table.candidates.push_back(scene.positions()[i]);
    simulation::SampleSet set((elements.size() + 63) / 64, 0);
    for (size_t k = 0; k < elements.size(); ++k) {
      const uint64_t bit = scene.sets()[i][elements[k] / 64] >> (elements[k] % 64) & 1;
      set[k / 64] |= bit << (k % 64);
    }
    table.sees.push_back(std::move(set));
  }
  return table;
}

absl::Status WriteVisibilityTable(const VisibilityTable& table, const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return absl::PermissionDeniedError(
        absl::StrCat("cannot make the folder ", folder, ": ", error.message()));
  }
  std::string bytes =
      absl::StrFormat("{'descr': '|b1', 'fortran_order': False, 'shape': (%d, %d), }",
                      table.candidates.size(), table.samples);
  // The header ends with a line end and, with what stands before it, at a multiple of 64 bytes.
  while ((kMagicBytes + 2 + bytes.size() + 1) % 64 != 0) bytes += ' ';
  bytes += '\n';
  const size_t size = bytes.size();
  bytes.insert(0, {static_cast<char>(size % 256), static_cast<char>(size / 256)});
  bytes.insert(0, std::string(kMagic, kMagicBytes));
  for (const simulation::SampleSet& set : table.sees) {
    for (size_t k = 0; k < table.samples; ++k) {
      bytes += static_cast<char>(set[k / 64] >> (k % 64) & 1);
    }
  }
  if (absl::Status s = WritePlaces(CandidatePath(folder), table.candidates); !s.ok()) return s;
  return WriteWhole(VisibilityPath(folder), bytes);
}

absl::StatusOr<VisibilityTable> ReadVisibilityTable(const std::string& folder) {
  VisibilityTable table;
  auto candidates = ReadPlaces(CandidatePath(folder));
  if (!candidates.ok()) return candidates.status();
  const std::string path = VisibilityPath(folder);
  std::ifstream file(path, std::ios::binary);
  if (!file) return absl::NotFoundError(absl::StrCat("cannot read ", path));
  const auto shape = ReadHeader(file, path);
  if (!shape.ok()) return shape.status();
  if (shape->first != candidates->size()) {
    return absl::InvalidArgumentError(absl::StrFormat("%s has %d candidates, and %s %d", path,
                                                      shape->first, CandidatePath(folder),
                                                      candidates->size()));
  }
  table.candidates = *std::move(candidates);
  table.samples = shape->second;
  std::string row(table.samples, 0);
  for (size_t i = 0; i < shape->first; ++i) {
    if (!file.read(row.data(), static_cast<std::streamsize>(row.size()))) {
      return absl::InvalidArgumentError(
          absl::StrFormat("%s ends within the row of candidate %d of %d", path, i, shape->first));
    }
    simulation::SampleSet set((table.samples + 63) / 64, 0);
    for (size_t k = 0; k < row.size(); ++k) {
      if (row[k] != 0) set[k / 64] |= uint64_t{1} << (k % 64);
    }
    table.sees.push_back(std::move(set));
  }
  if (file.peek() != std::ifstream::traits_type::eof()) {
    return absl::InvalidArgumentError(absl::StrCat(path, " goes on after its last candidate"));
  }
  return table;
}

}  // namespace vantage::study
