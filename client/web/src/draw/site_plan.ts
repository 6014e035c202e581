// Draws the plan of a storey: the raster of walls and floor, and the marks on it.
import { cell, type FloorPlan } from "../model/floor_plan";
import type { Area } from "./areas";
import type { Colours } from "./colours";
import type { Link } from "./links";
import type { Mark } from "./marks";
import type { SampleDots } from "./samples";
import { barLength, matrix, toScreen, type Point, type Projection } from "./projection";

export interface Heat {
  // World, m, of viewcells' centres, and their scores over the largest, [0, 1].
  x: Float32Array;
  y: Float32Array;
  score: Float32Array;
  size: number;
}

// Edge of the squares that a region is drawn in, m.
export const regionEdge = 0.1;

export interface Scene {
  plan: ImageBitmap | HTMLCanvasElement | undefined;
  raster: FloorPlan | undefined;
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
  // Text of the scale bar for a length, m.
  barLabel: (metres: number) => string;
}

// The raster as a picture. Walls and furniture have smooth outlines, though cells have corners: a shape
// ends where half of what is around is of it. What is missing is hatched by its kind: nothing is told by
// colour alone.
export function paintRaster(plan: FloorPlan, colours: Colours, showMissing: boolean): HTMLCanvasElement {
  const canvas = document.createElement("canvas");
  const cells = plan.columns * plan.rows;
  // Pixels a cell.
  const fine = cells < 160_000 ? 4 : cells < 1_000_000 ? 2 : 1;
  canvas.width = plan.columns * fine;
  canvas.height = plan.rows * fine;
  const context = canvas.getContext("2d");
  if (context === null) return canvas;
  const image = context.createImageData(canvas.width, canvas.height);
  const wall = softened(plan, (what) => what === cell.wall);
  const furniture = softened(plan, (what) => what >= cell.furniture);
  const hatch = Math.max(1, fine / 2);
  for (let y = 0; y < canvas.height; ++y) {
    for (let x = 0; x < canvas.width; ++x) {
      const at = Math.floor(y / fine) * plan.columns + Math.floor(x / fine);
      const what = plan.cells[at]!;
      let [red, green, blue] = what === cell.thinFloor ? colours.thin : colours.floor;
      let alpha = what === cell.nothing ? 0 : 255;
      const missing = plan.missing[at]!;
      if (showMissing && missing !== 0 && hatched(missing, Math.floor(x / hatch), Math.floor(y / hatch))) {
        [red, green, blue] = colours.missing;
        alpha = 255;
      }
      for (const [mask, colour] of [
        [furniture, colours.furniture],
        [wall, colours.wall],
      ] as const) {
        const part =
          fine === 1 ? Number(mask[at]! > 0.5) : covered(mask, plan, (x + 0.5) / fine - 0.5, (y + 0.5) / fine - 0.5);
        if (part <= 0) continue;
        if (alpha === 0) [red, green, blue] = colour;
        red += (colour[0] - red) * part;
        green += (colour[1] - green) * part;
        blue += (colour[2] - blue) * part;
        alpha = Math.max(alpha, 255 * part);
      }
      const to = 4 * (y * canvas.width + x);
      image.data[to] = red;
      image.data[to + 1] = green;
      image.data[to + 2] = blue;
      image.data[to + 3] = alpha;
    }
  }
  context.putImageData(image, 0, 0);
  return canvas;
}

// Of each cell, how much of it and what is around it is of a kind, [0, 1].
function softened(plan: FloorPlan, accept: (what: number) => boolean): Float32Array {
  const { columns, rows, cells } = plan;
  const out = new Float32Array(cells.length);
  for (let y = 0; y < rows; ++y) {
    for (let x = 0; x < columns; ++x) {
      let [sum, of] = [0, 0];
      for (let dy = -1; dy <= 1; ++dy) {
        for (let dx = -1; dx <= 1; ++dx) {
          const [nx, ny] = [x + dx, y + dy];
          if (nx < 0 || ny < 0 || nx >= columns || ny >= rows) continue;
          const weight = dx === 0 && dy === 0 ? 4 : dx === 0 || dy === 0 ? 2 : 1;
          of += weight;
          if (accept(cells[ny * columns + nx]!)) sum += weight;
        }
      }
      out[y * columns + x] = sum / of;
    }
  }
  return out;
}

