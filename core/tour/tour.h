// What a tour is asked, and what it answers (algorithm.md section 12).
#ifndef VANTAGE_CORE_TOUR_TOUR_H_
#define VANTAGE_CORE_TOUR_TOUR_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/fleet/fleet_member.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/plan/required_region.h"
#include "core/registration/bound/verdict.h"
#include "core/tour/ordering.h"

namespace vantage::tour {

// A view no farther than this from a station is the station, m: the stations of a tour lie on
// other viewcells when the model has grown, and nobody sets a tripod up more exactly than a few
// decimetres.
inline constexpr double kSamePlace = 0.5;

// A room that is locked but for some hours: who stands in it does so within them.
struct RoomHours {
  planning::RequiredRegion room;  // name, outline and heights count
  OpenHours open;                 // minutes after the beginning of the tour
};

struct TourRequest {
  // At least one, all of the problem's scanner model.
  std::vector<fleet::FleetMember> scanners;
  // What is wanted of the surface that can be brought to the required density at all, (0, 1].
  // Absent: nearly all of it, but for stations that bring less than
  // PlanningConfig::terminate_below beyond the others, for which a plan would send nobody.
  std::optional<double> goal;
  // No more than that, where given: then the best that can be done with it.
  std::optional<double> minutes;  // > 0, of every scanner
  std::optional<size_t> scans;    // > 0, of all scanners together
  std::vector<RoomHours> hours;
  // Minutes of a day's work, > 0. What is left then is done on the next day, which begins where
  // overlap with what was seen is strongest.
  std::optional<double> day;
  // Stations of an earlier tour that were not made yet, in their order (m, model frame). What still
  // pays of it is kept, unless a tour without it is shorter by more than one scan. Goes neither
  // with minutes or scans nor with scanners that see a sector, whose headings it does not say.
  std::vector<Eigen::Vector3d> previous;
  // Places that are chosen from, at most.
  size_t most_candidates = 1000;
};

// A scan of a tour.
struct TourStop {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m, model frame
  std::optional<double> heading;                       // rad
  size_t scanner = 0;                                  // of TourRequest::scanners
  int storey = 0;
  bool expected = false;             // nobody knows yet that a scanner can stand there
  bool kept = false;                 // of TourRequest::previous
  std::vector<Eigen::Vector3d> way;  // m, corners from where the scanner stood before
  double way_length = 0;             // m
  double wait = 0;                   // minutes, for others' scans or until the room opens
  double start = 0;                  // minutes after the beginning; days count as work only
  double end = 0;
  int day = 0;
  double area = 0;      // m^2 that it brings to the required density beyond the scans before it
  double coverage = 0;  // share of what can be had, when it is in
  registration::RegistrationVerdict verdict;  // with what the scans before it will have seen
  std::vector<size_t> registers_with;         // stops before it that it could be aligned with alone
};

// What is reached with fewer of a tour's stations: the least worthwhile are left out first.
struct WorthPoint {
  size_t scans = 0;
  double minutes = 0;
  double area = 0;      // m^2
  double coverage = 0;  // share of what can be had
};

// Surface that stays open.
struct OpenPlace {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m, of its middle
  double area = 0;                                     // m^2
};

struct Tour {
  std::vector<TourStop> stops;  // by the time at which they end
  double minutes = 0;           // until the last scan is in; of work, where there are several days
  std::vector<double> scanner_minutes;  // by scanner
  double walked = 0;                    // m, all scanners together
  double area_before = 0;               // m^2 at the required density before the first scan
  double area = 0;                      // m^2 that the tour brings to it
  double attainable = 0;                // m^2 that the candidates bring to it, all together
  double out_of_reach = 0;              // m^2 that none of them does
  double coverage_before = 0;           // area_before over area_before and attainable
  double coverage = 0;                  // the same when all scans are in
  // No choice from these candidates that reaches the goal has fewer; 0 where none was given, or
  // scans or minutes were.
  size_t fewest = 0;
  bool reaches_goal = true;
  size_t candidates = 0;
  std::vector<WorthPoint> worth;  // from one scan to all
  std::vector<OpenPlace> open;    // the largest first, ten at most
  size_t not_registering = 0;     // stations that were left out since no order makes them register
  // That scans or minutes would be enough for, and that nobody is sent to: each brings less than
  // PlanningConfig::terminate_below beyond the others.
  size_t not_worth_it = 0;
  size_t kept = 0;  // of TourRequest::previous
  uint64_t rays = 0;
  bool complete = false;  // false: it may still become better
  std::string message;    // for people: what it comes to
};

}  // namespace vantage::tour

#endif  // VANTAGE_CORE_TOUR_TOUR_H_
