// The surface as points for 3D, so ordered that any beginning of a part is an even sample of it: how many
// are drawn is chosen for each picture, by how near the part is.
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
  kind: Uint8Array;
  // Density over the one that is required, 255 is twice.
  density: Uint8Array;
  parts: Part[];
}

// Edge of the cubes that the site is cut into, m.
const partSize = 4;

export function arrange(surface: Surface, required: number): Points {
  const { count, xyz } = surface;
  const groups = new Map<string, number[]>();
  for (let i = 0; i < count; ++i) {
    const key = `${Math.floor(xyz[3 * i]! / partSize)},${Math.floor(xyz[3 * i + 1]! / partSize)},${Math.floor(xyz[3 * i + 2]! / partSize)}`;
    const group = groups.get(key);
    if (group === undefined) groups.set(key, [i]);
    else group.push(i);
  }
  const points: Points = {
    origin: surface.origin,
    xyz: new Float32Array(3 * count),
    kind: new Uint8Array(count),
    density: new Uint8Array(count),
    parts: [],
  };
  let first = 0;
  // The same order each time: a picture does not flicker when the model is loaded again.
  let state = 1;
  const random = () => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return state / 4294967296;
  };
  for (const group of groups.values()) {
    for (let i = group.length - 1; i > 0; --i) {
      const j = Math.floor(random() * (i + 1));
      [group[i], group[j]] = [group[j]!, group[i]!];
    }
    const [lower, upper] = [
      [Infinity, Infinity, Infinity],
      [-Infinity, -Infinity, -Infinity],
    ];
    group.forEach((from, i) => {
      const to = first + i;
      for (let axis = 0; axis < 3; ++axis) {
        const value = xyz[3 * from + axis]!;
        points.xyz[3 * to + axis] = value;
        lower[axis] = Math.min(lower[axis]!, value);
        upper[axis] = Math.max(upper[axis]!, value);
      }
      points.kind[to] = surface.kind[from]!;
      points.density[to] = Math.min(255, Math.round((127.5 * surface.density[from]!) / required));
    });
    points.parts.push({
      first,
      count: group.length,
      x: (lower[0]! + upper[0]!) / 2,
      y: (lower[1]! + upper[1]!) / 2,
      z: (lower[2]! + upper[2]!) / 2,
      radius: Math.hypot(upper[0]! - lower[0]!, upper[1]! - lower[1]!, upper[2]! - lower[2]!) / 2,
    });
    first += group.length;
  }
  return points;
}

// How many points of each part are drawn, at most `budget` together: by how large the part appears, and
// none of one that has less.
export function share(parts: readonly Part[], eye: { x: number; y: number; z: number }, budget: number): number[] {
  const whole = parts.reduce((sum, part) => sum + part.count, 0);
  if (whole <= budget) return parts.map((part) => part.count);
  const wanted = parts.map((part) => {
    const distance = Math.max(part.radius, Math.hypot(part.x - eye.x, part.y - eye.y, part.z - eye.z));
    return part.count / (distance * distance);
  });
  const result = parts.map(() => 0);
  let left = budget;
  let open = parts.map((_, i) => i);
  // What parts that have too few leave goes to the others.
  for (let round = 0; round < 8 && left > 0 && open.length > 0; ++round) {
    const sum = open.reduce((total, i) => total + wanted[i]!, 0);
    const next: number[] = [];
    let given = 0;
    for (const i of open) {
      const more = Math.min(parts[i]!.count - result[i]!, Math.floor((left * wanted[i]!) / sum));
      result[i]! += more;
      given += more;
      if (result[i]! < parts[i]!.count) next.push(i);
    }
    left -= given;
    open = next;
    if (given === 0) break;
  }
  return result;
}
