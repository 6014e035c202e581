// A prior of the site from the bytes of a file: a mesh (PLY, OBJ), or a floor plan (DXF, PNG).
#ifndef VANTAGE_CORE_SITE_PRIOR_PRIOR_FILE_H_
#define VANTAGE_CORE_SITE_PRIOR_PRIOR_FILE_H_

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/site_prior/prior_mesh.h"

namespace vantage::site_prior {

enum class PriorFormat : uint32_t { kPly = 0, kObj = 1, kDxf = 2, kPicture = 3 };

// By the content alone. INVALID_ARGUMENT: none of them.
absl::StatusOr<PriorFormat> FindPriorFormat(absl::string_view bytes);

// How a file is meant. Trivially copyable: it is the question to the confined reader.
struct PriorReading {
  // m for 1 of the file's coordinates; of a picture for a pixel. 0: it is not known, which is m of
  // a mesh, what the file says of DXF ($INSUNITS), and an error of a picture.
  double unit = 0;
  double wall_height = 2.5;  // m, of the walls of a plan
  double darkest = 0.5;      // of a picture: what is darker is wall; 0 black, 1 white
  uint32_t y_up = 0;         // 1: the y axis of a mesh points up, as in many OBJ files
  uint32_t unused = 0;
};

// All of it is INVALID_ARGUMENT that is wrong with the file or with how it is meant, in words that
// name the cure: `unit` is missing or makes no building of it, a plan has no walls or none that
// enclose a room, and CheckPrior(). RESOURCE_EXHAUSTED: larger than kMostPriorFileBytes.
absl::StatusOr<PriorMesh> ParsePrior(absl::string_view bytes, const PriorReading& reading);

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_PRIOR_FILE_H_
