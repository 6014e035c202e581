#include "core/site_prior/obj.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <exception>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace vantage::site_prior {
namespace {

// Nothing is there but what is in memory: a confined reader that opened a file would be ended.
class NoFiles final : public Assimp::IOSystem {
 public:
  bool Exists(const char* /*file*/) const override { return false; }
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* /*file*/, const char* /*mode*/) override { return nullptr; }
  void Close(Assimp::IOStream* /*file*/) override {}
};

// An OBJ has no transforms: all meshes lie in its own frame.
PriorMesh Gather(const aiScene& scene) {
  PriorMesh mesh;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& part = *scene.mMeshes[m];
    const auto first = static_cast<uint32_t>(mesh.vertices.size());
    for (unsigned v = 0; v < part.mNumVertices; ++v) {
      mesh.vertices.emplace_back(static_cast<float>(part.mVertices[v].x),
                                 static_cast<float>(part.mVertices[v].y),
                                 static_cast<float>(part.mVertices[v].z));
    }
    for (unsigned f = 0; f < part.mNumFaces; ++f) {
      const aiFace& face = part.mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines
      mesh.triangles.push_back(
          {first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
    }
  }
  return mesh;
}

}  // namespace

absl::StatusOr<PriorMesh> ParseObj(absl::string_view bytes) {
  try {
    Assimp::Importer importer;
    importer.SetIOHandler(new NoFiles);  // the importer's
    const aiScene* scene = importer.ReadFileFromMemory(
        bytes.data(), bytes.size(), aiProcess_Triangulate | aiProcess_JoinIdenticalVertices, "obj");
    if (scene == nullptr) {
      return absl::InvalidArgumentError(absl::StrCat("OBJ: ", importer.GetErrorString()));
    }
    return Gather(*scene);
  } catch (const std::exception& e) {
    return absl::InvalidArgumentError(absl::StrCat("OBJ: ", e.what()));
  }
}

}  // namespace vantage::site_prior
