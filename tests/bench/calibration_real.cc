#include "tests/bench/calibration_real.h"

#include <array>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "core/model/partial_model.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/levelling.h"
#include "core/registration/registration.h"
#include "core/sensor/imported_scan.h"
#include "core/sensor/scan_file.h"
#include "core/simulation/random_sequence.h"

namespace vantage::bench {
namespace {

Eigen::Vector3d RandomDirection(simulation::RandomSequence& random) {
  while (true) {
    const double x = random.Between(-1, 1);
    const double y = random.Between(-1, 1);
    const double z = random.Between(-1, 1);
    const Eigen::Vector3d v(x, y, z);
    if (v.norm() > 0.1 && v.norm() <= 1) return v.normalized();
  }
}

// T_scan1_scan2 as published with the data.
bool ReadReference(const std::string& path, Eigen::Isometry3d& pose) {
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string name;
    words >> name;
    if (name != "room_scan2") continue;
    Eigen::Matrix4d m;
    for (int i = 0; i < 16; ++i) words >> m(i / 4, i % 4);
    if (!words) return false;
    pose.linear() = Eigen::Quaterniond(Eigen::Matrix3d(m.topLeftCorner<3, 3>()))
                        .normalized()
                        .toRotationMatrix();
    pose.translation() = m.topRightCorner<3, 1>();
    return true;
  }
  return false;
}

}  // namespace

std::vector<CalibrationPair> MeasureRealPairs(int priors, parallel::Parallel& parallel,
                                              std::string& why_not) {
  std::vector<CalibrationPair> pairs;
  const char* data = std::getenv("VANTAGE_SHARED_DATA");
  if (data == nullptr) {
    why_not = "VANTAGE_SHARED_DATA is not set";
    return pairs;
  }
  const std::string folder = absl::StrCat(data, "/pcl_room_scan/");
  std::array<sensor::Scan, 2> scans;
  for (size_t i = 0; i < scans.size(); ++i) {
    const auto imported = sensor::ReadScanFile(absl::StrCat(folder, "room_scan", i + 1, ".ptx"),
                                               sensor::ImportLimits());
    if (!imported.ok()) {
      why_not = std::string(imported.status().message());
      return pairs;
    }
    scans[i].image = imported->image;
    scans[i].scanner = imported->scanner;
  }
  Eigen::Isometry3d T_scan1_scan2 = Eigen::Isometry3d::Identity();
  if (!ReadReference(folder + "poses.txt", T_scan1_scan2)) {
    why_not = folder + "poses.txt has no pose of room_scan2";
    return pairs;
  }
  registration::RegistrationConfig config;
  config.required_accuracy = kRealAccuracy;
  for (size_t first = 0; first < 2; ++first) {
    const auto level = registration::LevelFirstScan(scans[first]);
    auto model = model::PartialModel::Create({});
    if (!level.ok() || !model.ok() ||
        !(*model)->Insert("first", scans[first], level->T_world_scan, parallel).ok()) {
      why_not = "the first scan makes no model";
      return pairs;
    }
    const Eigen::Isometry3d truth =
        level->T_world_scan * (first == 0 ? T_scan1_scan2 : T_scan1_scan2.inverse());
    simulation::RandomSequence random(20 + first);
    for (int k = 0; k < priors; ++k) {
      CalibrationPair pair;
      pair.family = absl::StrCat("real ", first + 1, " to ", 2 - first);
      pair.pair = k;
      pair.prior_metres = random.Between(0, 0.5);
      pair.prior_degrees = random.Between(0, 15);
      sensor::PosePrior prior;
      prior.T_world_scan = truth;
      prior.T_world_scan.linear() =
          Eigen::AngleAxisd(sensor::Radians(pair.prior_degrees), RandomDirection(random)) *
          truth.linear();
      prior.T_world_scan.translation() += pair.prior_metres * RandomDirection(random);
      const auto aligned =
          registration::Register(*(*model)->Publish(), scans[1 - first], prior, config, parallel);
      if (!aligned.ok()) continue;
      RecordAlignment(*aligned, truth,
                      OverlapBox(*(*model)->Publish(), scans[1 - first], truth, parallel), pair);
      pairs.push_back(std::move(pair));
    }
  }
  return pairs;
}

}  // namespace vantage::bench
