import { create } from "@bufbuild/protobuf";
import { expect, test } from "vitest";
import english from "../../src/texts/en.json";
import { RankedViewSchema } from "../../src/gen/vantage/v1/plan_pb";
import {
  RegistrationBasis,
  RegistrationOutcome,
  RegistrationVerdictSchema,
} from "../../src/gen/vantage/v1/registration_pb";
import { fill } from "../../src/texts/texts.svelte";
import { ComparedPoseSchema, DisagreementKind } from "../../src/gen/vantage/v1/pose_comparison_pb";
import { roughTime } from "../../src/words/numbers";
import { poseWords } from "../../src/words/pose_words";
import {
  alignment,
  caution,
  finding,
  gainHeadline,
  gainParts,
  openDoors,
  sideOf,
  targetAdvice,
  type Say,
} from "../../src/words/sentences";

const say: Say = (key, parameters = {}) => fill(english[key], parameters, "en");

test("sides are those of somebody who walks from the station to the place", () => {
  // Walking north.
  const [from, to] = [
    { x: 0, y: 0 },
    { x: 0, y: 3 },
  ];
  expect(sideOf(from, to, { x: 0, y: 1 })).toBe("ahead");
  expect(sideOf(from, to, { x: 0, y: -1 })).toBe("behind");
  expect(sideOf(from, to, { x: -1, y: 0 })).toBe("left");
  expect(sideOf(from, to, { x: 1, y: 0 })).toBe("right");
  // The same when the world is turned by any angle.
  for (let turn = 0; turn < 6.3; turn += 0.21) {
    const [c, s] = [Math.cos(turn), Math.sin(turn)];
    const rotate = ({ x, y }: { x: number; y: number }) => ({ x: c * x - s * y, y: s * x + c * y });
    expect(sideOf(rotate(from), rotate(to), rotate({ x: -1, y: 0.2 }))).toBe("left");
  }
});

const view = create(RankedViewSchema, {
  position: { x: 0, y: 3, z: 1.5 },
  modelGainM2: 14,
  modelGainByKindM2: { trueSurface: 9, occlusion: 4, holeBoundary: 0.2, imageBoundary: 0.8 },
  expectedGainM2: 22,
  expectedGainLowerM2: 15,
  expectedGainUpperM2: 31,
  expectedSurfaceGainM2: 5,
  heightOverFloorM: 1.45,
  location: {
    walls: [
      { wallNormal: { x: 1, y: 0, z: 0 }, distanceM: 1.2 },
      { wallNormal: { x: 0, y: -1, z: 0 }, distanceM: 3.4 },
    ],
  },
});

test("the gain is the forecast with its range", () => {
  expect(gainHeadline(view, say, "en")).toEqual({ figure: "22\u00a0m²", range: "likely 15 to 31\u00a0m²" });
  expect(gainHeadline(create(RankedViewSchema, {}), say, "en")).toBeUndefined();
  // A plan that has only the model's own gain yet.
  expect(gainHeadline(create(RankedViewSchema, { modelGainM2: 3.04 }), say, "en")).toEqual({
    figure: "3.0\u00a0m²",
    range: "",
  });
});

test("the parts of the gain are the largest, and none that is nothing", () => {
  expect(gainParts(view, say, "en")).toEqual([
    "9.0\u00a0m² scanned too thinly so far",
    // 4 that are known to be hidden, and the 3 that the forecast has beyond the model and the unseen.
    "7.0\u00a0m² hidden behind things",
    "5.0\u00a0m² that nobody saw yet",
  ]);
});

test("a place is found from the last station and from walls by side", () => {
  const last = { position: view.position!, name: "4" };
  const from = { ...last, position: { ...last.position, y: 0 } };
  expect(finding(view, from, say, "en")).toEqual([
    "3.0\u00a0m from station 4",
    "1.2\u00a0m from the wall on the left",
    "3.4\u00a0m from the wall ahead",
    "tripod 1.45\u00a0m",
  ]);
  expect(finding(view, undefined, say, "en")[0]).toBe("1.2\u00a0m from the wall");
});

test("a verdict is said in millimetres, never by angles", () => {
  const good = create(RegistrationVerdictSchema, { outcome: RegistrationOutcome.REGISTERED, errorBoundM: 0.00172 });
  expect(alignment(good, false, say, "en")).toEqual({ standing: "good", words: "aligns to 2\u00a0mm", why: "" });
  expect(alignment(good, true, say, "en").words).toBe("aligned to 2\u00a0mm");
  expect(alignment(undefined, false, say, "en").standing).toBe("unknown");
});