// How much of a pixel at (x, y), in cells, the shape covers: between cells' centres it is interpolated.
function covered(mask: Float32Array, plan: FloorPlan, x: number, y: number): number {
  const x0 = Math.max(0, Math.min(plan.columns - 2, Math.floor(x)));
  const y0 = Math.max(0, Math.min(plan.rows - 2, Math.floor(y)));
  const [u, v] = [Math.max(0, Math.min(1, x - x0)), Math.max(0, Math.min(1, y - y0))];
  const at = y0 * plan.columns + x0;
  const value =
    (mask[at]! * (1 - u) + mask[at + 1]! * u) * (1 - v) +
    (mask[at + plan.columns]! * (1 - u) + mask[at + plan.columns + 1]! * u) * v;
  return Math.max(0, Math.min(1, (value - 0.38) / 0.12));
}

// Kinds as SurfaceKind: too thin is dotted sparsely, hidden slants, no echo is dotted, outside the view
// lies level.
export function hatched(kind: number, x: number, y: number): boolean {
  switch (kind) {
    case 1:
      return x % 6 === 0 && y % 6 === 0;
    case 2:
      return (x + y) % 6 < 2;
    case 3:
      return x % 4 < 2 && y % 4 < 2;
    case 4:
      return y % 5 < 2;
    default:
      return false;
  }
}

