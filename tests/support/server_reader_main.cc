// main() of tests that read strangers' files as a server does: it can be executed again as their
// reader.
#include <gtest/gtest.h>

#include "core/confinement/reader.h"
#include "core/sensor/confined_scan_file.h"
#include "core/site_prior/confined_prior.h"

int main(int argc, char** argv) {
  vantage::confinement::RunIfReader(
      argc, argv, {vantage::sensor::ScanFileReader(), vantage::site_prior::SitePriorReader()});
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
