import { expect, test } from "vitest";
import { cell, floorPlan, wallBetween, wayOver } from "../../src/model/floor_plan";
import { PanoramaPainter, project } from "../../src/model/panorama";
import { arrange, share } from "../../src/model/points";
import { SurfaceReader, type Surface } from "../../src/model/surface";

interface Element {
  x: number;
  y: number;
  z: number;
  nx?: number;
  ny?: number;
  nz?: number;
  kind?: number;
  density?: number;
  givenUp?: number;
}

// As the server writes it: three doubles, three floats, three bytes of colour, kind, density, area, samples,
// given up.
function ply(elements: Element[]): Uint8Array {
  const header =
    `ply\nformat binary_little_endian 1.0\ncomment surface\nelement vertex ${elements.length}\n` +
    "property double x\nproperty double y\nproperty double z\nproperty float nx\nproperty float ny\nproperty float nz\n" +
    "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar kind\nproperty float density\n" +
    "property float area\nproperty uint samples\nproperty uchar given_up\nend_header\n";
  const stride = 53;
  const head = new TextEncoder().encode(header);
  const bytes = new Uint8Array(head.length + stride * elements.length);
  bytes.set(head);
  const view = new DataView(bytes.buffer, head.length);
  elements.forEach((element, i) => {
    const at = stride * i;
    [element.x, element.y, element.z].forEach((value, k) => view.setFloat64(at + 8 * k, value, true));
    [element.nx ?? 0, element.ny ?? 0, element.nz ?? 1].forEach((value, k) =>
      view.setFloat32(at + 24 + 4 * k, value, true),
    );
    view.setUint8(at + 39, element.kind ?? 1);
    view.setFloat32(at + 40, element.density ?? 5000, true);
    view.setFloat32(at + 44, 0.0025, true);
    view.setUint8(at + 52, element.givenUp ?? 0);
  });
  return bytes;
}

function read(elements: Element[], pieces = 1000): Surface {
  const reader = new SurfaceReader();
  const bytes = ply(elements);
  for (let at = 0; at < bytes.length; at += pieces) reader.add(bytes.subarray(at, at + pieces));
  return reader.end();
}

// Two rooms of 3 m by 2 m side by side, with a door of 0.9 m between them, on a turned national grid.
const grid = { x: 452_100, y: 5_411_800, turn: 0.5 };
function place(u: number, v: number) {
  const [c, s] = [Math.cos(grid.turn), Math.sin(grid.turn)];
  return { x: grid.x + c * u - s * v, y: grid.y + s * u + c * v };
}
function rooms(): Element[] {
  const elements: Element[] = [];
  const step = 0.04;
  const wall = (u0: number, v0: number, u1: number, v1: number) => {
    const length = Math.hypot(u1 - u0, v1 - v0);
    const [nu, nv] = [-(v1 - v0) / length, (u1 - u0) / length];
    const [c, s] = [Math.cos(grid.turn), Math.sin(grid.turn)];
    for (let along = 0; along <= length; along += step) {
      for (let z = 0.02; z < 2.6; z += step) {
        const at = place(u0 + ((u1 - u0) * along) / length, v0 + ((v1 - v0) * along) / length);
        elements.push({ ...at, z, nx: c * nu - s * nv, ny: s * nu + c * nv, nz: 0 });
      }
    }
  };
  wall(0, 0, 6, 0);
  wall(0, 2, 6, 2);
  wall(0, 0, 0, 2);
  wall(6, 0, 6, 2);
  wall(3, 0, 3, 0.9);
  wall(3, 1.8, 3, 2);
  for (let u = 0.03; u < 6; u += step) {
    for (let v = 0.03; v < 2; v += step) {
      elements.push({ ...place(u, v), z: 0.01, nz: 1, density: u < 3 ? 5000 : 100 });
      // A lintel over the door, and a ceiling: nobody runs into them.
      if (Math.abs(u - 3) < 0.05 && v > 0.9 && v < 1.8) elements.push({ ...place(u, v), z: 2.05, nz: -1 });
      elements.push({ ...place(u, v), z: 2.6, nz: -1 });
    }
  }
  // Behind something in the second room nothing is known.
  for (let u = 5; u < 5.5; u += step)
    for (let z = 0.3; z < 1.5; z += step) elements.push({ ...place(u, 1.5), z, kind: 2, density: 0 });
  return elements;
}
const surface = read(rooms());
const plan = floorPlan(surface, 0, Infinity, 0.05, 2500);
const at = (u: number, v: number) => {
  const p = place(u, v);
  return Math.floor((p.y - plan.y) / plan.size) * plan.columns + Math.floor((p.x - plan.x) / plan.size);
};

test("a file reads the same in pieces of any size, to a millimetre on a national grid", () => {
  const elements = rooms().slice(0, 50);
  for (const pieces of [1, 7, 53, 400, 100_000]) {
    const got = read(elements, pieces);
    expect(got.count).toBe(50);
    elements.forEach((element, i) => expect(Math.abs(got.origin.x + got.xyz[3 * i]! - element.x)).toBeLessThan(1e-3));
  }
});

test("what has come so far is shown before the rest has", () => {
  const elements = rooms().slice(0, 100);
  const reader = new SurfaceReader();
  const bytes = ply(elements);
  expect(reader.soFar()).toBeUndefined();
  reader.add(bytes.subarray(0, bytes.length - 40 * 53 - 7));
  const part = reader.soFar()!;
  expect(part.count).toBe(59);
  expect(Array.from(part.xyz.subarray(0, 3 * 59))).toEqual(Array.from(read(elements).xyz.subarray(0, 3 * 59)));
  expect(floorPlan(part, 0, Infinity, 0.05, 2500).columns).toBeGreaterThan(0);
});

