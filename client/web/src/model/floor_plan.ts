// A storey from above, as a raster: what is floor, what stands on it, and what is missing over it.
import { kind, type Surface } from "./surface";

// What a cell shows, in the order in which one hides the other where both are there.
export const cell = {
  nothing: 0,
  // Floor at the required density.
  floor: 1,
  // Floor below it.
  thinFloor: 2,
  // Something that stands on the floor, lower than a wall.
  furniture: 3,
  wall: 4,
} as const;

export interface FloorPlan {
  // World coordinates of the lower left corner of the first cell, m.
  x: number;
  y: number;
  // Edge of a cell, m.
  size: number;
  columns: number;
  rows: number;
  // Of `cell`, row by row from the smallest y.
  cells: Uint8Array;
  // Which kind of surface is missing most over the cell (`kind`, with `kind.measured` for surface that
  // is there and too thin); 0: none to speak of.
  missing: Uint8Array;
  // The walls' direction, rad, [0, pi/2): of most of them, against the world's x.
  direction: number;
  // Places at the edge of what is known, world, m: all of it lies between them.
  extent: { x: number; y: number }[];
}

// Over the floor, m: below it is floor, from it on something stands there.
const floorBand = 0.15;
// Where walls are told from furniture, over the floor, m: over tables and under lintels.
const wallBand: readonly [number, number] = [0.9, 1.8];
// Of the voxels of that band, so many make a wall.
const wallShare = 0.6;
// What a person walks under is no part of a plan, lintels and ceilings: all higher than this over the
// floor, m, is left out.
const ceiling = 1.85;
// Missing surface over a cell is shown from this many times the cell's own area on: a voxel or two at
// the edge of something keeps no one busy.
const missingFrom = 1;
// Cells at most: a plan of 100 m by 100 m in cells of 5 cm; larger ones have larger cells.
const mostCells = 4_000_000;

// `floor` is the storey's, m, world; `top` where the next one begins; `size` the voxels' edge, m.
export function floorPlan(surface: Surface, floor: number, top: number, size: number, required: number): FloorPlan {
  const { xyz, origin, count } = surface;
  const low = floor - 0.3 - origin.z;
  const high = Math.min(top - 0.3, floor + ceiling) - origin.z;
  let [minX, minY, maxX, maxY] = [Infinity, Infinity, -Infinity, -Infinity];
  for (let i = 0; i < count; ++i) {
    const z = xyz[3 * i + 2]!;
    if (z < low || z > high) continue;
    const x = xyz[3 * i]!;
    const y = xyz[3 * i + 1]!;
    if (x < minX) minX = x;
    if (x > maxX) maxX = x;
    if (y < minY) minY = y;
    if (y > maxY) maxY = y;
  }
  if (minX > maxX) [minX, minY, maxX, maxY] = [0, 0, 0, 0];
  let edge = size;
  while (((maxX - minX) / edge + 2) * ((maxY - minY) / edge + 2) > mostCells) edge *= 2;
  // Cells begin where voxels do, so that each column of voxels is one cell.
  minX = Math.floor((minX + origin.x) / edge) * edge - origin.x;
  minY = Math.floor((minY + origin.y) / edge) * edge - origin.y;
  const columns = Math.floor((maxX - minX) / edge) + 1;
  const rows = Math.floor((maxY - minY) / edge) + 1;
  const cells = new Uint8Array(columns * rows);
  const missing = new Uint8Array(columns * rows);
  const upright = new Uint8Array(columns * rows);
  const stands = new Uint8Array(columns * rows);
  const missingArea = new Float32Array(4 * columns * rows);
  const turns = new Float64Array(90);
  for (let i = 0; i < count; ++i) {
    const z = xyz[3 * i + 2]!;
    if (z < low || z > high) continue;
    const at = Math.floor((xyz[3 * i + 1]! - minY) / edge) * columns + Math.floor((xyz[3 * i]! - minX) / edge);
    const over = z + origin.z - floor;
    const area = surface.area[i]!;
    if (surface.kind[i] === kind.measured) {
      const thin = surface.density[i]! < required && surface.givenUp[i] === 0;
      if (over < floorBand) {
        if (surface.normal[3 * i + 2]! > 90) cells[at] = Math.max(cells[at]!, thin ? cell.thinFloor : cell.floor);
      } else {
        if (stands[at]! < 255) stands[at]! += 1;
        if (over >= wallBand[0] && over <= wallBand[1] && upright[at]! < 255) upright[at]! += 1;
      }
      if (thin && over >= floorBand) missingArea[4 * at]! += area;
      const [nx, ny] = [surface.normal[3 * i]!, surface.normal[3 * i + 1]!];
      if (Math.abs(surface.normal[3 * i + 2]!) < 30 && nx * nx + ny * ny > 10_000) {
        const degrees = (Math.atan2(ny, nx) * 180) / Math.PI;
        turns[Math.floor(((degrees % 90) + 90) % 90)]! += area;
      }
    } else if (surface.givenUp[i] === 0) {
      missingArea[4 * at + surface.kind[i]! - 1]! += area;
    }
  }
  const wallVoxels = (wallShare * (wallBand[1] - wallBand[0])) / size;
  for (let at = 0; at < cells.length; ++at) {
    if (upright[at]! >= wallVoxels) cells[at] = cell.wall;
    else if (stands[at]! >= 2) cells[at] = cell.furniture;
    let most = missingFrom * edge * edge;
    for (let of = 0; of < 4; ++of) {
      if (missingArea[4 * at + of]! > most) {
        most = missingArea[4 * at + of]!;
        missing[at] = of + 1;
      }
    }
  }
  return {
    x: minX + origin.x,
    y: minY + origin.y,
    size: edge,
    columns,
    rows,
    cells,
    missing,
    direction: mainDirection(turns),
    extent: extentOf(cells, columns, rows).map(([x, y]) => ({
      x: minX + origin.x + x * edge,
      y: minY + origin.y + y * edge,
    })),
  };
}

