// Largest unknown volume by ray casting over OctoMap.
#ifndef VANTAGE_CLIENT_STUDY_OCTOMAP_RIVAL_H_
#define VANTAGE_CLIENT_STUDY_OCTOMAP_RIVAL_H_

#include <memory>

#include "client/study/rival.h"
#include "core/sensor/scanner_model.h"

namespace vantage::study {

// The place from which the most unknown volume is seen, by ray casting through an OctoMap of 0.1 m
// within 5 m, as next-best-view packages of robotics do; out of 80 feasible places drawn at random.
std::unique_ptr<Rival> OctomapRival(const sensor::ScannerModel& scanner);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_OCTOMAP_RIVAL_H_