test("a file that is cut off, or is another one, is an error", () => {
  const reader = new SurfaceReader();
  reader.add(ply(rooms().slice(0, 10)).subarray(0, 700));
  expect(() => reader.end()).toThrow();
  expect(() => new SurfaceReader().add(new TextEncoder().encode("<!doctype html>"))).toThrow();
});

test("walls, floor and what is missing are where they are", () => {
  expect(plan.cells[at(3, 0.4)]).toBe(cell.wall);
  expect(plan.cells[at(1.5, 1)]).toBe(cell.floor);
  expect(plan.cells[at(4.5, 1)]).toBe(cell.thinFloor);
  expect(plan.cells[at(3, 1.35)]).not.toBe(cell.wall);
  expect(plan.missing[at(5.25, 1.5)]).toBe(2);
  expect(plan.missing[at(1.5, 1)]).toBe(0);
  expect(plan.direction % (Math.PI / 2)).toBeCloseTo(grid.turn, 1);
});

test("the way leads through the door, and keeps off the walls", () => {
  const way = wayOver(plan, place(1, 0.5), place(5, 0.5), 0.3);
  expect(way.length).toBeGreaterThan(2);
  let length = 0;
  for (let i = 1; i < way.length; ++i) {
    const [a, b] = [way[i - 1]!, way[i]!];
    length += Math.hypot(b.x - a.x, b.y - a.y);
    expect(wallBetween(plan, a, b)).toBe(false);
  }
  expect(wallBetween(plan, place(1, 0.5), place(5, 0.5))).toBe(true);
  // Not shorter than any way through the door can be, nor much longer.
  const shortest = 2 * Math.hypot(2, 0.4);
  expect(length).toBeGreaterThan(shortest - 0.2);
  expect(length).toBeLessThan(1.3 * shortest);
});

test("where no way is known it is a straight line", () => {
  expect(wayOver(plan, place(1, 1), { x: 0, y: 0 }, 0.3)).toEqual([place(1, 1), { x: 0, y: 0 }]);
});

test("a panorama shows what is on the left on the left, and the nearer thing before the farther", () => {
  const painter = new PanoramaPainter({ x: 0, y: 0, z: 1.5 }, 0, 720);
  // Ahead is +x; +y is on the left.
  painter.add(3, 0.5, 1.5, 0.1);
  painter.add(6, 1, 1.5, 0.1);
  const picture = painter.finish();
  const left = project(picture, { x: 3, y: 0.5, z: 1.5 });
  expect(left.x).toBeLessThan(360);
  expect(picture.range[Math.floor(left.y) * 720 + Math.floor(left.x)]).toBeCloseTo(Math.hypot(3, 0.5), 5);
  expect(project(picture, { x: 3, y: 0, z: 2.5 }).y).toBeLessThan(left.y);
});

test("what a scan was too near to see is filled, what it saw stays", () => {
  const painter = new PanoramaPainter({ x: 0, y: 0, z: 0 }, 0, 360);
  painter.add(2, 0, 0, 0.1);
  const rest = painter.rest();
  rest.add(0.4, 0, 0, 0.1);
  rest.add(0, 0.4, 0, 0.05);
  rest.add(0, -5, 0, 0.5);
  painter.takeWhereEmpty(rest, 0.75);
  const range = (x: number, y: number) => {
    const pixel = project(painter.panorama, { x, y, z: 0 });
    return painter.panorama.range[Math.floor(pixel.y) * 360 + Math.floor(pixel.x)]!;
  };
  expect(range(2, 0)).toBeCloseTo(2);
  expect(range(0, 0.4)).toBeCloseTo(0.4);
  expect(range(0, -5)).toBe(Infinity);
});

test("points keep all that was there, and no picture has more than it may", () => {
  const points = arrange(surface, 2500);
  expect(points.parts.reduce((sum, part) => sum + part.count, 0)).toBe(surface.count);
  const sorted = (xyz: Float32Array) => Array.from(xyz).sort((a, b) => a - b);
  expect(sorted(points.xyz)).toEqual(sorted(surface.xyz));
  const wanted = points.parts.map((part, i) => (i % 3 === 0 ? 0 : part.count / (1 + (i % 5))));
  for (const budget of [0, 100, 5_000, 1e9]) {
    const counts = share(points.parts, wanted, budget);
    expect(counts.reduce((sum, count) => sum + count, 0)).toBeLessThanOrEqual(Math.min(budget, surface.count));
    counts.forEach((count, i) => expect(count).toBeLessThanOrEqual(Math.min(points.parts[i]!.count, wanted[i]! + 1)));
  }
});

test("parts are boxes of their points, and hold each with what belongs to it", () => {
  const points = arrange(surface, 2500);
  const key = (x: number, y: number, z: number) => `${x.toFixed(3)} ${y.toFixed(3)} ${z.toFixed(3)}`;
  const kinds = new Map<string, number>();
  for (let i = 0; i < surface.count; ++i)
    kinds.set(key(surface.xyz[3 * i]!, surface.xyz[3 * i + 1]!, surface.xyz[3 * i + 2]!), surface.kind[i]!);
  for (const part of points.parts) {
    for (let i = part.first; i < part.first + part.count; ++i) {
      const [x, y, z] = [points.xyz[3 * i]!, points.xyz[3 * i + 1]!, points.xyz[3 * i + 2]!];
      expect(Math.hypot(x - part.x, y - part.y, z - part.z)).toBeLessThanOrEqual(part.radius + 1e-3);
      expect(points.kind[i]).toBe(kinds.get(key(x, y, z)));
    }
  }
});
