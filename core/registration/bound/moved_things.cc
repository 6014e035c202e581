#include "core/registration/bound/moved_things.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/registration/align/known_surface.h"
#include "core/registration/align/voxel_search.h"

namespace vantage::registration {

bool MovedThings::Explain() const {
  // Of what it sees. At right poses, with people, cars, cupboards and doors moved, 51 of 54 scans
  // saw through less than 0.1 %, and three, from before a place where a cupboard was, through up to
  // 2 %; at wrong ones at least 3.7 % was seen through, and 6.8 % where the rest of this does not
  // decide (core/registration/experiments.md, 'What was moved between scans').
  constexpr double kMostSeenThrough = 0.025;
  // Things have sizes of their own, and what is missed nearby is blurred surface of theirs: up to
  // 9.7 % at right poses but one. A real scan turned by half about its axis misses 12 %.
  constexpr double kMostMissed = 0.1;
  // Little that is seen again says little: beside what speaks against the pose.
  constexpr double kLeastSeenAgain = 0.5;
  return seen_again >= kLeastSeenAgain * contradicting && missed_share <= kMostMissed &&
         seen_through <= kMostSeenThrough * (seen_again + seen_through);
}

bool MovedThings::SayMoreThan(const MovedThings& others) const {
  // Where a site repeats itself, a scan sees as much again a bay off; at its place it also sees
  // what is not repeated. 2.1 where the next room lay on a known one
  // (core/registration/experiments.md, 'What was moved between scans'). A choice between that
  // and 1.
  constexpr double kMoreSeenAgain = 1.5;
  // Of what is seen again, and of samples in known space; a tenth of what Explain() allows or of
  // what makes a doubt, and a fifth of the samples that it lets be missed.
  constexpr double kMostAgainst = 0.008;
  constexpr double kMostMissed = 0.02;
  return seen_again >= kMoreSeenAgain * others.seen_again &&
         contradicting <= kMostAgainst * seen_again && missed_share <= kMostMissed &&
         seen_through <= kMostAgainst * seen_again;
}

MovedThings FindMovedThings(const model::PlanningView& model, const sensor::Scan& scan,
                            const ScanSurface& surface, double spacing,
                            const Eigen::Isometry3d& T_world_scan,
                            std::span<const SurfaceSample> samples,
                            std::span<const SampleAgreement> agreements,
                            parallel::Parallel& parallel) {
  // One of 5 cm for each piece of wall within ten metres; larger pieces on larger sites.
  constexpr size_t kMostPieces = 20'000;
  MovedThings things;
  size_t known = 0;
  size_t missed = 0;
  double contradicting = 0;  // faces of cubes
  for (size_t i = 0; i < samples.size(); ++i) {
    known += agreements[i] == SampleAgreement::kNothingKnown ? 0 : 1;
    missed += agreements[i] == SampleAgreement::kMissed ? 1 : 0;
    // A plane goes through as many cubes as the projections of it along all three axes have faces.
    if (agreements[i] != SampleAgreement::kContradicts) continue;
    contradicting += 1 / static_cast<double>(samples[i].normal.lpNorm<1>());
  }
  if (known == 0) return things;
  const double stands_for =
      static_cast<double>(surface.samples.size()) / static_cast<double>(samples.size());
  things.contradicting = contradicting * stands_for * spacing * spacing;
  things.missed_share = static_cast<double>(missed) / static_cast<double>(known);
  const KnownSurface around = SurfaceIn(model, BoxOf(surface, T_world_scan), kMostPieces);
  const std::vector<SurfaceSight> sights =
      SightsOf(model, around.pieces, scan, T_world_scan, parallel);
  for (size_t i = 0; i < sights.size(); ++i) {
    const double area = static_cast<double>(around.pieces[i].area);
    if (sights[i] == SurfaceSight::kSeen) things.seen_again += area;
    if (sights[i] == SurfaceSight::kSeenThrough) things.seen_through += area;
  }
  return things;
}

}  // namespace vantage::registration
