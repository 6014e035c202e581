// What is required of a registration, and what it may assume.
#ifndef VANTAGE_CORE_REGISTRATION_ALIGN_REGISTRATION_CONFIG_H_
#define VANTAGE_CORE_REGISTRATION_ALIGN_REGISTRATION_CONFIG_H_

#include "absl/status/status.h"
#include "core/registration/align/instrument_residuals.h"

namespace vantage::registration {

struct RegistrationConfig {
  double required_accuracy = 0.010;  // m at 95 %, > 0
  double minimum_overlap = 0.10;     // share of the new scan's samples, (0, 1)
  double correlation_length = 0.5;   // m, of residuals
  double correlated_sigma = 0.002;   // m, sigma_c, the part that averaging does not remove
  // rad, noise of estimated normals, one sigma: at a noise of 3 mm that of four samples 4 cm (rms)
  // from their middle. When matched normals differ by more, their difference counts (Qualify()).
  double normal_sigma = 0.035;
  double sample_spacing = 0.05;     // m, the scan is thinned to this before aligning
  double max_correspondence = 0.5;  // m, at the start of the alignment; shrinks
  // One sigma of the inclinometer that planned scans will have, rad; 0: none. A scan that was made
  // has its own in its prior.
  double levelled_sigma = 0;
  // One sigma, for each axis, of the positions that the pose priors of planned scans will have, m;
  // 0: they are guesses. A scan that was made has its own in its prior.
  double prior_sigma = 0;
  // One sigma of their headings, rad; 0: they are guesses, which the bound takes to 0.3 rad as an
  // alignment does, and which are right to 15 degrees (PriorReach).
  double prior_heading_sigma = 0;
  // What scans of this instrument have shown beyond its data sheet: counts in the bounds of planned
  // scans and of those that are made. Empty: nothing is known but the sheet.
  InstrumentResiduals instrument;
  int draws = 256;    // of the error bound's Monte Carlo
  unsigned seed = 1;  // of those draws, and printed with them

  absl::Status Validate() const;
};

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_ALIGN_REGISTRATION_CONFIG_H_
