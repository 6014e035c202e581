import { expect, test } from "vitest";
import {
  barLength,
  fit,
  matrix,
  pan,
  toScreen,
  toWorld,
  turnFor,
  zoom,
  type Projection,
} from "../../src/draw/projection";

const some: Projection = { centre: { x: 452_000.5, y: -3 }, scale: 43, turn: 0.7, width: 800, height: 500 };

test("the world comes back from the screen, on a national grid, too", () => {
  for (const [x, y] of [
    [0, 0],
    [123, 456],
    [800, 500],
  ] as const) {
    const back = toScreen(some, toWorld(some, { x, y }));
    expect(back.x).toBeCloseTo(x, 6);
    expect(back.y).toBeCloseTo(y, 6);
  }
});

test("unturned, east is right and north is up", () => {
  const level = { ...some, turn: 0 };
  const middle = toScreen(level, level.centre);
  expect(middle).toEqual({ x: 400, y: 250 });
  expect(toScreen(level, { x: level.centre.x + 1, y: level.centre.y }).x).toBeCloseTo(443);
  expect(toScreen(level, { x: level.centre.x, y: level.centre.y + 1 }).y).toBeCloseTo(207);
});

test("a positive turn turns the world counter-clockwise on the screen", () => {
  const turned = { ...some, turn: Math.PI / 2 };
  const east = toScreen(turned, { x: turned.centre.x + 1, y: turned.centre.y });
  expect(east.x).toBeCloseTo(400);
  expect(east.y).toBeCloseTo(250 - 43);
});

test("the canvas transform does the same as toScreen", () => {
  const near = { ...some, centre: { x: 3, y: -2 } };
  const [a, b, c, d, e, f] = matrix(near);
  const at = { x: 5.5, y: 1.25 };
  const screen = toScreen(near, at);
  expect(a * at.x + c * at.y + e).toBeCloseTo(screen.x, 9);
  expect(b * at.x + d * at.y + f).toBeCloseTo(screen.y, 9);
});

test("what has to be in sight is, within the margins, whatever the turn", () => {
  const margin = { top: 80, right: 10, bottom: 20, left: 40 };
  const points = [
    { x: 10, y: 4 },
    { x: -3, y: 9 },
    { x: 2, y: -7 },
  ];
  for (let turn = 0; turn < 6.3; turn += 0.3) {
    const projection = fit(points, turn, { width: 600, height: 400 }, margin, 1000);
    const at = points.map((point) => toScreen(projection, point));
    expect(Math.min(...at.map((p) => p.x))).toBeGreaterThanOrEqual(40 - 1e-6);
    expect(Math.max(...at.map((p) => p.x))).toBeLessThanOrEqual(590 + 1e-6);
    expect(Math.min(...at.map((p) => p.y))).toBeGreaterThanOrEqual(80 - 1e-6);
    expect(Math.max(...at.map((p) => p.y))).toBeLessThanOrEqual(380 + 1e-6);
    // One side is filled.
    const wide = Math.max(...at.map((p) => p.x)) - Math.min(...at.map((p) => p.x));
    const high = Math.max(...at.map((p) => p.y)) - Math.min(...at.map((p) => p.y));
    expect(Math.max(wide / 550, high / 300)).toBeCloseTo(1, 6);
  }
});

test("a point alone, and none, are not blown up", () => {
  const margin = { top: 0, right: 0, bottom: 0, left: 0 };
  expect(fit([{ x: 1, y: 1 }], 0, { width: 100, height: 100 }, margin, 90).scale).toBe(90);
  expect(fit([], 0, { width: 100, height: 100 }, margin, 90).scale).toBe(90);
});

test("zooming keeps what is under the finger, panning moves by the finger", () => {
  const finger = { x: 120, y: 333 };
  const under = toWorld(some, finger);
  const closer = toScreen(zoom(some, 1.7, finger), under);
  expect(closer.x).toBeCloseTo(finger.x, 6);
  expect(closer.y).toBeCloseTo(finger.y, 6);
  const moved = toScreen(pan(some, 30, -12), under);
  expect(moved.x).toBeCloseTo(150, 6);
  expect(moved.y).toBeCloseTo(321, 6);
});

test("walls are upright or level, and the way leads up", () => {
  for (const walls of [0, 0.4, 1.2]) {
    for (let heading = 0; heading < 6.28; heading += 0.35) {
      const turn = turnFor(walls, { x: 0, y: 0 }, { x: Math.cos(heading), y: Math.sin(heading) });
      expect(Math.abs(Math.sin(2 * (walls + turn)))).toBeCloseTo(0, 9);
      expect(Math.sin(heading + turn)).toBeGreaterThanOrEqual(Math.SQRT1_2 - 1e-9);
    }
  }
});

test("the scale bar is a round number that fits", () => {
  for (const scale of [0.7, 3, 17, 43, 90, 800]) {
    const length = barLength(scale, 130);
    expect(length * scale).toBeLessThanOrEqual(130);
    expect(length * scale).toBeGreaterThan(130 / 2.6);
    expect([1, 2, 5]).toContain(Number(length.toExponential(0).split("e")[0]));
  }
});
