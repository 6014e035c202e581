// What stands on the plan of the site besides walls and floor, as a list to draw and to tap on.
import type { Opening } from "../gen/vantage/v1/coverage_pb";
import type { Claim, Station } from "../gen/vantage/v1/fleet_pb";
import type { Vector3 } from "../gen/vantage/v1/geometry_pb";
import type { NarrowWay, OpenDoor, RankedView } from "../gen/vantage/v1/plan_pb";
import { RegistrationOutcome } from "../gen/vantage/v1/registration_pb";
import { SiteChangeKind, type Scan, type SiteChange } from "../gen/vantage/v1/scan_pb";
import type { Rejection } from "../gen/vantage/v1/session_pb";
import type { TourStop } from "../gen/vantage/v1/tour_pb";
import { merged, type Site } from "../job/site";
import { changeLabel, changesOf } from "../words/changes";

interface Placed {
  // m, world.
  x: number;
  y: number;
  z: number;
}

export type Mark = Placed &
  (
    | { type: "station"; scan: Scan; label: string; here: boolean; weak: boolean; who: string }
    | { type: "pending"; station: Station; label: string }
    | { type: "claim"; claim: Claim; label: string; own: boolean }
    | { type: "rejection"; rejection: Rejection; radius: number }
    | { type: "view"; view: RankedView; rank: number; target: boolean }
    | { type: "door"; opening: Opening; width: number; direction: number }
    // A place that a person tries out, and poses to choose from.
    | { type: "trial"; label: string }
    | { type: "pose"; label: string; heading: number; chosen: boolean; index: number }
    // By which a pose is turned.
    | { type: "turn" }
    // Where a target would help, and where the scanner is too wide.
    | { type: "sign"; label: string }
    | { type: "narrow"; way: NarrowWay }
    // A place that was refused, since a scan from there would not align.
    | { type: "refused"; view: RankedView }
    // A door that has to stay open until the scan is made.
    | { type: "openDoor"; door: OpenDoor }
    // A scan of the tour; `first`: of those that its scanner still makes.
    | { type: "stop"; stop: TourStop; label: string; zone: number; first: boolean }
    // What a scan shows to have come, or to be gone, since earlier ones; its outline on the floor, m, world.
    | {
        type: "change";
        scan: Scan;
        change: SiteChange;
        label: string;
        came: boolean;
        outline: { x: number; y: number }[];
      }
  );

export interface Band {
  floor: number;
  top: number;
}

// On the storey: its floor is the next one below.
export function within(band: Band, z: number): boolean {
  return z >= band.floor - 0.3 && z < band.top - 0.3;
}

// A scan that joined with less than this, of what was asked for, is shown as weakly held: its error bound
// is more than half of the accuracy that is required.
export function isWeak(scan: Scan, requiredAccuracy: number): boolean {
  const verdict = scan.registration?.verdict;
  if (verdict === undefined) return false;
  return verdict.outcome !== RegistrationOutcome.REGISTERED || verdict.errorBoundM > requiredAccuracy / 2;
}

