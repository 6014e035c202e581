import { expect, test } from "vitest";
import { around, closer, moved, near, projectPoint, turned, viewOf, type Orbit } from "../../src/draw/camera";
import { detail, filledShare } from "../../src/draw/solid";
import { invisible, packed, Splatter } from "../../src/draw/splat";
import type { Points } from "../../src/model/points";

const orbit: Orbit = { target: { x: 0, y: 0, z: 0 }, azimuth: -Math.PI / 2, elevation: 0, distance: 10 };
const background = packed(1, 2, 3);

function pointsOf(...places: [number, number, number][]): Points {
  return {
    origin: { x: 0, y: 0, z: 0 },
    xyz: Float32Array.from(places.flat()),
    normal: new Int8Array(3 * places.length),
    kind: new Uint8Array(places.length).fill(1),
    density: new Uint8Array(places.length).fill(255),
    parts: [{ first: 0, count: places.length, x: 0, y: 0, z: 0, radius: 20 }],
  };
}

function painted(points: Points, colours: number[], options: { count?: number; cut?: number; size?: number } = {}) {
  const splatter = new Splatter();
  splatter.resize(200, 100);
  splatter.clear(background);
  const view = viewOf(orbit, 200, 100);
  const { count = colours.length, cut = Infinity, size = 0.05 } = options;
  splatter.draw(points, Uint32Array.from(colours), points.parts[0]!, count, size, cut, view);
  const at = (place: [number, number, number]) => {
    const pixel = projectPoint(view, { x: place[0], y: place[1], z: place[2] });
    return splatter.colour[Math.floor(pixel.y) * 200 + Math.floor(pixel.x)];
  };
  return { splatter, view, at };
}

test("who looks north has east on the right and the sky above", () => {
  const view = viewOf(orbit, 200, 100);
  expect(view.eye).toEqual({ x: expect.closeTo(0), y: expect.closeTo(-10), z: expect.closeTo(0) });
  const pixel = projectPoint(view, { x: 1, y: 0, z: 0.5 });
  expect(pixel.depth).toBeCloseTo(10);
  expect(pixel.x - 100).toBeCloseTo(view.focal / 10);
  expect(50 - pixel.y).toBeCloseTo(view.focal / 20);
});

test("the nearer of two points is seen, in whichever order they are drawn", () => {
  const [red, blue] = [packed(255, 0, 0), packed(0, 0, 255)];
  for (const turn of [false, true]) {
    const places: [number, number, number][] = [
      [0, -5, 0],
      [0, 5, 0],
    ];
    const colours = [red, blue];
    if (turn) (places.reverse(), colours.reverse());
    expect(painted(pointsOf(...places), colours, { size: 0.3 }).at([0.02, 0, 0.02])).toBe(red);
  }
});

test("what is cut off, invisible, behind the eye or not asked for is not drawn", () => {
  const red = packed(255, 0, 0);
  const places: [number, number, number][] = [
    [0, 0, 1],
    [1, 0, 0],
    [0, -10 - near, 0],
    [-1, 0, 0],
  ];
  const { splatter, at } = painted(pointsOf(...places), [red, invisible, red, red], { count: 3, cut: 0.5 });
  expect(splatter.colour.every((colour) => colour === background)).toBe(true);
  expect(at([0, 0, 1])).toBe(background);
  expect(painted(pointsOf(...places), [red, red, red, red], { cut: 1.5 }).at([0, 0, 1])).toBe(red);
});

test("a wall of voxels closes: no pixel of it shows what is behind", () => {
  const places: [number, number, number][] = [];
  for (let x = -2; x <= 2; x += 0.05) for (let z = -0.6; z <= 0.6; z += 0.05) places.push([x, 0, z]);
  const { splatter } = painted(pointsOf(...places), Array(places.length).fill(packed(9, 9, 9)), { size: 0.065 });
  for (let y = 48; y < 52; ++y)
    for (let x = 90; x < 110; ++x) expect(splatter.colour[y * 200 + x]).not.toBe(background);
});

test("only what lies behind an edge is darkened", () => {
  const grey = packed(200, 200, 200);
  const { splatter, at } = painted(pointsOf([0, 5, 0], [-0.8, -5, 0]), [grey, grey], { size: 1.2 });
  splatter.shade(6);
  expect(at([-0.8, -5, 0])).toBe(grey);
  // Beside the nearer square, on the farther one.
  const row = splatter.colour.subarray(50 * 200, 51 * 200);
  expect(row.some((colour) => colour !== grey && colour !== background && (colour & 255) < 200)).toBe(true);
});

