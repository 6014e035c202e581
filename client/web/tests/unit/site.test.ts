import { create, type MessageInitShape } from "@bufbuild/protobuf";
import { timestampFromMs } from "@bufbuild/protobuf/wkt";
import { expect, test } from "vitest";
import { SessionEventSchema, type SessionEvent } from "../../src/gen/vantage/v1/event_pb";
import { Vector3Schema } from "../../src/gen/vantage/v1/geometry_pb";
import { ScanState } from "../../src/gen/vantage/v1/scan_pb";
import { UploadState } from "../../src/gen/vantage/v1/upload_pb";
import {
  apply,
  freshPlan,
  lastStation,
  openUploads,
  readUploads,
  refusedUploads,
  stationNumber,
  withoutExpired,
  type Site,
} from "../../src/job/site";
import { emptySite as empty } from "./empty_site";

let count = 0n;
const event = (what: MessageInitShape<typeof SessionEventSchema>["event"], ms = 0): SessionEvent =>
  create(SessionEventSchema, { sequence: ++count, time: timestampFromMs(ms), event: what! });
const scan = (name: string, state: ScanState) => ({
  name,
  state,
  pose: { translation: { x: 0, y: 0, z: 0 } },
  merge: { modelVersion: 3n },
});

function story(): SessionEvent[] {
  count = 0n;
  return [
    event({ case: "uploadCreated", value: { upload: { name: "u1" } } }),
    event({ case: "scanReceived", value: { scan: { name: "a", upload: "u1", state: ScanState.RECEIVED } } }),
    event({ case: "scanMerged", value: { scan: scan("a", ScanState.MERGED) } }, 10),
    event(
      { case: "claimTaken", value: { claim: { name: "c1", scanner: "red", expireTime: timestampFromMs(60_000) } } },
      20,
    ),
    event({ case: "stationCreated", value: { station: { name: "s1" } } }, 30),
    event({ case: "viewRejected", value: { rejection: { name: "r1" } } }, 40),
    event({ case: "planCreated", value: { plan: { name: "p1", createTime: timestampFromMs(50) } } }, 50),
    event({ case: "claimEnded", value: { claim: { name: "c1" } } }, 60),
  ];
}

test("events build the site, and hearing them again changes nothing", () => {
  const events = story();
  const site = events.reduce(apply, empty);
  expect(site.scans.map((s) => s.state)).toEqual([ScanState.MERGED]);
  expect(site.uploads).toEqual([]);
  expect(site.claims).toEqual([]);
  expect(site.stations.map((s) => s.name)).toEqual(["s1"]);
  expect(site.modelVersion).toBe(3n);
  for (const again of events) expect(apply(site, again)).toBe(site);
});

test("a file that the server reads is told of until its last scan has come, and when it failed", () => {
  count = 0n;
  const file = (name: string, state: UploadState) => ({ name, state, file: { name: "project.e57" } });
  const received = (name: string, fileSetup: number) =>
    event({ case: "scanReceived", value: { scan: { name, upload: "u1", fileSetup, state: ScanState.RECEIVED } } });
  let site = [
    event({ case: "uploadCreated", value: { upload: file("u1", UploadState.OPEN) } }),
    event({ case: "uploadReceived", value: { upload: file("u1", UploadState.READING) } }),
    received("a", 1),
  ].reduce(apply, empty);
  expect(openUploads(site)).toEqual([]);
  expect(readUploads(site).map((upload) => upload.name)).toEqual(["u1"]);
  site = [
    received("b", 2),
    event({ case: "uploadEnded", value: { upload: file("u1", UploadState.COMMITTED) } }),
    event({ case: "uploadCreated", value: { upload: file("u2", UploadState.OPEN) } }),
    event({ case: "uploadEnded", value: { upload: file("u2", UploadState.FAILED) } }),
  ].reduce(apply, site);
  expect(site.scans.length).toBe(2);
  expect(readUploads(site)).toEqual([]);
  expect(refusedUploads(site).map((upload) => upload.name)).toEqual(["u2"]);
});

test("a plan is fresh until something happens that it does not know of", () => {
  const events = story();
  const before = events.slice(0, 7).reduce(apply, empty);
  expect(freshPlan(before, "", [])?.name).toBe("p1");
  expect(freshPlan(before, "red", [])).toBeUndefined();
  expect(freshPlan(apply(before, events[7]!), "", [])).toBeUndefined();
});

test("a plan that follows a route is fresh where just that route is followed", () => {
  const before = story().slice(0, 7).reduce(apply, empty);
  const [a, b] = [
    { x: 1, y: 2.5, z: 1.5 },
    { x: 3, y: 4, z: 1.5 },
  ];
  expect(freshPlan(before, "", [a])).toBeUndefined();
  const made = { ...before.plans.get("p1")!, name: "p2", tourStations: [a, b].map((at) => create(Vector3Schema, at)) };
  const after = { ...before, plans: new Map(before.plans).set("p2", made) };
  expect(freshPlan(after, "", [a, b])?.name).toBe("p2");
  expect(freshPlan(after, "", [a])).toBeUndefined();
  expect(freshPlan(after, "", [b, a])).toBeUndefined();
  expect(freshPlan(after, "", [])?.name).toBe("p1");
});

test("claims end at their time, without an event", () => {
  const site = story().slice(0, 5).reduce(apply, empty);
  expect(withoutExpired(site, 59)).toBe(site);
  expect(withoutExpired(site, 61).claims).toEqual([]);
});

test("the last station is the scanner's own where it has one", () => {
  const site = {
    ...empty,
    scans: [
      { ...scan("a", ScanState.MERGED), scanner: "red" },
      { ...scan("b", ScanState.MERGED), scanner: "blue" },
      scan("c", ScanState.DOUBTFUL),
    ],
  } as unknown as Site;
  expect(lastStation(site, "red")?.name).toBe("a");
  expect(lastStation(site, "")?.name).toBe("b");
  expect(lastStation(site, "green")?.name).toBe("b");
  expect(stationNumber(site, "c")).toBe(3);
});

test("scans stand where an adjustment put them", () => {
  const site = story().slice(0, 3).reduce(apply, empty);
  const poses = [{ scan: "a", pose: { translation: { x: 0.01, y: 0, z: 0 } } }, { scan: "unknown" }];
  const adjusted = apply(site, event({ case: "posesAdjusted", value: { poses, modelVersion: 9n } }, 70));
  expect(adjusted.scans[0]!.pose!.translation!.x).toBe(0.01);
  expect(adjusted.scans[0]!.state).toBe(ScanState.MERGED);
  expect(adjusted.modelVersion).toBe(9n);
  expect(adjusted.changed).toBe(70_000_000n);
});

test("a plan of the building is known from when it is set until it is taken out, and plans depend on it", () => {
  count = 0n;
  const sitePrior = { name: "sessions/s/sitePrior", displayName: "plan.png" };
  const set = apply(empty, event({ case: "sitePriorSet", value: { sitePrior } }, 20));
  expect(set.prior?.displayName).toBe("plan.png");
  expect(set.changed).toBe(20_000_000n);
  const cleared = apply(set, event({ case: "sitePriorCleared", value: { sitePrior } }, 30));
  expect(cleared.prior).toBeUndefined();
  expect(cleared.changed).toBe(30_000_000n);
});
