import { create } from "@bufbuild/protobuf";
import { expect, test } from "vitest";
import { stopLabels, stopMarks, tourLines } from "../../src/draw/tour_lines";
import { StationSchema, ScannerSchema } from "../../src/gen/vantage/v1/fleet_pb";
import { ScanSchema, ScanState } from "../../src/gen/vantage/v1/scan_pb";
import { TourSchema, TourStopSchema, type TourStop } from "../../src/gen/vantage/v1/tour_pb";
import type { Site } from "../../src/job/site";
import { fleetOf, notMade, wishOf } from "../../src/job/tour_wish";
import english from "../../src/texts/en.json";
import { fill } from "../../src/texts/texts.svelte";
import { hoursAndMinutes, percentFine, spacing } from "../../src/words/numbers";
import { leastWorth, stopWords, tourHeadline, tourRemarks } from "../../src/words/tour_words";
import { emptySite } from "./empty_site";

const say = (key: keyof typeof english, parameters = {}) => fill(english[key], parameters, "en");
const nbsp = "\u00a0";
const minutes = (n: number) => ({ seconds: BigInt(60 * n), nanos: 0 });
const stop = (x: number, y: number, more = {}): TourStop =>
  create(TourStopSchema, { position: { x, y, z: 1.5 }, ...more });

test("what is left of the day is what the server is asked for", () => {
  const stops = [stop(1, 2), stop(3, 4)];
  const all = wishOf({ of: "all" }, ["a"], 20, stops);
  expect(all.availableDuration).toBeUndefined();
  expect(all.availableScanCount).toBeUndefined();
  expect(all.previousStations.map(({ x, y, z }) => [x, y, z])).toEqual([
    [1, 2, 1.5],
    [3, 4, 1.5],
  ]);
  expect(all.timeBudget?.seconds).toBe(20n);
  expect(all.scanners).toEqual(["a"]);
  // An earlier tour is not taken together with minutes or scans.
  const half = wishOf({ of: "minutes", minutes: 30 }, [], 20, stops);
  expect(half.availableDuration?.seconds).toBe(1800n);
  expect(half.previousStations).toEqual([]);
  const few = wishOf({ of: "scans", scans: 3 }, [], 20, stops);
  expect(few.availableScanCount).toBe(3);
  expect(few.previousStations).toEqual([]);
  expect(
    wishOf(
      { of: "all" },
      [],
      20,
      Array.from({ length: 1500 }, () => stops[0]!),
    ).previousStations.length,
  ).toBe(1000);
});

test("stops that were made are not planned again", () => {
  const stops = [stop(0, 0), stop(5, 0), stop(5, 5), stop(0, 5)];
  const made: Site = {
    ...emptySite,
    scans: [
      create(ScanSchema, { name: "a", state: ScanState.MERGED, pose: { translation: { x: 0.3, y: 0.1, z: 1.4 } } }),
      // In doubt: nothing is known of where it was made.
      create(ScanSchema, { name: "b", state: ScanState.DOUBTFUL, pose: { translation: { x: 5, y: 5, z: 1.5 } } }),
      // A storey below.
      create(ScanSchema, { name: "c", state: ScanState.MERGED, pose: { translation: { x: 0, y: 5, z: -1.5 } } }),
    ],
    stations: [create(StationSchema, { name: "d", position: { x: 5, y: -0.2, z: 1.5 } })],
  };
  expect(notMade(stops, made)).toEqual([stops[2], stops[3]]);
});

test("a tour is made for scanners of one model", () => {
  const scanner = (name: string, scannerModelId: string) => create(ScannerSchema, { name, scannerModelId });
  const mixed = { ...emptySite, scanners: [scanner("a", "one"), scanner("b", "two"), scanner("c", "one")] };
  expect(fleetOf(mixed)).toEqual(["a", "c"]);
  expect(fleetOf(emptySite)).toEqual([]);
});

const tour = create(TourSchema, {
  stops: Array.from({ length: 23 }, () => stop(0, 0)),
  duration: minutes(190),
  coverage: 0.974,
  requiredDensityPerM2: 2500,
  areaM2: 400,
  attainableAreaM2: 410,
  reachesGoal: true,
  worth: Array.from({ length: 23 }, (_, i) => ({
    scanCount: i + 1,
    duration: minutes(190 - 8 * (22 - i)),
    coverage: 0.974 - (i < 21 ? 0.011 + 0.03 * (20 - i) : i === 21 ? 0.005 : 0),
  })),
});

