// The surface as points for 3D, so ordered that any beginning of a part is an even sample of it: how many
// are drawn is chosen for each picture, by how large the part appears.
import type { Surface } from "./surface";

export interface Part {
  // Index of its first point, and how many it has.
  first: number;
  count: number;
  // Its middle, m, from the surface's origin, and how far its points lie from there at most.
  x: number;
  y: number;
  z: number;
  radius: number;
}

export interface Points {
  origin: { x: number; y: number; z: number };
  xyz: Float32Array;
  // Unit normals, of 127.
  normal: Int8Array;
  kind: Uint8Array;
  // Density over the one that is required, 255 is twice.
  density: Uint8Array;
  parts: Part[];
}

// Edge of the cubes that the site is cut into, m.
const partSize = 4;

export function arrange(surface: Surface, required: number): Points {
  const { count, xyz } = surface;
  const points: Points = {
    origin: surface.origin,
    xyz: new Float32Array(3 * count),
    normal: new Int8Array(3 * count),
    kind: new Uint8Array(count),
    density: new Uint8Array(count),
    parts: [],
  };
  // The cube of each point, by number in the order in which cubes are met; how many points each has.
  const numbers = new Map<number, number>();
  const cubeOf = new Uint32Array(count);
  const counts: number[] = [];
  // Cubes of a site of 2^16 of them in each direction, which is more than anybody surveys.
  const side = 65_536;
  const step = (value: number) => Math.floor(value / partSize) + side / 2;
  for (let i = 0; i < count; ++i) {
    const key = (step(xyz[3 * i]!) * side + step(xyz[3 * i + 1]!)) * side + step(xyz[3 * i + 2]!);
    let number = numbers.get(key);
    if (number === undefined) {
      number = counts.length;
      numbers.set(key, number);
      counts.push(0);
    }
    cubeOf[i] = number;
    counts[number]! += 1;
  }
  const firsts: number[] = [];
  counts.reduce((first, own) => (firsts.push(first), first + own), 0);
  const next = [...firsts];
  const order = new Uint32Array(count);
  for (let i = 0; i < count; ++i) order[next[cubeOf[i]!]!++] = i;
  // The same order each time: a picture does not flicker when the model is loaded again.
  let state = 1;
  const random = () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 4294967296;
  };
  counts.forEach((own, cube) => {
    const first = firsts[cube]!;
    for (let i = own - 1; i > 0; --i) {
      const j = Math.floor(random() * (i + 1));
      const kept = order[first + i]!;
      order[first + i] = order[first + j]!;
      order[first + j] = kept;
    }
    const lower = [Infinity, Infinity, Infinity];
    const upper = [-Infinity, -Infinity, -Infinity];
    for (let to = first; to < first + own; ++to) {
      const from = order[to]!;
      for (let axis = 0; axis < 3; ++axis) {
        const value = xyz[3 * from + axis]!;
        points.xyz[3 * to + axis] = value;
        points.normal[3 * to + axis] = surface.normal[3 * from + axis]!;
        if (value < lower[axis]!) lower[axis] = value;
        if (value > upper[axis]!) upper[axis] = value;
      }
      points.kind[to] = surface.kind[from]!;
      points.density[to] = Math.min(255, Math.round((127.5 * surface.density[from]!) / required));
    }
    points.parts.push({
      first,
      count: own,
      x: (lower[0]! + upper[0]!) / 2,
      y: (lower[1]! + upper[1]!) / 2,
      z: (lower[2]! + upper[2]!) / 2,
      radius: Math.hypot(upper[0]! - lower[0]!, upper[1]! - lower[1]!, upper[2]! - lower[2]!) / 2,
    });
  });
  return points;
}

// How many points of each part are drawn, at most `budget` together. `wanted`: how many each could use, which is 0
// where it is out of sight. Where all together want more, each gets its share.
export function share(parts: readonly Part[], wanted: readonly number[], budget: number): number[] {
  const most = parts.map((part, i) => Math.min(part.count, Math.ceil(wanted[i]!)));
  const whole = most.reduce((sum, count) => sum + count, 0);
  if (whole <= budget) return most;
  return most.map((count) => Math.floor((count * budget) / whole));
}
