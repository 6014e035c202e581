#include "core/registration/align/registration_config.h"

#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace vantage::registration {

absl::Status RegistrationConfig::Validate() const {
  std::vector<std::string> wrong;
  const auto require = [&wrong](bool holds, const char* what) {
    if (!holds) wrong.emplace_back(what);
  };
  // Comparisons are written so that NaN fails them.
  require(required_accuracy > 0 && required_accuracy <= 1, "required_accuracy must be in (0, 1] m");
  require(minimum_overlap > 0 && minimum_overlap < 1, "minimum_overlap must be in (0, 1)");
  require(correlation_length >= 0.05 && correlation_length <= 10,
          "correlation_length must be in [0.05, 10] m");
  require(correlated_sigma >= 0 && correlated_sigma <= 0.1,
          "correlated_sigma must be in [0, 0.1] m");
  require(normal_sigma > 0 && normal_sigma <= 0.5, "normal_sigma must be in (0, 0.5] rad");
  require(sample_spacing >= 0.01 && sample_spacing <= 0.5,
          "sample_spacing must be in [0.01, 0.5] m");
  require(max_correspondence >= 0.1 && max_correspondence <= 2,
          "max_correspondence must be in [0.1, 2] m");
  require(draws >= 20 && draws <= 100'000, "draws must be in [20, 100000]");
  require(levelled_sigma >= 0 && levelled_sigma <= 0.2, "levelled_sigma must be in [0, 0.2] rad");
  require(prior_sigma >= 0 && prior_sigma <= 10, "prior_sigma must be in [0, 10] m");
  require(prior_heading_sigma >= 0 && prior_heading_sigma <= 3.2,
          "prior_heading_sigma must be in [0, 3.2] rad");
  if (wrong.empty()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("registration: ", absl::StrJoin(wrong, "; ")));
}

}  // namespace vantage::registration
