// A small flat and a scanner in it: what a crew would send. Independent of the product's own simulation: boxes,
// rays, and the encoding as proto/vantage/v1/upload.proto describes it.

import { deflateSync } from "node:zlib";

export interface Place {
  x: number;
  y: number;
  z: number;
}

export type Box = readonly [x0: number, y0: number, z0: number, x1: number, y1: number, z1: number];

// Two rooms of 5 m by 4 m and 4 m by 4 m, a door between them, things in both. Metres, z up.
const flatHeight = 2.6;
export const flat: readonly Box[] = [
  [-0.2, -0.2, -0.2, 9.3, 4.2, 0],
  [-0.2, -0.2, flatHeight, 9.3, 4.2, flatHeight + 0.2],
  [-0.2, -0.2, 0, 0, 4.2, flatHeight],
  [9.1, -0.2, 0, 9.3, 4.2, flatHeight],
  [-0.2, -0.2, 0, 9.3, 0, flatHeight],
  [-0.2, 4, 0, 9.3, 4.2, flatHeight],
  // The wall between the rooms, the door in it, its lintel.
  [5, 0, 0, 5.1, 1.5, flatHeight],
  [5, 2.5, 0, 5.1, 4, flatHeight],
  [5, 1.5, 2.1, 5.1, 2.5, flatHeight],
  // A cupboard, a table, a shelf, a bed.
  [0, 3.4, 0, 1.6, 4, 2.0],
  [2.4, 0.5, 0.7, 3.6, 1.3, 0.76],
  [2.5, 0.6, 0, 2.56, 0.66, 0.7],
  [3.4, 1.1, 0, 3.46, 1.16, 0.7],
  [8.7, 2.2, 0, 9.1, 4, 1.8],
  [6.2, 0, 0, 7.4, 1.9, 0.5],
];

// The same random numbers each time.
export function randomNumbers(seed: number): () => number {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let value = Math.imul(state ^ (state >>> 15), state | 1);
    value ^= value + Math.imul(value ^ (value >>> 7), value | 61);
    return ((value ^ (value >>> 14)) >>> 0) / 4294967296;
  };
}

function hit(boxes: readonly Box[], from: Place, d: Place): number {
  let nearest = Infinity;
  for (const box of boxes) {
    let [enter, leave] = [-Infinity, Infinity];
    for (const [p, v, low, high] of [
      [from.x, d.x, box[0], box[3]],
      [from.y, d.y, box[1], box[4]],
      [from.z, d.z, box[2], box[5]],
    ] as const) {
      if (Math.abs(v) < 1e-12) {
        if (p < low || p > high) enter = Infinity;
        continue;
      }
      const [a, b] = [(low - p) / v, (high - p) / v];
      enter = Math.max(enter, Math.min(a, b));
      leave = Math.min(leave, Math.max(a, b));
    }
    if (enter <= leave && enter > 0 && enter < nearest) nearest = enter;
  }
  return nearest;
}

const step = (0.5 * Math.PI) / 180;
const lowest = (-60 * Math.PI) / 180;
const noise = 0.002;

const columns = Math.round((2 * Math.PI) / step);
const rows = Math.floor((Math.PI / 2 - lowest) / step);
const azimuthOf = (column: number) => -Math.PI + column * step;
const elevationOf = (row: number) => lowest + row * step;

// The range that a scanner upright at `at`, whose front points to `heading` (rad), measures in each cell, m, column
// by column; 0: no echo. `things`: what stands in the flat besides.
function ranges(at: Place, heading: number, seed: number, things: readonly Box[]): Float64Array {
  const boxes = [...flat, ...things];
  const random = randomNumbers(seed);
  const gauss = () => Math.sqrt(-2 * Math.log(random() || 1e-12)) * Math.cos(2 * Math.PI * random());
  const measured = new Float64Array(columns * rows);
  for (let column = 0; column < columns; ++column) {
    const azimuth = azimuthOf(column) + heading;
    for (let row = 0; row < rows; ++row) {
      const [c, s] = [Math.cos(elevationOf(row)), Math.sin(elevationOf(row))];
      const range = hit(boxes, at, { x: c * Math.cos(azimuth), y: c * Math.sin(azimuth), z: s });
      if (range >= 0.5 && range < 20) measured[column * rows + row] = range + noise * gauss();
    }
  }
  return measured;
}

// An encoded range image.
export function scan(at: Place, heading: number, seed: number, things: readonly Box[] = []): Uint8Array {
  const measured = ranges(at, heading, seed, things);
  const size = 32 + 8 * rows + columns * (8 + 4 * rows);
  const bytes = new Uint8Array(size);
  const view = new DataView(bytes.buffer);
  bytes.set([0x56, 0x52, 0x49, 0x4d]);
  view.setUint16(4, 1, true);
  view.setUint16(6, 1, true);
  view.setUint32(8, columns, true);
  view.setUint32(12, rows, true);
  view.setFloat64(16, step, true);
  view.setFloat64(24, step, true);
  for (let row = 0; row < rows; ++row) view.setFloat64(32 + 8 * row, elevationOf(row), true);
  for (let column = 0; column < columns; ++column) {
    const begin = 32 + 8 * rows + column * (8 + 4 * rows);
    view.setFloat64(begin, azimuthOf(column), true);
    let before = 0;
    for (let row = 0; row < rows; ++row) {
      const range = measured[column * rows + row]!;
      let code = 0;
      if (range > 0) {
        const tenths = Math.max(1, Math.round(range * 1e4));
        const difference = tenths - before;
        code = 2 + (difference >= 0 ? 2 * difference : -2 * difference - 1);
        before = tenths;
      }
      for (let plane = 0; plane < 4; ++plane) bytes[begin + 8 + plane * rows + row] = (code >>> (8 * plane)) & 0xff;
    }
  }
  return bytes;
}

