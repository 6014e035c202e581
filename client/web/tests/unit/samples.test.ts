import { expect, test } from "vitest";
import { dotsAt } from "../../src/draw/samples";
import { SampleAgreement } from "../../src/gen/vantage/v1/pose_comparison_pb";

const half = Math.SQRT1_2;

test("samples lie where the pose puts them", () => {
  // A quarter turn to the left about the vertical: what is ahead of the scanner (+x) is at +y in the world.
  const pose = { rotation: { w: half, x: 0, y: 0, z: half }, translation: { x: 10, y: 20, z: 1.5 } };
  const dots = dotsAt([2, 0, 0, 0, 3, 0.1], pose, [SampleAgreement.FITS, SampleAgreement.BEHIND_SURFACE]);
  expect([...dots.x]).toEqual([expect.closeTo(10), expect.closeTo(7)]);
  expect([...dots.y]).toEqual([expect.closeTo(22), expect.closeTo(20)]);
  expect(dots.how).toEqual(["fits", "against"]);
});

test("a tilt moves what is above aside, as a matrix would", () => {
  // About x by 30 degrees: y' = y cos - z sin, z' = y sin + z cos.
  const angle = Math.PI / 6;
  const pose = {
    rotation: { w: Math.cos(angle / 2), x: Math.sin(angle / 2), y: 0, z: 0 },
    translation: { x: 0, y: 0, z: 0 },
  };
  const dots = dotsAt([1, 0.4, 0.2], pose, []);
  expect(dots.y[0]).toBeCloseTo(0.4 * Math.cos(angle) - 0.2 * Math.sin(angle));
  expect(dots.x[0]).toBeCloseTo(1);
  expect(dots.how).toEqual(["unknown"]);
});

test("floor and ceiling are left out", () => {
  const level = { rotation: { w: 1, x: 0, y: 0, z: 0 }, translation: { x: 0, y: 0, z: 1.5 } };
  expect(dotsAt([1, 0, -1.5, 1, 0, 1.1, 1, 0, 0], level, []).x.length).toBe(1);
});
