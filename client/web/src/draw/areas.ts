// Parts of the site with requirements of their own, as outlines on the plan.
import type { SiteRules } from "../gen/vantage/v1/planning_config_pb";
import type { RequiredRegion } from "../gen/vantage/v1/site_pb";
import type { Band } from "./marks";
import type { Point } from "./projection";

export interface Area {
  corners: Point[];
  label: string;
  // Nothing is required there, or nobody stands there: drawn crossed out.
  out: boolean;
}

function boxCorners(box: { min?: Point; max?: Point }): Point[] {
  const { min, max } = box;
  if (min === undefined || max === undefined) return [];
  return [min, { x: max.x, y: min.y }, max, { x: min.x, y: max.y }].map(({ x, y }) => ({ x, y }));
}

function outline(region: RequiredRegion): { corners: Point[]; low: number; high: number } {
  if (region.shape.case === "box") {
    const box = region.shape.value;
    return { corners: boxCorners(box), low: box.min?.z ?? -Infinity, high: box.max?.z ?? Infinity };
  }
  const corners = region.shape.case === "polygon" ? region.shape.value.corners.map(({ x, y }) => ({ x, y })) : [];
  return { corners, low: region.minZM ?? -Infinity, high: region.maxZM ?? Infinity };
}

export function areasOf(rules: SiteRules | undefined, band: Band, names: ReadonlyMap<string, number>): Area[] {
  const areas: Area[] = [];
  for (const region of rules?.regions ?? []) {
    const { corners, low, high } = outline(region);
    // By its heights, or by the storey that it names.
    const floor = names.get(region.storey);
    const here =
      region.storey === ""
        ? low < band.floor + 1.5 && high > band.floor
        : floor !== undefined && Math.abs(floor - band.floor) < 0.5;
    if (here && corners.length >= 3) areas.push({ corners, label: region.name, out: region.weight === 0 });
  }
  for (const box of rules?.keepOut ?? []) {
    if ((box.min?.z ?? 0) < band.floor + 2 && (box.max?.z ?? 0) > band.floor) {
      areas.push({ corners: boxCorners(box), label: "", out: true });
    }
  }
  return areas;
}

// Whether two sides of an outline cross: the server refuses it, and so does the eye.
export function crossesItself(corners: readonly Point[]): boolean {
  const n = corners.length;
  const side = (a: Point, b: Point, c: Point) => Math.sign((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x));
  for (let i = 0; i < n; ++i) {
    const [a, b] = [corners[i]!, corners[(i + 1) % n]!];
    for (let j = i + 2; j < n; ++j) {
      if (i === 0 && j === n - 1) continue;
      const [c, d] = [corners[j]!, corners[(j + 1) % n]!];
      if (side(a, b, c) !== side(a, b, d) && side(c, d, a) !== side(c, d, b)) return true;
    }
  }
  return false;
}
