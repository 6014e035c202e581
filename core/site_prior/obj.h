// Meshes from OBJ files.
#ifndef VANTAGE_CORE_SITE_PRIOR_OBJ_H_
#define VANTAGE_CORE_SITE_PRIOR_OBJ_H_

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/site_prior/prior_mesh.h"

namespace vantage::site_prior {

// By assimp, which opens no file: what an OBJ refers to is left out. In the file's unit.
// INVALID_ARGUMENT in assimp's words.
absl::StatusOr<PriorMesh> ParseObj(absl::string_view bytes);

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_OBJ_H_