// Of every row, the first cell that shows something and the last; a few stray ones do not count.
function extentOf(cells: Uint8Array, columns: number, rows: number): [number, number][] {
  const extent: [number, number][] = [];
  for (let y = 0; y < rows; ++y) {
    let [first, last, count] = [columns, -1, 0];
    for (let x = 0; x < columns; ++x) {
      if (cells[y * columns + x] === cell.nothing) continue;
      if (x < first) first = x;
      last = x;
      count += 1;
    }
    if (count > 3) extent.push([first, y], [last + 1, y + 1]);
  }
  return extent;
}

// The peak of a histogram over 90 degrees, to a fraction of a degree by its neighbours.
function mainDirection(turns: Float64Array): number {
  let best = 0;
  for (let i = 1; i < 90; ++i) if (turns[i]! > turns[best]!) best = i;
  let [sum, weight] = [0, 0];
  for (let off = -3; off <= 3; ++off) {
    const w = turns[(best + off + 90) % 90]!;
    sum += w * off;
    weight += w;
  }
  const degrees = best + 0.5 + (weight > 0 ? sum / weight : 0);
  return (((degrees + 90) % 90) * Math.PI) / 180;
}

// Whether a wall stands between two places of the plan.
export function wallBetween(plan: FloorPlan, from: { x: number; y: number }, to: { x: number; y: number }): boolean {
  const length = Math.hypot(to.x - from.x, to.y - from.y);
  const steps = Math.ceil((2 * length) / plan.size);
  for (let i = 1; i < steps; ++i) {
    const x = Math.floor((from.x + ((to.x - from.x) * i) / steps - plan.x) / plan.size);
    const y = Math.floor((from.y + ((to.y - from.y) * i) / steps - plan.y) / plan.size);
    if (x < 0 || y < 0 || x >= plan.columns || y >= plan.rows) continue;
    if (plan.cells[y * plan.columns + x] === cell.wall) return true;
  }
  return false;
}

// Of a box around a place, the squares that one can stand in as well as there: on floor, and not beyond a wall.
// Their centres, world, m, `edge` apart.
export function squaresAround(
  plan: FloorPlan,
  place: { x: number; y: number },
  box: { min: { x: number; y: number }; max: { x: number; y: number } },
  edge: number,
): { x: number; y: number }[] {
  const squares: { x: number; y: number }[] = [];
  for (let y = box.min.y + edge / 2; y < box.max.y; y += edge) {
    for (let x = box.min.x + edge / 2; x < box.max.x; x += edge) {
      const at = Math.floor((y - plan.y) / plan.size) * plan.columns + Math.floor((x - plan.x) / plan.size);
      const what = plan.cells[at];
      if ((what === cell.floor || what === cell.thinFloor) && !wallBetween(plan, place, { x, y }))
        squares.push({ x, y });
    }
  }
  return squares;
}