export function isOccupied(raster: FloorPlan, at: Point): boolean {
  const x = Math.floor((at.x - raster.x) / raster.size);
  const y = Math.floor((at.y - raster.y) / raster.size);
  if (x < 0 || y < 0 || x >= raster.columns || y >= raster.rows) return false;
  return raster.cells[y * raster.columns + x]! >= cell.furniture;
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
  if (scene.heat !== undefined) drawHeat(context, projection, scene.heat, colours);

  for (const area of scene.areas) drawArea(context, projection, area, colours, font(15, 700));
  for (const link of scene.links) drawLink(context, projection, link, colours);
  if (scene.outline.length > 0) drawOutline(context, projection, scene.outline, colours);

  for (const mark of scene.marks) {
    if (mark.type === "door") drawDoor(context, projection, mark, colours, font(18, 800));
    if (mark.type === "rejection") drawRejection(context, projection, mark, colours);
    if (mark.type === "change") drawChange(context, projection, mark, colours);
  }
  drawRegion(context, projection, scene.region, regionEdge, colours);
  drawWay(context, projection, scene.way, colours);
  if (scene.samples !== undefined) drawSamples(context, projection, scene.samples, colours);
  for (const offset of scene.offsets) drawOffset(context, projection, offset, colours, font(15));
  // The better a place, the later it is drawn, and over the others.
  const views = scene.marks.filter((mark) => mark.type === "view").reverse();
  for (const mark of [...views, ...scene.marks.filter((mark) => mark.type !== "view")]) {
    const at = toScreen(projection, mark);
    switch (mark.type) {
      case "view":
        if (!mark.target) drawRank(context, at, mark.rank, mark === scene.selected, colours, font(16, 700));
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
      case "pose":
        drawPose(context, at, mark, projection, colours, font(18, 800));
        break;
      case "turn":
        drawTurn(context, at, colours);
        break;
      case "sign":
        drawSign(context, at, mark.label, mark === scene.selected, colours, font(15, 700));
        break;
      case "refused":
        drawRefused(context, at, mark === scene.selected, colours, font(17, 800));
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
  for (const mark of scene.marks) {
    if (mark.type === "view" && mark.target) drawTarget(context, toScreen(projection, mark), colours);
    if (mark.type === "trial") drawTrial(context, toScreen(projection, mark), mark.label, colours, font(15, 700));
  }
  drawBar(context, projection, scene.barLabel, colours, font(15));
}

function disc(context: CanvasRenderingContext2D, at: Point, radius: number): void {
  context.beginPath();
  context.arc(at.x, at.y, radius, 0, 2 * Math.PI);
}

function words(
  context: CanvasRenderingContext2D,
  text: string,
  at: Point,
  fill: string,
  halo: string,
  font: string,
): void {
  context.font = font;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.lineJoin = "round";
  context.lineWidth = 4;
  context.strokeStyle = halo;
  context.strokeText(text, at.x, at.y);
  context.fillStyle = fill;
  context.fillText(text, at.x, at.y);
}

// A pixel for each square, which is smoothed when it is drawn: a map has no seams.
const heatPictures = new WeakMap<Heat, { canvas: HTMLCanvasElement; x: number; y: number; colour: string }>();

function heatPicture(heat: Heat, colour: string): { canvas: HTMLCanvasElement; x: number; y: number } | undefined {
  const known = heatPictures.get(heat);
  if (known?.colour === colour) return known;
  if (heat.x.length === 0) return undefined;
  const column = (x: number) => Math.floor(x / heat.size);
  let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity];
  for (let i = 0; i < heat.x.length; ++i) {
    const [x, y] = [column(heat.x[i]!), column(heat.y[i]!)];
    [x0, x1, y0, y1] = [Math.min(x0, x), Math.max(x1, x), Math.min(y0, y), Math.max(y1, y)];
  }
  // With a rim, into which the outermost squares fade.
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [x1 - x0 + 3, y1 - y0 + 3];
  const context = canvas.getContext("2d");
  if (context === null) return undefined;
  context.fillStyle = colour;
  for (let i = 0; i < heat.x.length; ++i) {
    context.globalAlpha = 0.06 + 0.66 * heat.score[i]! ** 1.5;
    context.fillRect(column(heat.x[i]!) - x0 + 1, column(heat.y[i]!) - y0 + 1, 1, 1);
  }
  const made = { canvas, x: (x0 - 1) * heat.size, y: (y0 - 1) * heat.size, colour };
  heatPictures.set(heat, made);
  return made;
}

function drawHeat(context: CanvasRenderingContext2D, projection: Projection, heat: Heat, colours: Colours): void {
  const picture = heatPicture(heat, colours.accent);
  if (picture === undefined) return;
  const { canvas, x, y } = picture;
  context.save();
  context.transform(...matrix(projection));
  context.imageSmoothingEnabled = true;
  context.drawImage(canvas, x, y, canvas.width * heat.size, canvas.height * heat.size);
  context.restore();
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

function drawOffset(
  context: CanvasRenderingContext2D,
  projection: Projection,
  offset: { from: Point; to: Point; label: string },
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
  const s = Math.max(0.62, Math.min(0.8, 52 / length));
  if (length > 60)
    words(
      context,
      offset.label,
      { x: a.x + s * length * ux, y: a.y + s * length * uy },
      colours.ink,
      colours.paper,
      font,
    );
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

function drawTarget(context: CanvasRenderingContext2D, at: Point, colours: Colours): void {
  disc(context, at, 19);
  context.fillStyle = colours.paper;
  context.fill();
  disc(context, at, 16);
  context.fillStyle = colours.accent;
  context.fill();
  context.lineWidth = 3;
  context.strokeStyle = colours.onAccent;
  context.beginPath();
  for (const [dx, dy] of [
    [1, 0],
    [-1, 0],
    [0, 1],
    [0, -1],
  ] as const) {
    context.moveTo(at.x + 4 * dx, at.y + 4 * dy);
    context.lineTo(at.x + 11 * dx, at.y + 11 * dy);
  }
  context.stroke();
}

function drawRank(
  context: CanvasRenderingContext2D,
  at: Point,
  rank: number,
  selected: boolean,
  colours: Colours,
  font: string,
): void {
  disc(context, at, selected ? 17 : 14);
  context.fillStyle = colours.paper;
  context.fill();
  context.lineWidth = selected ? 4 : 2.5;
  context.strokeStyle = colours.accent;
  context.stroke();
  context.font = font;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = colours.ink;
  context.fillText(String(rank), at.x, at.y + 1);
}

function drawStation(
  context: CanvasRenderingContext2D,
  at: Point,
  mark: { label: string; here: boolean; weak: boolean; who: string },
  selected: boolean,
  colours: Colours,
  font: string,
): void {
  if (mark.here) {
    disc(context, at, 21);
    context.lineWidth = 3;
    context.strokeStyle = colours.ink;
    context.stroke();
  }
  disc(context, at, 15);
  context.fillStyle = colours.ink;
  context.fill();
  context.lineWidth = selected ? 4 : 2;
  context.strokeStyle = selected ? colours.accent : colours.paper;
  // Weakly held scans have a broken rim.
  context.setLineDash(mark.weak ? [5, 5] : []);
  context.stroke();
  context.setLineDash([]);
  context.font = font;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = colours.paper;
  context.fillText(mark.label, at.x, at.y + 1);
  if (mark.who !== "") words(context, mark.who, { x: at.x, y: at.y + 32 }, colours.ink, colours.paper, font);
}

function drawPending(
  context: CanvasRenderingContext2D,
  at: Point,
  label: string,
  colours: Colours,
  font: string,
): void {
  context.beginPath();
  context.moveTo(at.x, at.y - 15);
  context.lineTo(at.x + 14, at.y + 11);
  context.lineTo(at.x - 14, at.y + 11);
  context.closePath();
  context.fillStyle = colours.paper;
  context.fill();
  context.lineWidth = 3;
  context.strokeStyle = colours.ink;
  context.stroke();
  if (label !== "") words(context, label, { x: at.x, y: at.y + 25 }, colours.ink, colours.paper, font);
}

function drawClaim(
  context: CanvasRenderingContext2D,
  at: Point,
  label: string,
  own: boolean,
  colours: Colours,
  font: string,
): void {
  disc(context, at, 24);
  context.lineWidth = 3;
  context.strokeStyle = own ? colours.accent : colours.ink;
  context.setLineDash([7, 5]);
  context.stroke();
  context.setLineDash([]);
  words(context, label, { x: at.x, y: at.y + 36 }, colours.ink, colours.paper, font);
}

function drawRejection(
  context: CanvasRenderingContext2D,
  projection: Projection,
  mark: Point & { radius: number },
  colours: Colours,
): void {
  const at = toScreen(projection, mark);
  const radius = Math.max(10, mark.radius * projection.scale);
  disc(context, at, radius);
  context.lineWidth = 2.5;
  context.strokeStyle = colours.soft;
  context.stroke();
  context.beginPath();
  context.moveTo(at.x - 0.7 * radius, at.y - 0.7 * radius);
  context.lineTo(at.x + 0.7 * radius, at.y + 0.7 * radius);
  context.stroke();
}

function drawDoor(
  context: CanvasRenderingContext2D,
  projection: Projection,
  mark: Point & { width: number; direction: number },
  colours: Colours,
  font: string,
): void {
  const half = mark.width / 2;
  const across = mark.direction + Math.PI / 2;
  const a = toScreen(projection, { x: mark.x + half * Math.cos(across), y: mark.y + half * Math.sin(across) });
  const b = toScreen(projection, { x: mark.x - half * Math.cos(across), y: mark.y - half * Math.sin(across) });
  context.beginPath();
  context.moveTo(a.x, a.y);
  context.lineTo(b.x, b.y);
  context.lineWidth = 5;
  context.strokeStyle = colours.ink;
  context.setLineDash([3, 5]);
  context.stroke();
  context.setLineDash([]);
  const beyond = toScreen(projection, {
    x: mark.x + 0.45 * Math.cos(mark.direction),
    y: mark.y + 0.45 * Math.sin(mark.direction),
  });
  words(context, "?", beyond, colours.ink, colours.paper, font);
}

function drawTrial(context: CanvasRenderingContext2D, at: Point, label: string, colours: Colours, font: string): void {
  disc(context, at, 18);
  context.fillStyle = colours.paper;
  context.fill();
  context.lineWidth = 5;
  context.strokeStyle = colours.accent;
  context.stroke();
  disc(context, at, 5);
  context.fillStyle = colours.accent;
  context.fill();
  if (label !== "") words(context, label, { x: at.x, y: at.y - 32 }, colours.ink, colours.paper, font);
}

function drawPose(
  context: CanvasRenderingContext2D,
  at: Point,
  mark: { label: string; heading: number; chosen: boolean },
  projection: Projection,
  colours: Colours,
  font: string,
): void {
  const heading = mark.heading + projection.turn;
  const tip = { x: at.x + 46 * Math.cos(heading), y: at.y - 46 * Math.sin(heading) };
  context.beginPath();
  context.moveTo(at.x, at.y);
  context.lineTo(tip.x, tip.y);
  context.lineWidth = 6;
  context.lineCap = "round";
  context.strokeStyle = mark.chosen ? colours.accent : colours.ink;
  context.stroke();
  disc(context, at, 20);
  context.fillStyle = mark.chosen ? colours.accent : colours.paper;
  context.fill();
  context.lineWidth = 3;
  context.strokeStyle = mark.chosen ? colours.paper : colours.ink;
  context.stroke();
  context.font = font;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = mark.chosen ? colours.onAccent : colours.ink;
  context.fillText(mark.label, at.x, at.y + 1);
}

// The grip by which a scan that is placed by hand is turned.
function drawTurn(context: CanvasRenderingContext2D, at: Point, colours: Colours): void {
  disc(context, at, 16);
  context.fillStyle = colours.paper;
  context.fill();
  context.lineWidth = 4;
  context.strokeStyle = colours.accent;
  context.stroke();
  context.beginPath();
  context.arc(at.x, at.y, 7, -0.4, 1.4 * Math.PI);
  context.lineWidth = 3;
  context.stroke();
}

// A target that is to be put up, as the boards look.
function drawSign(
  context: CanvasRenderingContext2D,
  at: Point,
  label: string,
  selected: boolean,
  colours: Colours,
  font: string,
): void {
  const half = 11;
  context.fillStyle = colours.paper;
  context.fillRect(at.x - half, at.y - half, 2 * half, 2 * half);
  context.fillStyle = colours.ink;
  context.fillRect(at.x - half, at.y - half, half, half);
  context.fillRect(at.x, at.y, half, half);
  context.lineWidth = selected ? 4 : 2.5;
  context.strokeStyle = selected ? colours.accent : colours.ink;
  context.strokeRect(at.x - half, at.y - half, 2 * half, 2 * half);
  words(context, label, { x: at.x, y: at.y + 24 }, colours.ink, colours.paper, font);
}

// A place from which a scan would not align.
function drawRefused(
  context: CanvasRenderingContext2D,
  at: Point,
  selected: boolean,
  colours: Colours,
  font: string,
): void {
  disc(context, at, selected ? 17 : 13);
  context.fillStyle = colours.paper;
  context.fill();
  context.lineWidth = selected ? 4 : 2.5;
  context.strokeStyle = colours.warn;
  context.setLineDash([4, 4]);
  context.stroke();
  context.setLineDash([]);
  context.font = font;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = colours.warn;
  context.fillText("!", at.x, at.y + 1);
}

// Where it is too narrow: two jambs, and what would pass between them.
function drawNarrow(context: CanvasRenderingContext2D, at: Point, selected: boolean, colours: Colours): void {
  disc(context, at, 15);
  context.fillStyle = colours.paper;
  context.fill();
  context.lineWidth = selected ? 4 : 2;
  context.strokeStyle = selected ? colours.accent : colours.ink;
  context.stroke();
  context.beginPath();
  for (const side of [-1, 1]) {
    context.moveTo(at.x + 9 * side, at.y);
    context.lineTo(at.x + 3 * side, at.y);
    context.moveTo(at.x + 6 * side, at.y - 4);
    context.lineTo(at.x + 2 * side, at.y);
    context.lineTo(at.x + 6 * side, at.y + 4);
  }
  context.lineWidth = 2.5;
  context.strokeStyle = colours.ink;
  context.stroke();
}

// Where a door has to stay open: a frame, and its leaf ajar.
function drawOpenDoor(context: CanvasRenderingContext2D, at: Point, selected: boolean, colours: Colours): void {
  disc(context, at, 16);
  context.fillStyle = colours.paper;
  context.fill();
  context.lineWidth = selected ? 4 : 2.5;
  context.strokeStyle = colours.warn;
  context.stroke();
  context.beginPath();
  // The wall on both sides of it, from above.
  context.moveTo(at.x - 11, at.y + 6);
  context.lineTo(at.x - 6, at.y + 6);
  context.moveTo(at.x + 11, at.y + 6);
  context.lineTo(at.x + 6, at.y + 6);
  // The leaf, and the arc that it went.
  context.moveTo(at.x - 6, at.y + 6);
  context.lineTo(at.x - 6, at.y - 7);
  context.lineWidth = 3;
  context.stroke();
  context.beginPath();
  context.arc(at.x - 6, at.y + 6, 12, -Math.PI / 2, 0);
  context.lineWidth = 1.5;
  context.stroke();
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

function drawChangeLabel(
  context: CanvasRenderingContext2D,
  at: Point,
  label: string,
  selected: boolean,
  colours: Colours,
  font: string,
): void {
  context.font = font;
  const half = { x: Math.max(15, context.measureText(label).width / 2 + 6), y: 13 };
  context.fillStyle = colours.paper;
  context.fillRect(at.x - half.x, at.y - half.y, 2 * half.x, 2 * half.y);
  context.lineWidth = selected ? 4 : 2;
  context.strokeStyle = selected ? colours.accent : colours.ink;
  context.strokeRect(at.x - half.x, at.y - half.y, 2 * half.x, 2 * half.y);
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = colours.ink;
  context.fillText(label, at.x, at.y + 1);
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
