// What the server knows of a place, in words that a crew uses. The sentences themselves are texts;
// here it is decided which of them are said, and with which figures.
import type { Parameters, Key } from "../texts/texts.svelte";
import type { RankedView } from "../gen/vantage/v1/plan_pb";
import { RegistrationBasis, RegistrationOutcome, type RegistrationVerdict } from "../gen/vantage/v1/registration_pb";
import type { Vector3 } from "../gen/vantage/v1/geometry_pb";
import { accuracy, area, areaRange, metres, metresFine, percent } from "./numbers";

export type Say = (key: Key, parameters?: Parameters) => string;

// Which side of somebody who walks from `from` to `to` the direction `away` (from the place to a
// wall) lies on. Ahead and behind take a quarter turn each, left and right the others.
export type Side = "ahead" | "left" | "behind" | "right";
export function sideOf(
  from: { x: number; y: number },
  to: { x: number; y: number },
  away: { x: number; y: number },
): Side {
  const walk = Math.atan2(to.y - from.y, to.x - from.x);
  const turn = Math.atan2(Math.sin(Math.atan2(away.y, away.x) - walk), Math.cos(Math.atan2(away.y, away.x) - walk));
  if (Math.abs(turn) <= Math.PI / 4) return "ahead";
  if (Math.abs(turn) >= (3 * Math.PI) / 4) return "behind";
  return turn > 0 ? "left" : "right";
}

// What a scan from there brings, m2: the forecast and the range it lies in in four cases of five. A view
// whose gain is not known to its end yet has none.
export function gainHeadline(
  view: RankedView,
  say: Say,
  language: string,
): { figure: string; range: string } | undefined {
  const expected = view.expectedGainM2 > 0 ? view.expectedGainM2 : view.modelGainM2;
  // Not scored to its end: what it brings at least, where that is something.
  if (expected <= 0 && view.modelGainLowerM2 >= 0.1) {
    return { figure: area(view.modelGainLowerM2, language), range: say("gain.orMore") };
  }
  if (expected <= 0) return undefined;
  if (view.expectedGainUpperM2 <= 0) return { figure: area(expected, language), range: "" };
  const [lower, upper] = areaRange(view.expectedGainLowerM2, view.expectedGainUpperM2, language);
  return { figure: area(expected, language), range: say("gain.range", { lower, upper }) };
}

// What the gain is made of, the most first; parts below a twentieth are left out, at most three are
// said.
export function gainParts(view: RankedView, say: Say, language: string): string[] {
  const byKind = view.modelGainByKindM2;
  const whole = Math.max(view.expectedGainM2, view.modelGainM2);
  if (byKind === undefined || whole <= 0) return [];
  const known: [Key, number][] = [
    ["gain.thin", byKind.trueSurface],
    // What is hidden counts with the space behind it: the forecast beyond the model's own gain.
    ["gain.hidden", byKind.occlusion + Math.max(0, whole - view.modelGainM2 - view.expectedSurfaceGainM2)],
    ["gain.noEcho", byKind.holeBoundary],
    ["gain.outside", byKind.imageBoundary],
    [view.expectedStation?.doorway === undefined ? "gain.unseen" : "gain.room", view.expectedSurfaceGainM2],
  ];
  return known
    .filter(([, m2]) => m2 >= whole / 20 && m2 >= 0.05)
    .sort((a, b) => b[1] - a[1])
    .slice(0, 3)
    .map(([key, m2]) => say(key, { area: area(m2, language) }));
}

const reasons: Partial<Record<RegistrationBasis, Key>> = {
  [RegistrationBasis.SCAN_GEOMETRY]: "align.why.shape",
  [RegistrationBasis.OVERLAP]: "align.why.overlap",
  [RegistrationBasis.NO_POSE_PRIOR]: "align.why.noPlace",
  [RegistrationBasis.RESIDUALS]: "align.why.residuals",
  [RegistrationBasis.CONTRADICTION]: "align.why.contradiction",
  [RegistrationBasis.RIVAL_POSE]: "align.why.rival",
  [RegistrationBasis.NOT_CONVERGED]: "align.why.noFit",
  [RegistrationBasis.TARGETS]: "align.why.targets",
  [RegistrationBasis.TRUSTED_POSE]: "align.why.givenPose",
};

// Whether the scan will join, or has joined, the others.
export interface Alignment {
  standing: "good" | "doubtful" | "bad" | "unknown";
  words: string;
  // Why not, where it does not; empty else.
  why: string;
}

