import { create } from "@bufbuild/protobuf";
import { beforeEach, expect, test, vi } from "vitest";
import { ClaimSchema, StationSchema } from "../../src/gen/vantage/v1/fleet_pb";
import { PlanResultSchema } from "../../src/gen/vantage/v1/plan_pb";
import { ScanSchema, ScanState } from "../../src/gen/vantage/v1/scan_pb";
import { TourSchema, TourStopSchema, type Tour, type TourStop } from "../../src/gen/vantage/v1/tour_pb";
import { FollowedRoute } from "../../src/job/followed_route.svelte";
import { hindrance, readStops, stopsAhead } from "../../src/job/followed_stops";
import type { Job } from "../../src/job/job.svelte";
import type { Site } from "../../src/job/site";
import type { Tours } from "../../src/job/tours.svelte";
import english from "../../src/texts/en.json";
import { fill } from "../../src/texts/texts.svelte";
import { followedWords, hindranceWords } from "../../src/words/followed_words";

vi.mock("../../src/api/server", () => ({}));

const say = (key: keyof typeof english, parameters = {}) => fill(english[key], parameters, "en");
const [a, b, c] = [0, 5, 10].map((x) => ({ x, y: 1.25, z: 1.5 }));
const stops = [a!, b!, c!];
const station = create(StationSchema, { position: b });
const nobody = { claims: [], stations: [], scans: [], changed: 0n };
const site = (more = {}) => ({ ...nobody, ...more }) as unknown as Site;
const scanAt = (x: number) =>
  create(ScanSchema, { state: ScanState.MERGED, pose: { translation: { x, y: 1.5, z: 1.4 } } });

test("a plan follows what is ahead of a route, where the contract takes one", () => {
  expect(hindrance(site(), "")).toBeUndefined();
  expect(hindrance(site(), "red")).toBe("scanner");
  expect(hindrance(site({ stations: [station] }), "")).toBe("stations");
  expect(hindrance(site({ claims: [create(ClaimSchema, {})] }), "")).toBe("claims");
  expect(stopsAhead(stops, site())).toEqual(stops);
  expect(stopsAhead(stops, site({ scans: [scanAt(0.2)] }))).toEqual([b, c]);
  expect(
    stopsAhead(
      Array.from({ length: 300 }, () => c!),
      site(),
    ).length,
  ).toBe(256);
});

test("what is kept is read as it was, and nothing else", () => {
  expect(readStops(JSON.stringify(stops))).toEqual(stops);
  expect(readStops("[]")).toEqual([]);
  for (const other of [null, "", "{", "{}", "3", "[null]", '[{"x":1,"y":2}]']) expect(readStops(other)).toBeUndefined();
});

const kept = new Map<string, string>();
beforeEach(() => {
  kept.clear();
  vi.stubGlobal("localStorage", {
    getItem: (key: string) => kept.get(key) ?? null,
    setItem: (key: string, text: string) => kept.set(key, text),
    removeItem: (key: string) => kept.delete(key),
  });
});

function tours(of: readonly { x: number; y: number; z: number }[], scanners: string[] = []): Tours {
  const made: TourStop[] = of.map((position) => create(TourStopSchema, { position }));
  const tour: Tour = create(TourSchema, { stops: made });
  return { tour, stops: made, scanners } as unknown as Tours;
}

test("a route is followed once somebody wants it, and remembered for the job", () => {
  const job = { site: site({ scans: [scanAt(0)] }), scanner: "" };
  const of = job as unknown as Job;
  const route = new FollowedRoute(of, "route");
  expect([route.on, route.ahead, route.possible(tours(stops))]).toEqual([false, [], true]);
  // Of a tour that is worked out while nobody wants it nothing is kept.
  route.renew(tours(stops));
  expect(kept.size).toBe(0);
  route.begin(tours(stops));
  expect([route.on, route.ahead]).toEqual([true, [b, c]]);
  const later = new FollowedRoute(of, "route");
  expect([later.on, later.ahead]).toEqual([true, [b, c]]);
  // Worked out anew.
  later.renew(tours([c!, b!]));
  expect(later.ahead).toEqual([c, b]);
  later.renew({ tour: undefined, stops: [], scanners: [] } as unknown as Tours);
  expect(later.ahead).toEqual([c, b]);
  later.end();
  expect([later.on, later.ahead, new FollowedRoute(of, "route").on]).toEqual([false, [], false]);
});

test("a route of several scanners is not followed, nor where a scanner is chosen or the server knows of none", () => {
  const route = (scanner: string, more = {}) =>
    new FollowedRoute({ site: site(more), scanner } as unknown as Job, "route");
  const free = route("");
  expect(free.possible(tours(stops, ["red", "blue"]))).toBe(false);
  expect(free.possible(tours([]))).toBe(false);
  free.begin(tours(stops));
  expect([route("red").on, route("red").ahead, route("red").possible(tours(stops))]).toEqual([true, [], false]);
  expect(route("", { stations: [station] }).ahead).toEqual([]);
  const old = route("");
  old.answered(3, 3);
  expect(old.ahead).toEqual(stops);
  old.answered(3, 0);
  expect([old.on, old.ahead, old.possible(tours(stops))]).toEqual([false, [], false]);
  // Refused by the server for the site as it is: tried again after the next change.
  const job = { site: site({ changed: 7n }), scanner: "" };
  const refused = new FollowedRoute(job as unknown as Job, "route");
  refused.refused(6n);
  expect([refused.hindrance, refused.ahead.length]).toEqual([undefined, 3]);
  const now = new FollowedRoute(job as unknown as Job, "route");
  now.refused(7n);
  expect([now.on, now.hindrance, now.ahead]).toEqual([true, "refused", []]);
  free.renew(tours(stops, ["red", "blue"]));
  expect([free.on, kept.size]).toEqual([false, 0]);
});

test("which stop it is, or why none is followed, is said in words", () => {
  const words = (followedTour: object | undefined, shown = 0) =>
    followedWords(create(PlanResultSchema, { followedTour }), shown, say);
  expect(words(undefined)).toBe("");
  expect(followedWords(undefined, 0, say)).toBe("");
  const other = { stationIndex: 2, otherwiseViewIndex: 1, message: "stop 3 of the tour" };
  expect(words(other)).toBe("Stop 3 of your route");
  expect(words(other, 1)).toBe("Without your route this place would be the first.");
  expect(words(other, 2)).toBe("");
  expect(words({ stationIndex: 0, otherwiseViewIndex: 0 })).toBe(
    "Stop 1 of your route, and the best place without it, too",
  );
  expect(words({ message: "the tour is not followed" })).toMatch(/^No stop of your route pays and aligns now/);
  expect(hindranceWords(undefined, 2, say)).toBe("");
  expect(hindranceWords(undefined, 0, say)).toBe("All stops of your route are made.");
  expect(hindranceWords("stations", 0, say)).toMatch(/again when the data of all scans are there/);
  expect(hindranceWords("claims", 0, say)).toMatch(/nobody keeps a place/);
});
