// The walls of a plan or a model of a building as lines to draw, in its file's own coordinates seen from above: x to
// the right, y up (of a picture pixels, from its upper left corner).
import type { Point } from "../draw/projection";

// Open where it does not end where it begins.
export type Outline = Point[];

// What can be drawn while a thumb moves the plan, and kept in the tablet's storage.
export const mostPoints = 20_000;

// Those with the largest extent first, as many as there is room for.
export function largest(outlines: readonly Outline[], most = mostPoints): Outline[] {
  const kept: Outline[] = [];
  let points = 0;
  for (const outline of [...outlines].sort((a, b) => extent(b) - extent(a))) {
    if (points + outline.length > most) break;
    points += outline.length;
    kept.push(outline);
  }
  return kept;
}

// The longer side of what it spans.
export function extent(outline: Outline): number {
  const [min, max] = bounds(outline);
  return Math.max(max.x - min.x, max.y - min.y);
}

export function bounds(points: readonly Point[]): [Point, Point] {
  const min = { x: Infinity, y: Infinity };
  const max = { x: -Infinity, y: -Infinity };
  for (const { x, y } of points) {
    [min.x, min.y] = [Math.min(min.x, x), Math.min(min.y, y)];
    [max.x, max.y] = [Math.max(max.x, x), Math.max(max.y, y)];
  }
  return points.length === 0
    ? [
        { x: 0, y: 0 },
        { x: 0, y: 0 },
      ]
    : [min, max];
}

// Without the points that lie within `tolerance` of the line through those that stay (Douglas and Peucker).
export function simplified(outline: Outline, tolerance: number): Outline {
  if (outline.length < 3) return outline;
  const keep = new Uint8Array(outline.length);
  keep[0] = 1;
  keep[outline.length - 1] = 1;
  const open: [number, number][] = [[0, outline.length - 1]];
  while (open.length > 0) {
    const [from, to] = open.pop()!;
    let [worst, at] = [tolerance, -1];
    for (let i = from + 1; i < to; ++i) {
      const off = distanceToLine(outline[i]!, outline[from]!, outline[to]!);
      if (off > worst) [worst, at] = [off, i];
    }
    if (at < 0) continue;
    keep[at] = 1;
    open.push([from, at], [at, to]);
  }
  return outline.filter((_, i) => keep[i] === 1);
}

function distanceToLine(p: Point, a: Point, b: Point): number {
  const [dx, dy] = [b.x - a.x, b.y - a.y];
  const length = dx * dx + dy * dy;
  const s = length === 0 ? 0 : Math.min(1, Math.max(0, ((p.x - a.x) * dx + (p.y - a.y) * dy) / length));
  return Math.hypot(p.x - a.x - s * dx, p.y - a.y - s * dy);
}

// Pieces that meet end to end as long lines: a dashed line begins anew with each piece.
export function joined(pieces: readonly (readonly [Point, Point])[], tolerance: number): Outline[] {
  const key = ({ x, y }: Point) => `${Math.round(x / tolerance)} ${Math.round(y / tolerance)}`;
  const ends = new Map<string, number[]>();
  pieces.forEach((piece, i) => {
    for (const end of piece) {
      const at = ends.get(key(end));
      if (at === undefined) ends.set(key(end), [i]);
      else at.push(i);
    }
  });
  const taken = new Uint8Array(pieces.length);
  const next = (at: Point): Point | undefined => {
    for (const i of ends.get(key(at)) ?? []) {
      if (taken[i] === 1) continue;
      taken[i] = 1;
      const [a, b] = pieces[i]!;
      return key(a) === key(at) ? b : a;
    }
    return undefined;
  };
  const lines: Outline[] = [];
  pieces.forEach(([a, b], i) => {
    if (taken[i] === 1) return;
    taken[i] = 1;
    const line = [a, b];
    for (let on = next(b); on !== undefined; on = next(on)) line.push(on);
    for (let on = next(a); on !== undefined; on = next(on)) line.unshift(on);
    lines.push(line);
  });
  return lines;
}

// The direction of most walls, rad, [0, pi/2), in steps of a degree.
export function directionOf(outlines: readonly (readonly Point[])[]): number {
  const turns = new Float64Array(90);
  for (const outline of outlines) {
    for (let i = 1; i < outline.length; ++i) {
      const [a, b] = [outline[i - 1]!, outline[i]!];
      const degrees = (Math.atan2(b.y - a.y, b.x - a.x) * 180) / Math.PI;
      const at = ((Math.round(degrees) % 90) + 90) % 90;
      turns[at]! += Math.hypot(b.x - a.x, b.y - a.y);
    }
  }
  const best = turns.indexOf(Math.max(...turns));
  return (best * Math.PI) / 180;
}
