// main() of tests that read scan files or meshes as the command line does: it can be executed again
// as their reader.
#include <gtest/gtest.h>

#include "core/confinement/reader.h"
#include "core/sensor/confined_scan_file.h"
#include "core/simulation/confined_mesh.h"

int main(int argc, char** argv) {
  vantage::confinement::RunIfReader(
      argc, argv, {vantage::sensor::ScanFileReader(), vantage::simulation::MeshReader()});
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
