#include "core/model/merge/shared_reflections.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <set>
#include <utility>

#include "core/model/view/algorithm_version.h"

namespace vantage::model {
namespace {

Eigen::Isometry3d FromTo(const ScanLayer& scan, const ScanLayer& witness) {
  if (&scan == &witness) return Eigen::Isometry3d::Identity();
  return witness.T_model_scan.inverse(Eigen::Isometry) * scan.T_model_scan;
}

}  // namespace

void SharedReflections::Add(const std::string& id, const Layers& layers,
                            parallel::Parallel& parallel) {
  const ScanLayer& added = *layers.at(id);
  if (added.algorithm_version < kSuspectsReflectors) return;
  std::vector<Suspect>& own = suspects_[id];
  for (const SuspectedReflector& suspect : added.suspects) {
    own.push_back({suspect.aperture.InFrame(added.T_model_scan), {{id, suspect.plane}}, {}, {}});
  }
  struct Fit {
    const std::string* of;
    const std::string* witness;
    size_t suspect;
    std::optional<WitnessFit> fit;
  };
  std::vector<Fit> fits;
  for (const auto& [other, layer] : layers) {
    if (other == id || layer->algorithm_version < kSuspectsReflectors) continue;
    for (size_t i = 0; i < added.suspects.size(); ++i) fits.push_back({&id, &other, i, {}});
    for (size_t i = 0; i < layer->suspects.size(); ++i) fits.push_back({&other, &id, i, {}});
  }
  parallel.For(fits.size(), [&](size_t i) {
    const ScanLayer& scan = *layers.at(*fits[i].of);
    const ScanLayer& witness = *layers.at(*fits[i].witness);
    fits[i].fit = FitByWitness(scan.suspects[fits[i].suspect], scan.range_surface,
                               witness.range_surface, FromTo(scan, witness));
  });
  for (const Fit& fit : fits) {
    if (!fit.fit) continue;
    Suspect& suspect = suspects_[*fit.of][fit.suspect];
    suspect.planes.emplace(*fit.witness, fit.fit->plane);
    suspect.agree.emplace(*fit.witness, fit.fit->agree);
  }
  Ask(layers, parallel);
}

void SharedReflections::Remove(const std::string& id, const Layers& layers,
                               parallel::Parallel& parallel) {
  suspects_.erase(id);
  for (auto& [other, suspects] : suspects_) {
    for (Suspect& suspect : suspects) {
      suspect.planes.erase(id);
      suspect.agree.erase(id);
      suspect.judged.erase(id);
      for (auto& [by, testimonies] : suspect.judged) testimonies.erase(id);
    }
  }
  Ask(layers, parallel);
}

void SharedReflections::Ask(const Layers& layers, parallel::Parallel& parallel) {
  constexpr size_t kMostFits = 2;  // of a suspect: each is asked of all scans
  struct Question {
    const std::string* of;
    size_t suspect;
    const std::string* by;
    const std::string* asked;
    Testimony answer;
  };
  std::vector<Question> questions;
  for (auto& [id, suspects] : suspects_) {
    for (size_t i = 0; i < suspects.size(); ++i) {
      Suspect& suspect = suspects[i];
      std::vector<std::pair<size_t, std::string>> best;  // the most agreement first
      for (const auto& [by, agree] : suspect.agree) best.emplace_back(agree, by);
      std::stable_sort(best.begin(), best.end(),
                       [](const auto& a, const auto& b) { return a.first > b.first; });
      if (best.size() > kMostFits) best.resize(kMostFits);
      std::set<std::string> judged = {id};
      for (const auto& [agree, by] : best) judged.insert(by);
      std::erase_if(suspect.judged, [&](const auto& one) { return !judged.contains(one.first); });
      for (const std::string& by : judged) {
        const auto plane = suspect.planes.find(by);
        const Testimonies& told = suspect.judged[by];
        for (const auto& [asked, layer] : layers) {
          if (layer->algorithm_version < kSuspectsReflectors || told.contains(asked)) continue;
          questions.push_back({&id, i, &plane->first, &asked, {}});
        }
      }
    }
  }
  parallel.For(questions.size(), [&](size_t i) {
    Question& question = questions[i];
    const ScanLayer& scan = *layers.at(*question.of);
    const ScanLayer& witness = *layers.at(*question.asked);
    const ReflectingPlane& plane =
        suspects_.at(*question.of)[question.suspect].planes.at(*question.by);
    question.answer = Testify(scan.suspects[question.suspect], plane, scan.range_surface,
                              witness.range_surface, FromTo(scan, witness));
  });
  for (Question& question : questions) {
    suspects_[*question.of][question.suspect].judged[*question.by][*question.asked] =
        std::move(question.answer);
  }
}

std::vector<Aperture> SharedReflections::Apertures() const {
  std::vector<Aperture> apertures;
  for (const auto& [own, suspects] : suspects_) {
    const std::string& id = own;
    for (const Suspect& suspect : suspects) {
      const bool told =
          std::any_of(suspect.judged.begin(), suspect.judged.end(), [&](const auto& one) {
            std::vector<const Testimony*> others;
            for (const auto& [other, testimony] : one.second) {
              if (other != id) others.push_back(&testimony);
            }
            return IsReflector(one.second.at(id), others);
          });
      if (told) apertures.push_back(suspect.aperture);
    }
  }
  return apertures;
}

}  // namespace vantage::model
