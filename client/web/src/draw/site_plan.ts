// Draws the plan of a storey: the raster of walls and floor, and the marks on it.
import type { FloorPlan } from "../model/floor_plan";
import type { Area } from "./areas";
import type { Colours } from "./colours";
import { drawHeat, type Heat } from "./heat";
import type { Link } from "./links";
import type { Mark } from "./marks";
import type { SampleDots } from "./samples";
import { drawStop, drawTourLines, type TourLine } from "./tour_lines";
import { barLength, matrix, toScreen, type Point, type Projection } from "./projection";
import {
  disc,
  words,
  drawTarget,
  drawBadge,
  drawStation,
  drawPending,
  drawClaim,
  drawRejection,
  drawDoor,
  drawTrial,
  drawPose,
  drawTurn,
  drawSign,
  drawNarrow,
  drawOpenDoor,
  drawChangeLabel,
} from "./signs";

// Edge of the squares that a region is drawn in, m.
export const regionEdge = 0.1;

// A picture of a plan that lies beneath, by its upper left corner and a pixel's edge.
export interface Underlay {
  image: CanvasImageSource;
  x: number;
  y: number;
  width: number;
  height: number;
}

export interface Scene {
  plan: ImageBitmap | HTMLCanvasElement | undefined;
  raster: FloorPlan | undefined;
  underlay?: Underlay | undefined;
  // Walls that are expected and not measured yet, world.
  expected?: readonly (readonly Point[])[];
  tour?: readonly TourLine[];
  heat: Heat | undefined;
  marks: readonly Mark[];
  links: readonly Link[];
  areas: readonly Area[];
  // Corners of an area that is being drawn.
  outline: readonly Point[];
  // The way to the target, world.
  way: readonly Point[];
  // Squares of `regionEdge` where it is as good as at the target, world.
  region: readonly Point[];
  // From the target to walls, with what the tape reads, world.
  offsets: readonly { from: Point; to: Point; label: string }[];
  // Of a scan that is being placed.
  samples: SampleDots | undefined;
  selected: Mark | undefined;
  // Text of the scale bar for a length, m; none: there is no scale yet.
  barLabel: ((metres: number) => string) | undefined;
}

