// What a tour is asked to be like, and what of it is still to be done.
import { create } from "@bufbuild/protobuf";
import { TourWishSchema, type TourStop, type TourWish } from "../gen/vantage/v1/tour_pb";
import type { Place } from "./actions";
import { merged, type Site } from "./site";

// What is left of the day, the battery or the cards.
export type Left = { of: "all" } | { of: "minutes"; minutes: number } | { of: "scans"; scans: number };

// A scan as near as this to a stop is the stop's, m: nobody sets up a tripod better than by eye.
const sameStop = 0.8;

// Of a tour's stops those that nobody has made yet.
export function notMade<Stop extends { position?: Place }>(stops: readonly Stop[], site: Site): Stop[] {
  const made = [...merged(site).map((scan) => scan.pose?.translation), ...site.stations.map((s) => s.position)];
  const near = (a: Place, b: Place | undefined) =>
    b !== undefined && Math.hypot(a.x - b.x, a.y - b.y) < sameStop && Math.abs(a.z - b.z) < 1.5;
  return stops.filter((stop) => stop.position !== undefined && !made.some((place) => near(stop.position!, place)));
}

// Scans that were made, also those whose data are to come.
export function madeCount(site: Site): number {
  return merged(site).length + site.stations.length;
}

// As the contract has it. `previous`: the stops that are left of the tour before; the contract takes them with a goal,
// and not with minutes or scans, where what fits in is another choice each time.
const mostPrevious = 1000;
export function wishOf(
  left: Left,
  scanners: readonly string[],
  seconds: number,
  previous: readonly TourStop[],
): TourWish {
  const duration = (s: number) => ({ seconds: BigInt(Math.round(s)), nanos: 0 });
  return create(TourWishSchema, {
    scanners: [...scanners],
    timeBudget: duration(seconds),
    availableDuration: left.of === "minutes" ? duration(Math.max(1, 60 * left.minutes)) : undefined,
    availableScanCount: left.of === "scans" ? left.scans : undefined,
    previousStations:
      left.of === "all"
        ? previous.slice(0, mostPrevious).flatMap((stop) => (stop.position === undefined ? [] : [stop.position]))
        : [],
  });
}

// Of a fleet those that one tour is made for: all of one model, as many as the contract takes.
const mostScanners = 16;
export function fleetOf(site: Site): string[] {
  const model = site.scanners[0]?.scannerModelId;
  return site.scanners
    .filter((scanner) => scanner.scannerModelId === model)
    .slice(0, mostScanners)
    .map((scanner) => scanner.name);
}
