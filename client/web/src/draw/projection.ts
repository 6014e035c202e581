// Between the world's plan (x, y, m) and a canvas (pixels, y down), turned so that walls are upright.

export interface Point {
  x: number;
  y: number;
}

export interface Projection {
  // World point in the middle of the canvas, m.
  centre: Point;
  // Pixels a metre.
  scale: number;
  // By how much the world is turned counter-clockwise before it is drawn, rad.
  turn: number;
  // Of the canvas, pixels.
  width: number;
  height: number;
}

export function toScreen(p: Projection, at: Point): Point {
  const [dx, dy] = [at.x - p.centre.x, at.y - p.centre.y];
  const [c, s] = [Math.cos(p.turn), Math.sin(p.turn)];
  return { x: p.width / 2 + p.scale * (c * dx - s * dy), y: p.height / 2 - p.scale * (s * dx + c * dy) };
}

export function toWorld(p: Projection, at: Point): Point {
  const [u, v] = [(at.x - p.width / 2) / p.scale, -(at.y - p.height / 2) / p.scale];
  const [c, s] = [Math.cos(p.turn), Math.sin(p.turn)];
  return { x: p.centre.x + c * u + s * v, y: p.centre.y - s * u + c * v };
}

// The same as a canvas transform: a, b, c, d, e, f of setTransform.
export function matrix(p: Projection): [number, number, number, number, number, number] {
  const [c, s] = [p.scale * Math.cos(p.turn), p.scale * Math.sin(p.turn)];
  const origin = toScreen(p, { x: 0, y: 0 });
  return [c, -s, -s, -c, origin.x, origin.y];
}

// All points in sight, with a margin in pixels around them; at most `closest` pixels a metre, so that two
// points side by side are not blown up.
export function fit(
  points: readonly Point[],
  turn: number,
  size: { width: number; height: number },
  margin: { top: number; right: number; bottom: number; left: number },
  closest: number,
): Projection {
  const level: Projection = { centre: { x: 0, y: 0 }, scale: 1, turn, width: 0, height: 0 };
  const at = points.length === 0 ? [{ x: 0, y: 0 }] : points.map((point) => toScreen(level, point));
  const xs = at.map((point) => point.x);
  const ys = at.map((point) => point.y);
  const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  const free = {
    width: Math.max(40, size.width - margin.left - margin.right),
    height: Math.max(40, size.height - margin.top - margin.bottom),
  };
  const scale = Math.min(closest, free.width / Math.max(0.01, x1 - x0), free.height / Math.max(0.01, y1 - y0));
  const middle = {
    x: (x0 + x1) / 2 + (margin.right - margin.left) / 2 / scale,
    y: (y0 + y1) / 2 + (margin.bottom - margin.top) / 2 / scale,
  };
  return { centre: toWorld(level, middle), scale, turn, ...size };
}

// Zoomed by `factor` around a point of the canvas, which stays where it is.
export function zoom(p: Projection, factor: number, around: Point): Projection {
  const scale = Math.min(2000, Math.max(1, p.scale * factor));
  const fixed = toWorld(p, around);
  const moved = toWorld({ ...p, scale }, around);
  return { ...p, scale, centre: { x: p.centre.x + fixed.x - moved.x, y: p.centre.y + fixed.y - moved.y } };
}

export function pan(p: Projection, dx: number, dy: number): Projection {
  const from = toWorld(p, { x: 0, y: 0 });
  const to = toWorld(p, { x: dx, y: dy });
  return { ...p, centre: { x: p.centre.x + from.x - to.x, y: p.centre.y + from.y - to.y } };
}

// The turn that makes walls in direction `walls` (rad) upright or level, and of the four that do the one
// in which the way from `from` to `to` leads up most: as somebody holds a map who walks there.
export function turnFor(walls: number, from: Point | undefined, to: Point | undefined): number {
  const candidates = [0, 1, 2, 3].map((quarter) => -walls + (quarter * Math.PI) / 2);
  if (from === undefined || to === undefined) return candidates[0] ?? 0;
  const heading = Math.atan2(to.y - from.y, to.x - from.x);
  const up = (turn: number) => Math.sin(heading + turn);
  return candidates.reduce((best, turn) => (up(turn) > up(best) + 1e-9 ? turn : best));
}

// A length in metres for a scale bar: 1, 2 or 5 times a power of ten, the longest below `pixels`.
export function barLength(scale: number, pixels: number): number {
  const most = pixels / scale;
  const power = 10 ** Math.floor(Math.log10(most));
  return [5, 2, 1].map((n) => n * power).find((length) => length <= most) ?? power;
}
