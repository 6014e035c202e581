#include "core/model/merge/shared_reflections.h"

#include <utility>

#include "core/model/view/algorithm_version.h"

namespace vantage::model {

void SharedReflections::Add(const std::string& id, const Layers& layers,
                            parallel::Parallel& parallel) {
  const ScanLayer& added = *layers.at(id);
  if (added.algorithm_version < kSuspectsReflectors) return;
  std::vector<Suspect>& own = suspects_[id];
  for (const SuspectedReflector& suspect : added.suspects) {
    own.push_back({suspect.aperture.InFrame(added.T_model_scan), {}});
  }
  struct Question {
    const std::string* of;
    const std::string* asked;
    size_t suspect;
    Testimony answer;
  };
  std::vector<Question> questions;
  for (const auto& [other, layer] : layers) {
    if (layer->algorithm_version < kSuspectsReflectors) continue;
    for (size_t i = 0; i < added.suspects.size(); ++i) questions.push_back({&id, &other, i, {}});
    if (other == id) continue;
    for (size_t i = 0; i < layer->suspects.size(); ++i) questions.push_back({&other, &id, i, {}});
  }
  parallel.For(questions.size(), [&](size_t i) {
    Question& question = questions[i];
    const ScanLayer& scan = *layers.at(*question.of);
    const ScanLayer& witness = *layers.at(*question.asked);
    question.answer =
        Testify(scan.suspects[question.suspect], scan.range_surface, witness.range_surface,
                question.of == question.asked
                    ? Eigen::Isometry3d::Identity()
                    : witness.T_model_scan.inverse(Eigen::Isometry) * scan.T_model_scan);
  });
  for (Question& question : questions) {
    suspects_[*question.of][question.suspect].testimony[*question.asked] =
        std::move(question.answer);
  }
}

void SharedReflections::Remove(const std::string& id) {
  suspects_.erase(id);
  for (auto& [other, suspects] : suspects_) {
    for (Suspect& suspect : suspects) suspect.testimony.erase(id);
  }
}

std::vector<Aperture> SharedReflections::Apertures() const {
  std::vector<Aperture> apertures;
  for (const auto& [id, suspects] : suspects_) {
    for (const Suspect& suspect : suspects) {
      std::vector<const Testimony*> others;
      for (const auto& [other, testimony] : suspect.testimony) {
        if (other != id) others.push_back(&testimony);
      }
      if (IsReflector(suspect.testimony.at(id), others)) apertures.push_back(suspect.aperture);
    }
  }
  return apertures;
}

}  // namespace vantage::model
