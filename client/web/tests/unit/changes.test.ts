import { create } from "@bufbuild/protobuf";
import { expect, test } from "vitest";
import english from "../../src/texts/en.json";
import german from "../../src/texts/de.json";
import { changeMarks } from "../../src/draw/marks";
import { ScanSchema, SiteChangeKind } from "../../src/gen/vantage/v1/scan_pb";
import { fill } from "../../src/texts/texts.svelte";
import { changeLabel, changesOf, changesSentence, changeWords } from "../../src/words/changes";
import type { Say } from "../../src/words/sentences";

const say: Say = (key, parameters = {}) => fill(english[key], parameters, "en");
const sagen: Say = (key, parameters = {}) => fill(german[key], parameters, "de");
const stationName = (scan: string) => scan.replace(/\D+/, "");

const box = (x: number, z: number) => ({
  centre: { x, y: 4, z },
  box: { min: { x: x - 0.2, y: 3, z: z - 0.9 }, max: { x: x + 0.2, y: 5, z: z + 0.9 } },
});
const cupboard = { kind: SiteChangeKind.CAME, since: "sessions/a/scans/scan-3", areaM2: 3.2, ...box(3, 0.9) };
const door = { kind: SiteChangeKind.GONE, since: "sessions/a/scans/scan-1", areaM2: 1.6, ...box(7, 1) };
const scan = create(ScanSchema, {
  name: "sessions/a/scans/scan-5",
  pose: { translation: { x: 0, y: 0, z: 1.5 } },
  // The last is of a kind that a newer server knows.
  merge: { changes: [cupboard, door, { ...door, ...box(9, 4) }, { ...door, kind: 9 as SiteChangeKind }] },
});

test("what was moved is said with since when, how large and how far away", () => {
  const [came, gone] = changesOf(scan);
  expect(changeWords(came!, scan.pose!.translation, stationName, say, "en")).toBe(
    "New since station 3 · 2.0\u00a0m long, 1.8\u00a0m high · 5.0\u00a0m from this station",
  );
  expect(changeWords(gone!, undefined, stationName, say, "en")).toBe(
    "Gone, or open now, since station 1 · 2.0\u00a0m long, 1.8\u00a0m high",
  );
  // Of a server that says neither since when nor where.
  const bare = { ...came!, since: "", box: undefined, centre: undefined };
  expect(changeWords(bare, scan.pose!.translation, stationName, say, "en")).toBe("New here");
});

test("a scan's changes are counted in a sentence, in both languages", () => {
  expect(changesSentence(scan, say, "en")).toBe("Since earlier scans 1 thing came and 2 things are gone.");
  expect(changesSentence(scan, sagen, "de")).toBe("Seit früheren Scans 1 Ding dazugekommen und 2 Dinge verschwunden.");
  const one = create(ScanSchema, { merge: { changes: [door] } });
  expect(changesSentence(one, say, "en")).toBe("Since earlier scans 1 thing is gone.");
  expect(changesSentence(create(ScanSchema, { merge: {} }), say, "en")).toBe("");
  expect(changesSentence(create(ScanSchema, {}), say, "en")).toBe("");
});

test("the plan has the numbers of the list, each on its storey, with an outline as large as the thing", () => {
  const shown = (floor: number, top: number) =>
    changeMarks(scan, { floor, top }).map((mark) => (mark.type === "change" ? mark : undefined)!);
  expect(shown(0, 3).map(({ label }) => label)).toEqual(["+1", "−2"]);
  expect(shown(3, 6).map(({ label }) => label)).toEqual(["−3"]);
  expect(changesOf(scan).map(changeLabel)).toEqual(["+1", "−2", "−3"]);
  const [first] = shown(0, 3);
  expect(first!.outline).toEqual([
    { x: 2.8, y: 3 },
    { x: 3.2, y: 3 },
    { x: 3.2, y: 5 },
    { x: 2.8, y: 5 },
  ]);
});