// The same as a PLY file of points in the flat's own frame, in `unit`, m: it does not say where the scanner stood.
export function points(at: Place, seed: number, unit: number): Uint8Array {
  const measured = ranges(at, 0, seed, []);
  const count = measured.reduce((sum, range) => sum + (range > 0 ? 1 : 0), 0);
  const axes = ["x", "y", "z"].map((axis) => `property float ${axis}\n`).join("");
  const head = `ply\nformat binary_little_endian 1.0\nelement vertex ${count}\n${axes}end_header\n`;
  const bytes = new Uint8Array(head.length + 12 * count);
  bytes.set(new TextEncoder().encode(head));
  const view = new DataView(bytes.buffer, head.length);
  let written = 0;
  measured.forEach((range, i) => {
    if (range === 0) return;
    const [azimuth, elevation] = [azimuthOf(Math.floor(i / rows)), elevationOf(i % rows)];
    const level = range * Math.cos(elevation);
    const point = [
      at.x + level * Math.cos(azimuth),
      at.y + level * Math.sin(azimuth),
      at.z + range * Math.sin(elevation),
    ];
    for (const coordinate of point) view.setFloat32(4 * written++, coordinate / unit, true);
  });
  return bytes;
}

// A surveyor in the flat: knows where the job's own frame lies in it, which begins with the first scan.
export class Surveyor {
  readonly start: Place = { x: 1.6, y: 2, z: 1.5 };
  readonly heading = 0.7;
  // What somebody put into the flat meanwhile.
  things: Box[] = [];
  #made = 0;

  first(): Uint8Array {
    return scan(this.start, this.heading, ++this.#made, this.things);
  }

  // A scan from a place in the flat itself, which nobody knows in the job's frame.
  inFlat(place: Place): Uint8Array {
    const seed = ++this.#made;
    return scan(place, 2 * Math.PI * randomNumbers(1000 + seed)(), seed, this.things);
  }

  // A scan from a place in the job's frame; the tripod misses it by some centimetres, and the scanner is turned
  // anyhow.
  at(place: Place): Uint8Array {
    const seed = ++this.#made;
    const random = randomNumbers(1000 + seed);
    const [c, s] = [Math.cos(this.heading), Math.sin(this.heading)];
    const off = () => 0.08 * (random() - 0.5);
    const there = {
      x: this.start.x + c * place.x - s * place.y + off(),
      y: this.start.y + s * place.x + c * place.y + off(),
      z: this.start.z + place.z + off(),
    };
    return scan(there, 2 * Math.PI * random(), seed, this.things);
  }
}

// The walls of the flat as an architect drew them, without what stands in it: a grey PNG, `pixel` m a pixel, with
// `border` pixels of paper around it.
export const drawn = { pixel: 0.02, border: 20, left: -0.2, top: 4.2, width: 9.5, height: 4.4 };
export function floorPlanPicture(): Uint8Array {
  const [width, height] = [drawn.width, drawn.height].map((m) => Math.round(m / drawn.pixel) + 2 * drawn.border) as [
    number,
    number,
  ];
  const walls = flat.filter(([, , z0, , , z1]) => z0 === 0 && z1 === flatHeight);
  const rows = Buffer.alloc((width + 1) * height, 255);
  for (let y = 0; y < height; ++y) {
    rows[y * (width + 1)] = 0;
    for (let x = 0; x < width; ++x) {
      const at = inFlat({ x: x + 0.5, y: y + 0.5 });
      const isWall = walls.some(([x0, y0, , x1, y1]) => at.x > x0 && at.x < x1 && at.y > y0 && at.y < y1);
      if (isWall) rows[y * (width + 1) + 1 + x] = 30;
    }
  }
  const head = Buffer.alloc(13);
  head.writeUInt32BE(width, 0);
  head.writeUInt32BE(height, 4);
  head[8] = 8;
  const signature = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
  return Buffer.concat([
    signature,
    chunk("IHDR", head),
    chunk("IDAT", deflateSync(rows)),
    chunk("IEND", Buffer.alloc(0)),
  ]);
}

// Between the picture's pixels, y down, and the flat, m.
export function inFlat(pixel: { x: number; y: number }): { x: number; y: number } {
  return {
    x: drawn.left + (pixel.x - drawn.border) * drawn.pixel,
    y: drawn.top - (pixel.y - drawn.border) * drawn.pixel,
  };
}
export function inPicture(place: { x: number; y: number }): { x: number; y: number } {
  return {
    x: drawn.border + (place.x - drawn.left) / drawn.pixel,
    y: drawn.border + (drawn.top - place.y) / drawn.pixel,
  };
}

function chunk(type: string, data: Buffer): Buffer {
  const named = Buffer.concat([Buffer.from(type, "latin1"), data]);
  const [size, sum] = [Buffer.alloc(4), Buffer.alloc(4)];
  size.writeUInt32BE(data.length);
  sum.writeUInt32BE(crc32(named));
  return Buffer.concat([size, named, sum]);
}

function crc32(bytes: Uint8Array): number {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; ++bit) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return (crc ^ 0xffffffff) >>> 0;
}