export function draw(
  context: CanvasRenderingContext2D,
  projection: Projection,
  scene: Scene,
  colours: Colours,
  pixelRatio: number,
): void {
  const font = (size: number, weight = 600) => `${weight} ${size}px system-ui, sans-serif`;
  context.setTransform(pixelRatio, 0, 0, pixelRatio, 0, 0);
  context.fillStyle = colours.ground;
  context.fillRect(0, 0, projection.width, projection.height);

  if (scene.plan !== undefined && scene.raster !== undefined) {
    const { raster } = scene;
    const [a, b, c, d, e, f] = matrix(projection);
    context.save();
    context.transform(a, b, c, d, e, f);
    context.imageSmoothingEnabled = projection.scale * raster.size < 6;
    context.drawImage(scene.plan, raster.x, raster.y, raster.columns * raster.size, raster.rows * raster.size);
    context.restore();
  }
  if (scene.underlay !== undefined) drawUnderlay(context, projection, scene.underlay);
  if (scene.heat !== undefined) drawHeat(context, projection, scene.heat, colours);
  drawExpected(context, projection, scene.expected ?? [], colours);

  for (const area of scene.areas) drawArea(context, projection, area, colours, font(15, 700));
  for (const link of scene.links) drawLink(context, projection, link, colours);
  if (scene.outline.length > 0) drawOutline(context, projection, scene.outline, colours);

  for (const mark of scene.marks) {
    if (mark.type === "door") drawDoor(context, projection, mark, colours, font(18, 800));
    if (mark.type === "rejection") drawRejection(context, projection, mark, colours);
    if (mark.type === "change") drawChange(context, projection, mark, colours);
  }
  drawRegion(context, projection, scene.region, regionEdge, colours);
  drawTourLines(context, projection, scene.tour ?? [], colours);
  drawWay(context, projection, scene.way, colours);
  if (scene.samples !== undefined) drawSamples(context, projection, scene.samples, colours);
  const others = scene.marks.map((mark) => toScreen(projection, mark));
  for (const offset of scene.offsets) drawOffset(context, projection, offset, others, colours, font(15));
  // The better a place, the later it is drawn, and over the others.
  const views = scene.marks.filter((mark) => mark.type === "view").reverse();
  for (const mark of [...views, ...scene.marks.filter((mark) => mark.type !== "view")]) {
    const at = toScreen(projection, mark);
    switch (mark.type) {
      case "view":
        if (!mark.target) {
          const sign = { text: String(mark.rank), radius: 14, rim: colours.accent, ink: colours.ink };
          drawBadge(context, at, sign, mark === scene.selected, colours, font(16, 700));
        }
        break;
      case "pending":
        drawPending(context, at, mark.label, colours, font(15));
        break;
      case "claim":
        drawClaim(context, at, mark.label, mark.own, colours, font(15));
        break;
      case "station":
        drawStation(context, at, mark, mark === scene.selected, colours, font(16, 700));
        break;
      case "turn":
        drawTurn(context, at, colours);
        break;
      case "sign":
        drawSign(context, at, mark.label, mark === scene.selected, colours, font(15, 700));
        break;
      case "refused":
        // From there a scan would not align.
        drawBadge(
          context,
          at,
          { text: "!", radius: 13, rim: colours.warn, ink: colours.warn, broken: true },
          mark === scene.selected,
          colours,
          font(17, 800),
        );
        break;
      case "openDoor":
        drawOpenDoor(context, at, mark === scene.selected, colours);
        break;
      case "change":
        drawChangeLabel(context, at, mark.label, mark === scene.selected, colours, font(16, 800));
        break;
      case "narrow":
        drawNarrow(context, at, mark === scene.selected, colours);
        break;
      default:
        break;
    }
  }
  // The sooner a stop, the later it is drawn.
  for (const mark of [...scene.marks].reverse()) {
    if (mark.type === "stop")
      drawStop(context, toScreen(projection, mark), mark, mark === scene.selected, colours, font(16, 800));
  }
  for (const mark of scene.marks) {
    if (mark.type === "view" && mark.target) drawTarget(context, toScreen(projection, mark), colours);
    if (mark.type === "pose") drawPose(context, toScreen(projection, mark), mark, projection, colours, font(18, 800));
    if (mark.type === "trial") drawTrial(context, toScreen(projection, mark), mark.label, colours, font(15, 700));
  }
  if (scene.barLabel !== undefined) drawBar(context, projection, scene.barLabel, colours, font(15));
}

function drawUnderlay(context: CanvasRenderingContext2D, projection: Projection, underlay: Underlay): void {
  context.save();
  context.transform(...matrix(projection));
  context.scale(1, -1);
  context.drawImage(underlay.image, underlay.x, -underlay.y, underlay.width, underlay.height);
  context.restore();
}

// Walls that a plan of the building has: dashed, since nobody has measured them.
function drawExpected(
  context: CanvasRenderingContext2D,
  projection: Projection,
  outlines: readonly (readonly Point[])[],
  colours: Colours,
): void {
  const path = new Path2D();
  for (const outline of outlines) {
    outline.forEach((point, i) => {
      const at = toScreen(projection, point);
      if (i === 0) path.moveTo(at.x, at.y);
      else path.lineTo(at.x, at.y);
    });
  }
  context.lineCap = "butt";
  context.lineJoin = "round";
  context.setLineDash([7, 5]);
  context.lineWidth = 2;
  context.strokeStyle = colours.ink;
  context.stroke(path);
  context.setLineDash([]);
}

