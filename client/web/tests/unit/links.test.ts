import { create } from "@bufbuild/protobuf";
import { expect, test } from "vitest";
import { linksOf } from "../../src/draw/links";
import { PoseGraphSchema } from "../../src/gen/vantage/v1/pose_graph_pb";
import { ScanSchema } from "../../src/gen/vantage/v1/scan_pb";

const scan = (name: string, z: number) => create(ScanSchema, { name, pose: { translation: { x: z, y: 1, z } } });
const graph = create(PoseGraphSchema, {
  links: [
    { firstScan: "a", secondScan: "b", overlapShare: 0.6 },
    { firstScan: "b", secondScan: "c", overlapShare: 0.1 },
    { firstScan: "a", secondScan: "gone" },
    { firstScan: "c", secondScan: "d", inDoubt: true },
  ],
  // The weakest of all, which need not be weak.
  weakLinks: [
    { firstScan: "b", secondScan: "c", bridge: true },
    { firstScan: "a", secondScan: "b", relativeSigmaM: 0.0006 },
  ],
});

test("links are drawn on each storey that they touch, the weak ones as such", () => {
  const scans = [scan("a", 1.5), scan("b", 1.6), scan("c", 4.5), scan("d", 4.4)];
  const shown = (floor: number, top: number, accuracy = 0.01) =>
    linksOf(graph, scans, { floor, top }, accuracy).map(
      ({ scans: [from, to], weak }) => `${from}${to}${weak ? "?" : ""}`,
    );
  expect(shown(0, 3)).toEqual(["ab", "bc?"]);
  expect(shown(0, 3, 0.001)).toEqual(["ab?", "bc?"]);
  expect(shown(3, Infinity)).toEqual(["bc?", "cd?"]);
  expect(linksOf(undefined, scans, { floor: 0, top: 3 }, 0.01)).toEqual([]);
});
