// main() of tests that read priors as a server does: it can be executed again as their reader.
#include <gtest/gtest.h>

#include "core/confinement/reader.h"
#include "core/site_prior/confined_prior.h"

int main(int argc, char** argv) {
  vantage::confinement::RunIfReader(argc, argv, {vantage::site_prior::SitePriorReader()});
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