test("all of a site is in sight from where it is looked at as a whole, and fills the screen", () => {
  // A building that lies askew.
  const places = [0, 1, 2, 3, 4, 5, 6, 7].map((corner) => {
    const [u, v] = [corner & 1 ? 30 : -12, corner & 2 ? 21 : 3];
    return { x: 0.8 * u - 0.6 * v, y: 0.6 * u + 0.8 * v, z: corner & 4 ? 4 : -2 };
  });
  for (const [width, height] of [
    [800, 980],
    [1184, 560],
    [300, 900],
  ] as const) {
    for (let azimuth = 0; azimuth < 6.3; azimuth += 0.7) {
      const view = viewOf(around(places, azimuth, 0.8, width, height), width, height);
      let widest = 0;
      for (const place of places) {
        const pixel = projectPoint(view, place);
        expect(pixel.depth).toBeGreaterThan(near);
        const off = Math.max(Math.abs(pixel.x / width - 0.5), Math.abs(pixel.y / height - 0.5));
        expect(off).toBeLessThan(0.451);
        widest = Math.max(widest, off);
      }
      // And no farther away than it has to be.
      expect(widest).toBeGreaterThan(0.44);
    }
  }
});

test("a part that is in sight is never left out; one behind the eye, beside the picture or over the cut is", () => {
  const view = viewOf(orbit, 200, 100);
  const part = (x: number, y: number, z: number, radius = 1) => ({ first: 0, count: 1000, x, y, z, radius });
  expect(detail(part(0, -14, 0), view, 0.05, Infinity, 1)).toBe(0);
  expect(detail(part(40, 0, 0), view, 0.05, Infinity, 1)).toBe(0);
  expect(detail(part(0, 0, 9), view, 0.05, 7, 1)).toBe(0);
  // Where any point of its ball has a pixel, some are drawn.
  for (let i = 0; i < 2000; ++i) {
    const [x, y, z] = [17 * Math.sin(i), 17 * Math.sin(1.7 * i + 1), 9 * Math.sin(2.3 * i + 2)];
    const seen = [0, 1, 2, 3, 4, 5].some((k) => {
      const off = [0, 0, 0];
      off[k >> 1] = k & 1 ? 0.99 : -0.99;
      const pixel = projectPoint(view, { x: x + off[0]!, y: y + off[1]!, z: z + off[2]! });
      return pixel.depth > near && pixel.x >= 0 && pixel.x < 200 && pixel.y >= 0 && pixel.y < 100;
    });
    if (seen) expect(detail(part(x, y, z), view, 0.05, Infinity, 1)).toBeGreaterThan(0);
  }
  // A quarter of the points at twice the distance, once they are closer together than asked for.
  const [one, two] = [part(0, 30, 0, 0), part(0, 70, 0, 0)].map((far) => detail(far, view, 0.05, Infinity, 2));
  expect(one! / two!).toBeCloseTo(4);
});

test("a thumb turns without falling over, and carries what is below it", () => {
  let turning = orbit;
  for (let i = 0; i < 100; ++i) turning = turned(turning, 3, 50, 900);
  expect(turning.elevation).toBeLessThan(Math.PI / 2);
  const view = viewOf(orbit, 800, 600);
  const before = projectPoint(view, orbit.target);
  const after = projectPoint(viewOf(moved(orbit, 37, -21, view), 800, 600), orbit.target);
  expect(after.x - before.x).toBeCloseTo(37);
  expect(after.y - before.y).toBeCloseTo(-21);
  expect(closer(orbit, 2).distance).toBe(5);
});

test("a rectangle is filled by what is missing in its plane, not by what is measured or lies elsewhere", () => {
  const places: [number, number, number][] = [];
  for (let x = 0.025; x < 1; x += 0.05) for (let y = -0.975; y < 3; y += 0.05) places.push([100 + x, y, 0]);
  const corners = [
    { x: 100, y: 0, z: 0 },
    { x: 102, y: 0, z: 0 },
    { x: 102, y: 2, z: 0 },
    { x: 100, y: 2, z: 0 },
  ];
  const points = { ...pointsOf(...places), kind: new Uint8Array(places.length).fill(2) };
  expect(filledShare(points, corners, 0.05)).toBeCloseTo(0.5, 2);
  expect(filledShare({ ...points, kind: points.kind.map(() => 1) }, corners, 0.05)).toBe(0);
  expect(
    filledShare(
      points,
      corners.map((corner) => ({ ...corner, z: 0.5 })),
      0.05,
    ),
  ).toBe(0);
});