// The way over known floor from one place to another, around what stands there by `clearance`, m: corners
// in world coordinates, both places included. A straight line where no way is known.
export function wayOver(
  plan: FloorPlan,
  from: { x: number; y: number },
  to: { x: number; y: number },
  clearance: number,
): { x: number; y: number }[] {
  // In cells of about a decimetre, which a person's way needs no finer.
  const step = Math.max(1, Math.round(0.1 / plan.size));
  const columns = Math.ceil(plan.columns / step);
  const rows = Math.ceil(plan.rows / step);
  const edge = step * plan.size;
  const blocked = new Uint8Array(columns * rows);
  const known = new Uint8Array(columns * rows);
  for (let y = 0; y < plan.rows; ++y) {
    for (let x = 0; x < plan.columns; ++x) {
      const what = plan.cells[y * plan.columns + x]!;
      const at = Math.floor(y / step) * columns + Math.floor(x / step);
      if (what >= cell.furniture) blocked[at] = 1;
      else if (what !== cell.nothing) known[at] = 1;
    }
  }
  // How dear a cell is: what is near an obstacle is avoided, floor that nobody saw costs more.
  const reach = Math.max(1, Math.round(clearance / edge));
  const cost = new Float32Array(columns * rows);
  for (let y = 0; y < rows; ++y) {
    for (let x = 0; x < columns; ++x) {
      const at = y * columns + x;
      let near = Infinity;
      for (let dy = -reach; dy <= reach && near > 0; ++dy) {
        for (let dx = -reach; dx <= reach; ++dx) {
          const [ox, oy] = [x + dx, y + dy];
          if (ox < 0 || oy < 0 || ox >= columns || oy >= rows || blocked[oy * columns + ox] === 0) continue;
          near = Math.min(near, Math.hypot(dx, dy));
        }
      }
      cost[at] =
        near === 0 ? Infinity : (known[at] === 1 ? 1 : 3) * (near <= reach ? 1 + (4 * (reach - near + 1)) / reach : 1);
    }
  }
  const cellOf = (p: { x: number; y: number }) => {
    const x = Math.floor((p.x - plan.x) / edge);
    const y = Math.floor((p.y - plan.y) / edge);
    return x < 0 || y < 0 || x >= columns || y >= rows ? -1 : y * columns + x;
  };
  const [start, goal] = [cellOf(from), cellOf(to)];
  if (start < 0 || goal < 0) return [from, to];
  // Where somebody stands is free, whatever the raster says.
  cost[start] = 1;
  cost[goal] = 1;
  const before = shortest(cost, columns, rows, start, goal);
  if (before === undefined) return [from, to];
  const cells: number[] = [];
  for (let at = goal; at !== start; at = before[at]!) cells.push(at);
  cells.push(start);
  cells.reverse();
  const centre = (at: number) => ({
    x: plan.x + ((at % columns) + 0.5) * edge,
    y: plan.y + (Math.floor(at / columns) + 0.5) * edge,
  });
  // Straightened: from each corner as far as the line costs no more than the way along the cells.
  const sums = [0];
  for (let i = 1; i < cells.length; ++i) {
    const a = centre(cells[i - 1]!);
    const b = centre(cells[i]!);
    sums.push(sums[i - 1]! + (Math.hypot(b.x - a.x, b.y - a.y) * (cost[cells[i]!]! + cost[cells[i - 1]!]!)) / 2);
  }
  const along = (a: { x: number; y: number }, b: { x: number; y: number }) => {
    const length = Math.hypot(b.x - a.x, b.y - a.y);
    const pieces = Math.max(1, Math.ceil((2 * length) / edge));
    let total = 0;
    for (let i = 0; i < pieces; ++i) {
      const s = (i + 0.5) / pieces;
      const at = cellOf({ x: a.x + s * (b.x - a.x), y: a.y + s * (b.y - a.y) });
      total += (at < 0 ? Infinity : cost[at]!) * (length / pieces);
    }
    return total;
  };
  const corners = [from];
  for (let i = 0; i < cells.length - 1; ) {
    let next = i + 1;
    for (let j = cells.length - 1; j > i + 1; --j) {
      if (along(centre(cells[i]!), centre(cells[j]!)) <= 1.02 * (sums[j]! - sums[i]!)) {
        next = j;
        break;
      }
    }
    i = next;
    if (i < cells.length - 1) corners.push(centre(cells[i]!));
  }
  corners.push(to);
  return corners;
}

// Dijkstra over eight neighbours; for each cell that was reached, the one before it.
function shortest(
  cost: Float32Array,
  columns: number,
  rows: number,
  start: number,
  goal: number,
): Int32Array | undefined {
  const far = new Float64Array(cost.length).fill(Infinity);
  const before = new Int32Array(cost.length).fill(-1);
  const heap: [number, number][] = [[0, start]];
  far[start] = 0;
  const swap = (a: number, b: number) => ([heap[a], heap[b]] = [heap[b]!, heap[a]!]);
  const push = (entry: [number, number]) => {
    heap.push(entry);
    for (let i = heap.length - 1; i > 0; ) {
      const parent = (i - 1) >> 1;
      if (heap[parent]![0] <= heap[i]![0]) break;
      swap(parent, i);
      i = parent;
    }
  };
  const pop = (): [number, number] => {
    const top = heap[0]!;
    const last = heap.pop()!;
    if (heap.length > 0) {
      heap[0] = last;
      for (let i = 0; ; ) {
        let least = i;
        for (const child of [2 * i + 1, 2 * i + 2]) {
          if (child < heap.length && heap[child]![0] < heap[least]![0]) least = child;
        }
        if (least === i) break;
        swap(i, least);
        i = least;
      }
    }
    return top;
  };
  while (heap.length > 0) {
    const [distance, at] = pop();
    if (at === goal) return before;
    if (distance > far[at]!) continue;
    const [x, y] = [at % columns, Math.floor(at / columns)];
    for (let dy = -1; dy <= 1; ++dy) {
      for (let dx = -1; dx <= 1; ++dx) {
        const [nx, ny] = [x + dx, y + dy];
        if ((dx === 0 && dy === 0) || nx < 0 || ny < 0 || nx >= columns || ny >= rows) continue;
        const next = ny * columns + nx;
        if (cost[next] === Infinity) continue;
        const total = distance + (Math.hypot(dx, dy) * (cost[at]! + cost[next]!)) / 2;
        if (total < far[next]!) {
          far[next] = total;
          before[next] = at;
          push([total, next]);
        }
      }
    }
  }
  return undefined;
}
