// Where a plan or a model of a building lies at the site: told by two places in it and at the site.
import { create } from "@bufbuild/protobuf";
import type { Point } from "../draw/projection";
import { SitePriorPointSchema, type SitePriorPoint } from "../gen/vantage/v1/site_prior_pb";
import { SitePriorFormat, type GetSitePriorResponse } from "../gen/vantage/v1/site_prior_pb";
import { extent, type Outline } from "./outlines";

// A place in the file's own coordinates seen from above (outlines.ts), and the same at the site, m, world.
export interface Pair {
  inPlan: Point;
  atSite: Point;
}

// How the file is meant.
export interface Reading {
  kind: "picture" | "dxf" | "obj" | "ply";
  // m for 1 of its coordinates; of a picture for a pixel.
  unit: number;
  yUp: boolean;
  // Of a mesh: its floor, in its own coordinates.
  floor: number;
}

// As the contract has it. `floor`: of the site, m, world.
export function pointOf(pair: Pair, reading: Reading, floor: number): SitePriorPoint {
  const { x, y } = pair.inPlan;
  const site = { ...pair.atSite, z: floor };
  const prior = (): { x: number; y: number; z: number } => {
    if (reading.kind === "picture") return { x, y: -y, z: 0 };
    if (reading.kind === "dxf") return { x, y, z: 0 };
    return reading.yUp ? { x, y: reading.floor, z: -y } : { x, y, z: reading.floor };
  };
  return create(SitePriorPointSchema, { prior: prior(), site });
}

const apart = (a: Point, b: Point) => Math.hypot(b.x - a.x, b.y - a.y);

// m for a pixel: by how long it is from one place to the other, m, as the plan says it; else by how far apart they
// are at the site, which taps tell roughly.
export function pixelSize(a: Pair, b: Pair, length: number | undefined): number {
  const pixels = apart(a.inPlan, b.inPlan);
  return pixels < 1 ? 0 : (length ?? apart(a.atSite, b.atSite)) / pixels;
}

// Two places tell a picture's scale by themselves where they are so far apart, at the site, m, and in pixels; else it has
// to be given how long it is from one to the other. As server/session/site_priors.cc judges it.
export const leastForScale = 5;
const leastOfPicture = 50;
export function tellScale(a: Pair, b: Pair): boolean {
  return apart(a.atSite, b.atSite) >= leastForScale && apart(a.inPlan, b.inPlan) >= leastOfPicture;
}

// What is wrong with two places, before anything is sent: they are too near each other, or their distance at the site,
// m, is not what the plan has, as far as such places are known. As core/site_prior/prior_pose.cc judges it.
const leastApart = 1;
const pointsOff = 1;
const scaleOff = 0.15;
export function misplaced(a: Pair, b: Pair, unit: number): "" | "near" | "scale" {
  const inPlan = unit * apart(a.inPlan, b.inPlan);
  const atSite = apart(a.atSite, b.atSite);
  if (atSite < leastApart) return "near";
  return Math.abs(inPlan - atSite) > pointsOff + scaleOff * Math.max(inPlan, atSite) ? "scale" : "";
}

// Which unit would make both distances agree, m; undefined: none of them.
export function unitThatFits(a: Pair, b: Pair): number | undefined {
  return [1, 0.001, 0.01, 0.3048, 0.0254].find((unit) => misplaced(a, b, unit) === "");
}

// Its walls as the server has them at the site, m, world, with the height of the floor that they stand on.
export interface PlacedWall {
  outline: Outline;
  floor: number;
}
export function atSite(answer: GetSitePriorResponse): PlacedWall[] {
  // What is smaller in a picture is a letter or a symbol, m; nobody expects it.
  const least = answer.sitePrior?.format === SitePriorFormat.PICTURE ? 0.6 : 0;
  return answer.walls
    .map(({ corners }) => ({ outline: corners.map(({ x, y }) => ({ x, y })), floor: corners[0]?.z ?? 0 }))
    .filter(({ outline }) => outline.length > 1 && (least === 0 || extent(outline) > least));
}