test("every reason not to register has words, without the server's own", () => {
  for (const basis of Object.values(RegistrationBasis).filter(
    (value): value is RegistrationBasis => typeof value === "number",
  )) {
    const verdict = create(RegistrationVerdictSchema, {
      outcome: RegistrationOutcome.DOUBTFUL,
      basis,
      overlapShare: 0.043,
      errorBoundM: 0.0094,
      weakestDescription: "tilting about 57 degrees",
      message: "internals",
    });
    const said = alignment(verdict, true, say, "en");
    expect(said.standing).toBe("doubtful");
    expect(said.why).not.toMatch(/degrees|internals|undefined|\{/);
    if (basis === RegistrationBasis.OVERLAP) expect(said.why).toContain("4\u00a0%");
  }
});

test("what is assumed of a place is said", () => {
  const room = create(RankedViewSchema, {
    expectedStation: { radiusM: 1.2, chance: 0.9, doorway: { x: 1, y: 1, z: 0 } },
  });
  expect(caution(room, say, "en")).toContain("room that nobody entered");
  expect(caution(create(RankedViewSchema, { floorMeasured: false }), say, "en")).toBe(
    "The floor there was not measured.",
  );
  expect(caution(create(RankedViewSchema, { floorMeasured: true }), say, "en")).toBe("");
});

test("doors that have to stay open are said, with how much depends on them", () => {
  const door = (overlapShare: number) => ({ centre: { x: 1, y: 2, z: 0 }, widthM: 0.9, overlapShare });
  const through = (...shares: number[]) =>
    openDoors(create(RankedViewSchema, { openDoors: shares.map(door) }), say, "en");
  expect(through(0.83)).toBe("Leave the marked door open: most of what aligns this scan is seen through it.");
  expect(through(0.41)).toContain("41\u00a0% of what aligns this scan is seen through it");
  expect(through(0.6, 0.3)).toContain("the 2 marked doors");
  expect(through()).toBe("");
});

test("targets that help are told with where they are measured from", () => {
  const place = { position: { x: 1, y: 2, z: 1 }, distanceM: 2 };
  const stationName = (scan: string) => scan.replace(/\D+/, "");
  const put = create(RankedViewSchema, {
    targetAdvice: { places: [place, place], errorBoundM: 0.004, seenFromScans: ["scan-3", "scan-7"] },
  });
  expect(targetAdvice(put, stationName, say, "en")).toEqual([
    "With 2 targets where the plan shows chequered boards it aligns to 4\u00a0mm.",
    "Measure them first: a coarse scan from station 3 and 7 sees them all.",
  ]);
  const there = create(RankedViewSchema, {
    targetAdvice: {
      places: [
        { ...place, target: "T1" },
        { ...place, target: "T2" },
      ],
      errorBoundM: 0.002,
    },
  });
  expect(targetAdvice(there, stationName, say, "en")).toEqual(["With T1 and T2 in its view it aligns to 2\u00a0mm."]);
  const first = create(RankedViewSchema, { targetAdvice: { places: [place], errorBoundM: 0.002, firstViewIndex: 2 } });
  expect(targetAdvice(first, stationName, say, "en")[1]).toBe("Choice 3 sees them all: make that scan first.");
  expect(targetAdvice(create(RankedViewSchema, {}), stationName, say, "en")).toEqual([]);
});

test("what an instrument can reach is said where it is less than what is asked for", () => {
  const verdict = create(RegistrationVerdictSchema, {
    outcome: RegistrationOutcome.DOUBTFUL,
    basis: RegistrationBasis.LEVELLING,
    attainableAccuracyM: 0.023,
  });
  expect(alignment(verdict, true, say, "en").why).toBe(
    "With this scanner about 23\u00a0mm can be met here: ask for that, or put up targets.",
  );
});

test("a pose is told by what fits and by what it contradicts, the most first", () => {
  const pose = create(ComparedPoseSchema, {
    overlapShare: 0.64,
    rmsResidualM: 0.0031,
    disagreements: [
      { kind: DisagreementKind.SEEN_THROUGH, areaM2: 1 },
      { kind: DisagreementKind.IN_EMPTY_SPACE, areaM2: 0.6 },
      { kind: DisagreementKind.IN_EMPTY_SPACE, areaM2: 0.6 },
      { kind: DisagreementKind.BEHIND_SURFACE, areaM2: 0.01 },
    ],
  });
  expect(poseWords(pose, say, "en")).toEqual({
    fits: "64\u00a0% of it lies on what is scanned, 4\u00a0mm apart.",
    against: [
      "1.2\u00a0m² stands where earlier scans saw free space.",
      "It looks through 1.0\u00a0m² of what is known.",
    ],
  });
  expect(poseWords(create(ComparedPoseSchema, {}), say, "en").fits).toBe("Nothing of it lies on what is scanned.");
});

test("rough times are rough", () => {
  expect(roughTime(20, "en")).toBe("5 minutes");
  expect(roughTime(37 * 60, "en")).toBe("35 minutes");
  expect(roughTime(89 * 60, "en")).toBe("1.5 hours");
  expect(roughTime(130 * 60, "en")).toBe("2 hours");
});