export function marksOf(
  site: Site,
  band: Band,
  what: {
    own: string;
    here: Scan | undefined;
    views: readonly RankedView[];
    target: RankedView | undefined;
    openings: readonly Opening[];
    refused?: readonly RankedView[];
    narrow?: readonly NarrowWay[];
    // The refused place whose targets are shown.
    advised?: RankedView | undefined;
    // The place whose doors have to stay open, and the scan whose changes are shown.
    through?: RankedView | undefined;
    changed?: Scan | undefined;
    scannerName: (name: string) => string;
  },
): Mark[] {
  const marks: Mark[] = [];
  const on = (place: Vector3 | undefined): place is Vector3 => place !== undefined && within(band, place.z);
  const required = site.session.planningConfig?.registration?.requiredAccuracyM ?? 0.01;
  for (const opening of what.openings) {
    if (!opening.doorway || opening.entered || !on(opening.centre)) continue;
    const direction = Math.atan2(opening.direction?.y ?? 0, opening.direction?.x ?? 1);
    marks.push({ type: "door", opening, width: opening.widthM, direction, ...at(opening.centre) });
  }
  for (const rejection of site.rejections) {
    if (on(rejection.position)) {
      marks.push({ type: "rejection", rejection, radius: rejection.radiusM, ...at(rejection.position) });
    }
  }
  for (const view of what.refused ?? []) {
    if (on(view.position)) marks.push({ type: "refused", view, ...at(view.position) });
  }
  for (const way of what.narrow ?? []) {
    if (way.narrowest !== undefined && way.narrowest.z >= band.floor - 0.5 && way.narrowest.z < band.top - 0.3)
      marks.push({ type: "narrow", way, ...at(way.narrowest) });
  }
  if (what.changed !== undefined) marks.push(...changeMarks(what.changed, band));
  for (const door of what.through?.openDoors ?? []) {
    // On the floor, which a storey begins with.
    if (door.centre !== undefined && door.centre.z >= band.floor - 0.5 && door.centre.z < band.top - 0.3)
      marks.push({ type: "openDoor", door, ...at(door.centre) });
  }
  what.advised?.targetAdvice?.places.forEach((place, i) => {
    if (place.position !== undefined && place.position.z < band.top)
      marks.push({ type: "sign", label: place.target || String(i + 1), ...at(place.position) });
  });
  what.views.forEach((view, i) => {
    if (!on(view.position) || view === what.target) return;
    marks.push({ type: "view", view, rank: i + 1, target: false, ...at(view.position) });
  });
  for (const station of site.stations) {
    if (on(station.position)) {
      marks.push({ type: "pending", station, label: what.scannerName(station.scanner), ...at(station.position) });
    }
  }
  for (const claim of site.claims) {
    if (on(claim.position)) {
      const own = claim.scanner === what.own;
      marks.push({ type: "claim", claim, label: what.scannerName(claim.scanner), own, ...at(claim.position) });
    }
  }
  for (const scan of merged(site)) {
    const place = scan.pose?.translation;
    if (!on(place)) continue;
    const label = String(site.scans.indexOf(scan) + 1);
    const here = scan.name === what.here?.name;
    const who = site.scanners
      .filter((scanner) => lastOf(site, scanner.name) === scan)
      .map((scanner) => what.scannerName(scanner.name));
    marks.push({ type: "station", scan, label, here, weak: isWeak(scan, required), who: who.join(", "), ...at(place) });
  }
  const target = what.target;
  if (target !== undefined && on(target.position)) {
    const rank = what.views.indexOf(target) + 1;
    marks.push({ type: "view", view: target, rank, target: true, ...at(target.position) });
  }
  return marks;
}

// Before the first scan, where it is to be made and whither the scanner's front points, if a plan of the building was
// placed by that: the site's own frame begins there.
export function firstScanMarks(site: Site): Mark[] {
  const [a, b] = site.prior?.points ?? [];
  if (site.scans.length > 0 || a?.site === undefined || b?.site === undefined) return [];
  if (a.site.x !== 0 || a.site.y !== 0 || b.site.y !== 0) return [];
  return [{ type: "pose", label: "A", heading: 0, chosen: true, index: 0, x: 0, y: 0, z: 0 }];
}

// What one scan shows to have been moved, as far as it is on the storey.
export function changeMarks(scan: Scan, band: Band): Mark[] {
  return changesOf(scan).flatMap((change, i) => {
    const { min, max } = change.box ?? {};
    if (change.centre === undefined || !within(band, change.centre.z)) return [];
    const outline =
      min === undefined || max === undefined
        ? []
        : [min, { x: max.x, y: min.y }, max, { x: min.x, y: max.y }].map(({ x, y }) => ({ x, y }));
    const came = change.kind === SiteChangeKind.CAME;
    return [{ type: "change", scan, change, label: changeLabel(change, i), came, outline, ...at(change.centre) }];
  });
}

// Where a scanner of the fleet stands, as far as its scans tell.
function lastOf(site: Site, scanner: string): Scan | undefined {
  return merged(site)
    .filter((scan) => scan.scanner === scanner)
    .at(-1);
}

function at(place: Vector3): Placed {
  return { x: place.x, y: place.y, z: place.z };
}