// A scan's samples: dots where it fits, crosses where it contradicts, rings where nothing is known.
function drawSamples(
  context: CanvasRenderingContext2D,
  projection: Projection,
  samples: SampleDots,
  colours: Colours,
): void {
  const paths = { fits: new Path2D(), against: new Path2D(), unknown: new Path2D() };
  const arm = 3;
  samples.how.forEach((how, i) => {
    const { x, y } = toScreen(projection, { x: samples.x[i]!, y: samples.y[i]! });
    if (x < 0 || y < 0 || x > projection.width || y > projection.height) return;
    const path = paths[how];
    if (how === "fits") path.rect(x - 1.5, y - 1.5, 3, 3);
    else if (how === "against") {
      path.moveTo(x - arm, y - arm);
      path.lineTo(x + arm, y + arm);
      path.moveTo(x - arm, y + arm);
      path.lineTo(x + arm, y - arm);
    } else {
      path.moveTo(x + 2, y);
      path.arc(x, y, 2, 0, 2 * Math.PI);
    }
  });
  context.lineCap = "butt";
  context.lineWidth = 1;
  context.strokeStyle = colours.soft;
  context.stroke(paths.unknown);
  context.fillStyle = colours.good;
  context.fill(paths.fits);
  context.lineWidth = 1.8;
  context.strokeStyle = colours.warn;
  context.stroke(paths.against);
}

function drawWay(
  context: CanvasRenderingContext2D,
  projection: Projection,
  way: readonly Point[],
  colours: Colours,
): void {
  if (way.length < 2) return;
  const path = new Path2D();
  way.forEach((point, i) => {
    const at = toScreen(projection, point);
    if (i === 0) path.moveTo(at.x, at.y);
    else path.lineTo(at.x, at.y);
  });
  context.lineCap = "round";
  context.lineJoin = "round";
  context.setLineDash([]);
  context.lineWidth = 9;
  context.strokeStyle = colours.paper;
  context.stroke(path);
  context.lineWidth = 5;
  context.strokeStyle = colours.accent;
  context.setLineDash([2, 11]);
  context.stroke(path);
  context.setLineDash([]);
}

// Where on an offset's line its figure stands, as a share of it: the first of these that no mark covers.
const labelShares = [0.7, 0.5, 0.35, 0.85];
// From a mark's centre to a figure's, pixels, so that neither covers the other.
const labelClearance = 36;

function drawOffset(
  context: CanvasRenderingContext2D,
  projection: Projection,
  offset: { from: Point; to: Point; label: string },
  // Where marks are drawn, on the screen.
  others: readonly Point[],
  colours: Colours,
  font: string,
): void {
  const [a, b] = [toScreen(projection, offset.from), toScreen(projection, offset.to)];
  const length = Math.hypot(b.x - a.x, b.y - a.y);
  if (length < 30) return;
  const [ux, uy] = [(b.x - a.x) / length, (b.y - a.y) / length];
  const line = new Path2D();
  line.moveTo(a.x + 20 * ux, a.y + 20 * uy);
  line.lineTo(b.x, b.y);
  // The tick on the wall.
  line.moveTo(b.x - 8 * uy, b.y + 8 * ux);
  line.lineTo(b.x + 8 * uy, b.y - 8 * ux);
  context.lineWidth = 4;
  context.strokeStyle = colours.paper;
  context.stroke(line);
  context.lineWidth = 2;
  context.strokeStyle = colours.ink;
  context.stroke(line);
  if (length <= 60) return;
  const places = labelShares.map((share) => ({ x: a.x + share * (b.x - a.x), y: a.y + share * (b.y - a.y) }));
  const isClear = (at: Point) => others.every(({ x, y }) => Math.hypot(x - at.x, y - at.y) >= labelClearance);
  words(context, offset.label, places.find(isClear) ?? places[0]!, colours.ink, colours.paper, font);
}

// The more two scans share, the stronger; what little backs is broken.
function drawLink(context: CanvasRenderingContext2D, projection: Projection, link: Link, colours: Colours): void {
  const [a, b] = [toScreen(projection, link.from), toScreen(projection, link.to)];
  context.beginPath();
  context.moveTo(a.x, a.y);
  context.lineTo(b.x, b.y);
  context.lineWidth = 1.5 + 5 * link.share;
  context.setLineDash(link.weak ? [6, 7] : []);
  context.globalAlpha = 0.45;
  context.strokeStyle = colours.ink;
  context.stroke();
  context.globalAlpha = 1;
  context.setLineDash([]);
}