export function alignment(
  verdict: RegistrationVerdict | undefined,
  made: boolean,
  say: Say,
  language: string,
): Alignment {
  if (verdict === undefined) return { standing: "unknown", words: say("align.unknown"), why: "" };
  const bound = { accuracy: accuracy(verdict.errorBoundM, language) };
  if (verdict.outcome === RegistrationOutcome.REGISTERED) {
    return { standing: "good", words: say(made ? "align.made" : "align.will", bound), why: "" };
  }
  const key = reasons[verdict.basis];
  const why = [
    key === undefined ? "" : say(key, { share: percent(verdict.overlapShare, language), ...bound }),
    verdict.attainableAccuracyM === undefined
      ? ""
      : say("align.why.instrument", { accuracy: accuracy(verdict.attainableAccuracyM, language) }),
  ]
    .filter((words) => words !== "")
    .join(" ");
  if (verdict.outcome === RegistrationOutcome.DOUBTFUL) {
    return { standing: "doubtful", words: say(made ? "align.doubtful" : "align.mayNot"), why };
  }
  return { standing: "bad", words: say(made ? "align.failed" : "align.willNot"), why };
}

// How to find the place with a tape: from the last station and from walls, told by where they are for
// somebody who comes from that station.
export function finding(
  view: RankedView,
  last: { position: Vector3; name: string } | undefined,
  say: Say,
  language: string,
): string[] {
  const said: string[] = [];
  const position = view.position;
  if (position === undefined) return said;
  if (last !== undefined) {
    const distance = Math.hypot(position.x - last.position.x, position.y - last.position.y);
    said.push(say("find.station", { distance: metres(distance, language), station: last.name }));
  }
  for (const wall of view.location?.walls ?? []) {
    const distance = metres(wall.distanceM, language);
    const normal = wall.wallNormal;
    if (last === undefined || normal === undefined) {
      said.push(say("find.wall", { distance }));
    } else {
      const side = sideOf(last.position, position, { x: -normal.x, y: -normal.y });
      said.push(say(`find.wall.${side}`, { distance }));
    }
  }
  if (view.heightOverFloorM > 0) said.push(say("find.height", { height: metresFine(view.heightOverFloorM, language) }));
  return said;
}

// What has to be believed of the place, since nobody has seen it.
export function caution(view: RankedView, say: Say, language: string): string {
  const station = view.expectedStation;
  if (station !== undefined) {
    return say(station.doorway === undefined ? "caution.place" : "caution.room", {
      radius: metres(station.radiusM, language),
      chance: percent(station.chance, language),
    });
  }
  if (view.floorMeasured === false) return say("caution.floor");
  return "";
}

// Doors that have to stay open until a scan from there is made. Empty where it needs none.
export function openDoors(view: RankedView, say: Say, language: string): string {
  const doors = view.openDoors;
  const [first] = doors;
  if (first === undefined) return "";
  if (doors.length > 1) return say("doors.several", { n: doors.length });
  return first.overlapShare > 0.5
    ? say("doors.most")
    : say("doors.some", { share: percent(first.overlapShare, language) });
}

// With which targets a scan from a place that was refused would join the others: how many, and from where they
// are measured first. `places` are as many as the plan has signs.
export function targetAdvice(
  view: RankedView,
  stationName: (scan: string) => string,
  say: Say,
  language: string,
): string[] {
  const advice = view.targetAdvice;
  if (advice === undefined || advice.places.length === 0) return [];
  const list = new Intl.ListFormat(language);
  const bound = { accuracy: accuracy(advice.errorBoundM, language), n: advice.places.length };
  const there = advice.places.map((place) => place.target).filter((target) => target !== "");
  const said = [
    there.length === advice.places.length
      ? say("targets.scanThose", { ...bound, targets: list.format(there) })
      : say("targets.putUp", bound),
  ];
  if (advice.firstViewIndex !== undefined) said.push(say("targets.first", { rank: advice.firstViewIndex + 1 }));
  else if (advice.seenFromScans.length > 0)
    said.push(say("targets.seenFrom", { stations: list.format(advice.seenFromScans.map(stationName)) }));
  return said;
}

// The walk there from where the scanner stands.
export function walk(view: RankedView, say: Say, language: string): string {
  if (view.travelDistanceM === undefined) return "";
  return say("walk", { distance: metres(view.travelDistanceM, language) });
}
