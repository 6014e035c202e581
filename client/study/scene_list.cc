#include "client/study/scene_list.h"

#include <filesystem>
#include <optional>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/library/error.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/house.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/scenes/small_scenes.h"

namespace vantage::study {
namespace {

constexpr double kOfficeArea = 250;   // m^2
constexpr int kMostScansOfMesh = 60;  // of a mesh that is nobody's scene

bool IsMeshFile(const std::string& name) {
  return absl::EndsWithIgnoreCase(name, ".ply") || absl::EndsWithIgnoreCase(name, ".obj");
}

struct Kind {
  const char* name;
  simulation::Scene (*build)(uint64_t seed);
  int most_scans;
};
constexpr Kind kKinds[] = {
    {"two-rooms", simulation::TwoRooms, 12},
    {"flat", simulation::FurnishedFlat, 28},
    {"hall", simulation::PillarHall, 20},
    {"office", [](uint64_t seed) { return simulation::OfficeStorey(seed, kOfficeArea); }, 60},
    {"house", simulation::HouseOfThreeStoreys, 60}};

struct Mesh {
  const char* name;
  const char* file;
  int most_scans;
  SceneUse use;
};
constexpr Mesh kMeshes[] = {{"small-house", "small_house/scene.ply", 36, SceneUse::kTuning},
                            {"bookstore", "bookstore/scene.ply", 50, SceneUse::kReporting}};

std::string MeshPath(const Mesh& mesh, const std::string& data_folder) {
  return absl::StrCat(data_folder, "/", mesh.file);
}

struct Parsed {
  const Kind* kind = nullptr;
  uint64_t seed = 0;
  const Mesh* mesh = nullptr;
};

std::optional<Parsed> Parse(const std::string& name) {
  for (const Mesh& mesh : kMeshes) {
    if (name == mesh.name) return Parsed{nullptr, 0, &mesh};
  }
  const size_t dash = name.rfind('-');
  if (dash == std::string::npos) return std::nullopt;
  Parsed parsed;
  for (const Kind& kind : kKinds) {
    if (name.substr(0, dash) == kind.name) parsed.kind = &kind;
  }
  if (parsed.kind == nullptr || !absl::SimpleAtoi(name.substr(dash + 1), &parsed.seed)) {
    return std::nullopt;
  }
  return parsed;
}

}  // namespace

std::vector<std::string> DefaultScenes(SceneUse use, bool small) {
  const uint64_t seed = use == SceneUse::kTuning ? 1 : simulation::kFirstReportingSeed + 1;
  std::vector<std::string> names;
  for (const Kind& kind : kKinds) names.push_back(absl::StrCat(kind.name, "-", seed));
  if (small) names.resize(3);
  if (!small && use == SceneUse::kReporting) {
    for (const Mesh& mesh : kMeshes) {
      if (mesh.use == use) names.emplace_back(mesh.name);
    }
  }
  return names;
}

absl::Status CheckScene(const std::string& name, const std::string& data_folder) {
  if (absl::EndsWithIgnoreCase(name, ".obj")) {
    return client::WithFix(
        absl::InvalidArgumentError(absl::StrCat("--scene: ", name,
                                                " is an OBJ file, and a scene "
                                                "is read from PLY")),
        absl::StrCat("convert it, for instance with 'assimp export ", name, " scene.ply'"));
  }
  if (IsMeshFile(name)) {
    if (std::filesystem::exists(name)) return absl::OkStatus();
    return client::WithFix(
        absl::NotFoundError(absl::StrCat("--scene: there is no file ", name)),
        "name a mesh (PLY, metres), or a scene as 'vantage study --list' has them");
  }
  const std::optional<Parsed> parsed = Parse(name);
  if (!parsed) {
    return client::WithFix(
        absl::NotFoundError(absl::StrCat("there is no scene '", name, "'")),
        "flat-N, two-rooms-N, hall-N, office-N, house-N, small-house, bookstore, or the path of a "
        "mesh (PLY, metres)");
  }
  if (parsed->mesh == nullptr) return absl::OkStatus();
  if (data_folder.empty() || !std::filesystem::exists(MeshPath(*parsed->mesh, data_folder))) {
    return client::WithFix(
        absl::NotFoundError(absl::StrCat("scene '", name, "' is read from ", parsed->mesh->file,
                                         ", which is not in '", data_folder, "'")),
        "name the folder with --data or VANTAGE_SHARED_DATA, or choose scenes");
  }
  return absl::OkStatus();
}

absl::StatusOr<simulated_job::Site> BuildScene(const std::string& name,
                                               const std::string& data_folder) {
  if (absl::Status there = CheckScene(name, data_folder); !there.ok()) return there;
  if (IsMeshFile(name)) {
    auto site = simulated_job::MeshSite(name, std::nullopt);
    if (site.ok()) site->name = name;
    return site;
  }
  const std::optional<Parsed> parsed = Parse(name);
  if (parsed->mesh != nullptr) {
    auto site = simulated_job::MeshSite(MeshPath(*parsed->mesh, data_folder), std::nullopt);
    if (site.ok()) site->name = name;
    return site;
  }
  simulation::Scene scene = parsed->kind->build(parsed->seed);
  if (scene.starts.empty()) return absl::InternalError(absl::StrCat(name, " has no start"));
  simulated_job::Site site;
  site.name = name;
  site.floor_height = scene.floor_height;
  site.several_levels = scene.several_levels;
  site.start = scene.starts.front();
  site.mesh = std::move(scene.mesh);
  site.doorways = std::move(scene.doorways);
  site.rooms = std::move(scene.rooms);
  return site;
}

std::string JobName(const std::string& scene) {
  return IsMeshFile(scene) ? std::filesystem::path(scene).filename().string() : scene;
}

int MostScans(const std::string& scene) {
  if (IsMeshFile(scene)) return kMostScansOfMesh;
  const std::optional<Parsed> parsed = Parse(scene);
  if (!parsed) return 0;
  return parsed->mesh != nullptr ? parsed->mesh->most_scans : parsed->kind->most_scans;
}

SceneUse UseOf(const std::string& scene) {
  const std::optional<Parsed> parsed = Parse(scene);
  if (!parsed) return SceneUse::kReporting;
  return parsed->mesh != nullptr ? parsed->mesh->use : simulation::UseOfSeed(parsed->seed);
}

}  // namespace vantage::study