function trace(context: CanvasRenderingContext2D, projection: Projection, corners: readonly Point[]): void {
  context.beginPath();
  corners.forEach((corner, i) => {
    const at = toScreen(projection, corner);
    if (i === 0) context.moveTo(at.x, at.y);
    else context.lineTo(at.x, at.y);
  });
}

function drawArea(
  context: CanvasRenderingContext2D,
  projection: Projection,
  area: Area,
  colours: Colours,
  font: string,
): void {
  trace(context, projection, area.corners);
  context.closePath();
  context.lineWidth = 2.5;
  context.strokeStyle = colours.ink;
  context.setLineDash(area.out ? [2, 6] : [12, 6]);
  context.stroke();
  context.setLineDash([]);
  if (area.out) {
    // Crossed out, within its outline.
    context.save();
    context.clip();
    context.globalAlpha = 0.35;
    const xs = area.corners.map((corner) => toScreen(projection, corner).x);
    const [left, right] = [Math.min(...xs), Math.max(...xs)];
    context.beginPath();
    for (let x = left - projection.height; x < right + projection.height; x += 26) {
      context.moveTo(x, 0);
      context.lineTo(x + projection.height, projection.height);
    }
    context.stroke();
    context.restore();
  }
  const top = area.corners
    .map((corner) => toScreen(projection, corner))
    .reduce((best, at) => (at.y < best.y ? at : best));
  if (area.label !== "") words(context, area.label, { x: top.x, y: top.y - 12 }, colours.ink, colours.ground, font);
}

function drawOutline(
  context: CanvasRenderingContext2D,
  projection: Projection,
  corners: readonly Point[],
  colours: Colours,
): void {
  trace(context, projection, corners);
  if (corners.length > 2) context.closePath();
  context.lineWidth = 4;
  context.strokeStyle = colours.accent;
  context.stroke();
  for (const corner of corners) {
    disc(context, toScreen(projection, corner), 9);
    context.fillStyle = colours.paper;
    context.fill();
    context.stroke();
  }
}

// Where it is as good as at the target.
function drawRegion(
  context: CanvasRenderingContext2D,
  projection: Projection,
  squares: readonly Point[],
  edge: number,
  colours: Colours,
): void {
  const half = (edge / 2) * 1.02;
  context.beginPath();
  for (const { x, y } of squares) {
    [
      [-half, -half],
      [half, -half],
      [half, half],
      [-half, half],
    ].forEach(([dx = 0, dy = 0], i) => {
      const at = toScreen(projection, { x: x + dx, y: y + dy });
      if (i === 0) context.moveTo(at.x, at.y);
      else context.lineTo(at.x, at.y);
    });
    context.closePath();
  }
  context.globalAlpha = 0.25;
  context.fillStyle = colours.accent;
  context.fill();
  context.globalAlpha = 1;
}

// What came has a whole outline, what is gone a broken one.
function drawChange(
  context: CanvasRenderingContext2D,
  projection: Projection,
  mark: { came: boolean; outline: readonly Point[] },
  colours: Colours,
): void {
  if (mark.outline.length === 0) return;
  trace(context, projection, mark.outline);
  context.closePath();
  context.setLineDash(mark.came ? [] : [5, 5]);
  context.lineWidth = 5;
  context.strokeStyle = colours.paper;
  context.stroke();
  context.lineWidth = 2.5;
  context.strokeStyle = colours.ink;
  context.stroke();
  context.setLineDash([]);
}

function drawBar(
  context: CanvasRenderingContext2D,
  projection: Projection,
  label: (metres: number) => string,
  colours: Colours,
  font: string,
): void {
  const metres = barLength(projection.scale, 130);
  const length = metres * projection.scale;
  const [x, y] = [18, projection.height - 18];
  context.lineWidth = 3;
  context.strokeStyle = colours.ink;
  context.beginPath();
  context.moveTo(x, y - 7);
  context.lineTo(x, y);
  context.lineTo(x + length, y);
  context.lineTo(x + length, y - 7);
  context.stroke();
  words(context, label(metres), { x: x + length / 2, y: y - 13 }, colours.ink, colours.ground, font);
}
