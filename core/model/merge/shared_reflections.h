// Reflections that several scans tell together: what a plane shows in one of them is the mirror
// image of what others measured (algorithm.md section 4, 'Reflections').
#ifndef VANTAGE_CORE_MODEL_MERGE_SHARED_REFLECTIONS_H_
#define VANTAGE_CORE_MODEL_MERGE_SHARED_REFLECTIONS_H_

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/model/carve/scan_layer.h"
#include "core/model/reflections/aperture.h"
#include "core/model/reflections/suspected_reflector.h"
#include "core/parallel/parallel.h"

namespace vantage::model {

// A function of the set of layers. Layers of an older algorithm version have no suspects and are
// not asked about others', so that old models stay the same.
class SharedReflections {
 public:
  using Layers = std::map<std::string, std::unique_ptr<ScanLayer>>;

  // After the scan came to `layers`, and after it left them.
  void Add(const std::string& id, const Layers& layers, parallel::Parallel& parallel);
  void Remove(const std::string& id, const Layers& layers, parallel::Parallel& parallel);

  // The apertures of the suspects that all layers together show to be reflectors; model frame.
  std::vector<Aperture> Apertures() const;

 private:
  using Testimonies = std::map<std::string, Testimony>;  // by scan, its own among them
  struct Suspect {
    Aperture aperture;                              // model frame
    std::map<std::string, ReflectingPlane> planes;  // by who fitted it, its own scan among them
    std::map<std::string, size_t> agree;            // by the same, but for its own scan
    std::map<std::string, Testimonies> judged;      // of its own plane and the best of the others
  };
  // Asks each layer about each plane that is judged, unless it was asked before.
  void Ask(const Layers& layers, parallel::Parallel& parallel);

  std::map<std::string, std::vector<Suspect>> suspects_;  // by scan
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_MERGE_SHARED_REFLECTIONS_H_