test("a tour is said as in an offer, and what is least worth going for", () => {
  expect(tourHeadline(tour, say, "en")).toBe(`23 stations, 3${nbsp}h 10${nbsp}min, 97${nbsp}% at 2${nbsp}cm`);
  expect(leastWorth(tour, say, "en")).toBe(
    `The 2 that bring least add 1.1${nbsp}%. Leaving them out saves 16${nbsp}min.`,
  );
  const one = create(TourSchema, { stops: [stop(0, 0)], worth: [{ scanCount: 1, coverage: 0.9 }] });
  expect(leastWorth(one, say, "en")).toBe("");
  // Of several that bring next to nothing all are named.
  const padded = create(TourSchema, {
    worth: [0.5, 0.9, 0.905, 0.91, 0.912, 0.913].map((coverage, i) => ({ coverage, duration: minutes(3 * (i + 1)) })),
  });
  expect(leastWorth(padded, say, "en")).toBe(
    `The 4 that bring least add 1.3${nbsp}%. Leaving them out saves 12${nbsp}min.`,
  );
  const even = create(TourSchema, {
    worth: [0.2, 0.4, 0.6, 0.8, 1].map((coverage, i) => ({ coverage, duration: minutes(3 * (i + 1)) })),
  });
  expect(leastWorth(even, say, "en")).toMatch(/^The 2 that bring least add 40\s%\./);
  // Others are at work meanwhile.
  const together = create(TourSchema, {
    worth: [0.5, 0.9].map((coverage) => ({ coverage, duration: minutes(6) })),
  });
  expect(leastWorth(together, say, "en")).toBe(`The one that brings least adds 40${nbsp}%.`);
});

test("what stays open is said, and what has to be believed", () => {
  expect(tourRemarks(tour, false, say, "en")).toEqual([]);
  expect(tourRemarks(tour, true, say, "en")).toEqual([`10${nbsp}m² that could be scanned stay open.`]);
  const doubtful = create(TourSchema, {
    stops: [stop(0, 0, { expected: true }), stop(1, 0)],
    unregisteredCount: 2,
    keptCount: 1,
  });
  expect(tourRemarks(doubtful, false, say, "en")).toEqual([
    "Some of the surface cannot be scanned fully from any place that is known.",
    "1 stop is where nobody has looked yet: a free spot nearby is as good.",
    "2 places were left out: a scan there would not align.",
    "1 stop is as before.",
  ]);
  const said = stopWords(stop(0, 0, { areaM2: 12.3, endOffset: minutes(75), coverage: 0.5 }), say, "en");
  expect(said).toEqual({ brings: `12${nbsp}m² more`, then: `done after 1${nbsp}h 15${nbsp}min, then 50${nbsp}%` });
});

test("figures have the units that people plan by", () => {
  expect(hoursAndMinutes(59 * 60 + 20, "en")).toBe(`59${nbsp}min`);
  expect(hoursAndMinutes(3600, "en")).toBe(`1${nbsp}h 00${nbsp}min`);
  expect(hoursAndMinutes(3 * 3600 + 5 * 60, "de")).toBe(`3${nbsp}h 05${nbsp}min`);
  expect(percentFine(0.011, "de")).toBe(`1,1${nbsp}%`);
  expect(percentFine(0.4, "en")).toBe(`40${nbsp}%`);
  expect(spacing(2500, "en")).toBe(`2${nbsp}cm`);
  expect(spacing(400, "en")).toBe(`5${nbsp}cm`);
  expect(spacing(1600, "en")).toBe(`2.5${nbsp}cm`);
});

test("each scanner has a letter, numbers and a walk of its own, on the storey that is shown", () => {
  const place = (x: number, y: number, z: number, scanner: string, way: [number, number, number][]) =>
    create(TourStopSchema, {
      position: { x, y, z },
      scanner,
      way: way.map(([wx, wy, wz]) => ({ x: wx, y: wy, z: wz })),
    });
  const stops = [
    place(1, 0, 1.5, "red", [
      [0, 0, 0],
      [1, 0, 0],
    ]),
    place(9, 0, 1.5, "blue", []),
    place(1, 4, 1.5, "red", [
      [1, 0, 0],
      [2, 2, 0],
      [1, 4, 0],
    ]),
    // Up the stairs, and down again.
    place(1, 8, 4.5, "red", [
      [1, 4, 0],
      [1, 6, 1.5],
      [1, 8, 3],
    ]),
    place(9, 3, 1.5, "blue", []),
  ];
  const zones = ["blue", "red"];
  expect([...stopLabels(stops, zones).values()]).toEqual(["B1", "A1", "B2", "B3", "A2"]);
  // One that was not named, and one of two whom nothing is left for.
  expect([...stopLabels([stop(0, 0), stop(1, 0)], []).values()]).toEqual(["1", "2"]);
  expect([...stopLabels(stops.slice(0, 1), zones).values()]).toEqual(["B1"]);
  expect(
    tourLines([stop(0, 0), stop(1, 0)], [], { floor: 0, top: 3 }).map(({ zone, way }) => [zone, way.length]),
  ).toEqual([[0, 2]]);
  const ground = { floor: 0, top: 3 };
  const marks = stopMarks(stops, zones, ground);
  expect(marks.map((mark) => mark.type === "stop" && `${mark.label}${mark.first ? "!" : ""}`)).toEqual([
    "B1!",
    "A1!",
    "B2",
    "A2",
  ]);
  expect(stopMarks(stops, zones, { floor: 3, top: Infinity }).length).toBe(1);
  const lines = tourLines(stops, zones, ground);
  expect(lines.map((walk) => [walk.zone, walk.way.map(({ x, y }) => `${x} ${y}`)])).toEqual([
    [0, ["9 0", "9 3"]],
    [1, ["0 0", "1 0", "1 0", "1 0", "2 2", "1 4", "1 4"]],
    // To the foot of the stairs.
    [1, ["1 4", "1 6"]],
  ]);
});
