import { create } from "@bufbuild/protobuf";
import { expect, test } from "vitest";
import { ClaimSchema, StationSchema } from "../../src/gen/vantage/v1/fleet_pb";
import { RankedViewSchema } from "../../src/gen/vantage/v1/plan_pb";
import { RejectionSchema } from "../../src/gen/vantage/v1/session_pb";
import { freeViews } from "../../src/job/free_views";

const at = (x: number, z = 1.5) => ({ x, y: 0, z });
const views = [0, 1, 2, 3, 4, 5].map((x) => create(RankedViewSchema, { position: at(x) }));
const none = { claims: [], stations: [], rejections: [] };
const left = (...taken: Parameters<typeof freeViews> extends [unknown, ...infer Rest] ? Rest : never) =>
  freeViews(views, ...taken).map((view) => view.position!.x);

test("what others keep, what was scanned and where nobody can stand is not offered", () => {
  const site = {
    claims: [
      create(ClaimSchema, { scanner: "blue", position: at(0.5) }),
      create(ClaimSchema, { scanner: "red", position: at(3) }),
    ],
    stations: [create(StationSchema, { position: at(5) })],
    rejections: [create(RejectionSchema, { position: at(2), radiusM: 0.4 })],
  };
  expect(left(site, "red", [])).toEqual([3, 4]);
  expect(left(site, "blue", [])).toEqual([0, 1, 4]);
});

test("what waits to be sent counts at once", () => {
  const waiting = [
    { kind: "createStation", payload: { position: at(1), scanner: "" } },
    { kind: "rejectView", payload: { position: at(4), radius: 1.5, reason: "" } },
    { kind: "releaseClaim", payload: { name: "c" } },
  ];
  expect(left(none, "", waiting)).toEqual([0, 2]);
});

test("another floor is another place", () => {
  expect(left({ ...none, stations: [create(StationSchema, { position: at(2, 4.5) })] }, "", [])).toEqual([
    0, 1, 2, 3, 4, 5,
  ]);
});
