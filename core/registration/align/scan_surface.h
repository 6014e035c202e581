// The surface that a range image shows, as oriented points thinned evenly over space; these are
// aligned to the model (algorithm.md section 9, 'Alignment').
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_SCAN_SURFACE_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_SCAN_SURFACE_H_

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

struct SurfaceSample {
  Eigen::Vector3f point;   // m, scanner frame, on the plane through the measured neighbours
  Eigen::Vector3f normal;  // unit, scanner frame, towards the scanner
  float sigma = 0;         // m, one sigma along the normal: the instrument's, or as it is seen
  float cells = 0;         // samples of the image that it stands for
};

struct ScanSurface {
  // Spread over directions of normals and over space: any prefix is a fair, well-conditioned
  // selection (the coarse stages take the first few thousand).
  std::vector<SurfaceSample> samples;
  double image_samples = 0;      // of the whole image, those without a usable normal included
  sensor::ScannerModel scanner;  // that made it
  double roughness = 0;  // m, median distance from the neighbours' plane: noise as it is seen,
                         // quantisation included
};

// Orders samples so that any prefix is such a selection.
void SpreadSamples(std::vector<SurfaceSample>& samples);

// Thins to one sample per cube of side `spacing` (m). Samples without a plane through their
// neighbours, or beyond the scanner's maximum incidence, are left out.
ScanSurface SampleSurface(const sensor::Scan& scan, double spacing, parallel::Parallel& parallel);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_SCAN_SURFACE_H_
