// The model in 3D on a canvas: points, and over them stations, the next place with its lines of sight, and patches.
import { share, type Part, type Points } from "../model/points";
import {
  around,
  closer,
  moved,
  near,
  projectPoint,
  turned,
  viewOf,
  type Orbit,
  type Vector,
  type View,
} from "./camera";
import type { Colours } from "./colours";
import { hatched } from "./raster";
import { invisible, packed, Splatter } from "./splat";

export interface SolidOptions {
  by: "kind" | "density";
  missing: boolean;
  // What is higher than this is cut off, m, world.
  cut: number;
  // Of the walls, rad: the first look is along them, at a slant.
  direction: number;
  // Edge of a voxel, m.
  size: number;
}

export interface SolidMarks {
  stations: { place: Vector; label: string; last: boolean }[];
  // Of the scanner, and of the floor below it.
  target: { place: Vector; floor: number } | undefined;
  // Where the target's gain comes from.
  rays: Vector[];
  // Corners of rectangles that are missing most, and how much.
  patches: { corners: Vector[]; label: string }[];
}

// Points on the screen at most; and at least, however slow the tablet.
export const mostPoints = 500_000;
const fewestPoints = 20_000;
// While a thumb moves the model a picture is made in so long, ms: with what the browser then does to show it, 15 a
// second are left.
const inTime = 40;
// Pixels between points that are neighbours: closer they bring nothing, at rest and while it moves.
const [sharp, coarse] = [1, 1.4];
// Squares are a little larger than voxels, so that surfaces seen at a slant close, and where fewer are drawn each is
// larger, to this many times.
const [overlap, swell] = [1.3, 4];
// A picture has at most so many pixels for one of the page.
const [finest, plain] = [1.5, 1];
// More rectangles would hide what they are about.
const mostPatches = 4;
// How dark edges are.
const edges = 6;

export class Solid {
  readonly #canvas: HTMLCanvasElement;
  readonly #context: CanvasRenderingContext2D;
  readonly #splatter = new Splatter();
  readonly #sheet = document.createElement("canvas");
  #width = 1;
  #height = 1;
  #orbit: Orbit = { target: { x: 0, y: 0, z: 0 }, azimuth: -2.1, elevation: 0.75, distance: 10 };
  #points: Points | undefined;
  #colours: Uint32Array = new Uint32Array(0);
  #palette: Colours;
  #dark = false;
  #options: SolidOptions = { by: "kind", missing: true, cut: Infinity, direction: 0, size: 0.05 };
  #patches: SolidMarks["patches"] = [];
  #marks: SolidMarks = { stations: [], target: undefined, rays: [], patches: [] };
  #asked = 0;
  #moving = false;
  #settles: ReturnType<typeof setTimeout> | undefined;
  // How many points a picture has while it moves: as many as come in time.
  #budget = 150_000;
  #fingers = new Map<number, { x: number; y: number }>();
  #framed = false;

  // Throws where there is no canvas to draw on.
  constructor(canvas: HTMLCanvasElement, palette: Colours) {
    const context = canvas.getContext("2d", { alpha: false });
    if (context === null) throw new Error("no canvas");
    this.#canvas = canvas;
    this.#context = context;
    this.#palette = palette;
  }

  close(): void {
    cancelAnimationFrame(this.#asked);
    clearTimeout(this.#settles);
  }

  resize(width: number, height: number): void {
    [this.#width, this.#height] = [Math.max(1, width), Math.max(1, height)];
    if (!this.#framed) this.#lookAtAll();
    this.draw();
  }

  show(points: Points, options: SolidOptions, palette: Colours, dark: boolean): void {
    const same =
      this.#points === points &&
      options.by === this.#options.by &&
      options.missing === this.#options.missing &&
      dark === this.#dark;
    const before = this.#options.direction;
    [this.#points, this.#options, this.#palette, this.#dark] = [points, options, palette, dark];
    if (!same) {
      this.#colours = colourPoints(points, options, palette, dark);
      this.#choosePatches();
    }
    // Which way walls run is known a little later than the points.
    if (!this.#framed || before !== options.direction) this.#lookAtAll();
    this.draw();
  }

  mark(marks: SolidMarks): void {
    this.#marks = marks;
    this.#choosePatches();
    this.draw();
  }

  // Of the patches those that are seen where their rectangle is: it also stands for what is merely expected, in rooms
  // that nobody entered, and for surfaces that it fills badly.
  #choosePatches(): void {
    const points = this.#points;
    const { patches } = this.#marks;
    this.#patches =
      points === undefined
        ? []
        : patches.filter(({ corners }) => filledShare(points, corners, this.#options.size) > 0.5).slice(0, mostPatches);
  }

  // With the next picture, however often it is asked for before.
  draw(): void {
    cancelAnimationFrame(this.#asked);
    this.#asked = requestAnimationFrame(() => this.#drawNow());
  }

  // From above at a slant, as a doll's house.
  fromAbove(): void {
    this.#lookAtAll();
    this.draw();
  }

  // Fingers: one turns, two move and zoom.
  down(id: number, x: number, y: number): void {
    this.#fingers.set(id, { x, y });
  }

  drag(id: number, x: number, y: number, carry = false): void {
    const before = this.#fingers.get(id);
    if (before === undefined) return;
    const [dx, dy] = [x - before.x, y - before.y];
    this.#fingers.set(id, { x, y });
    if (this.#fingers.size === 1 && !carry) {
      this.#move(turned(this.#orbit, dx, dy, this.#height));
      return;
    }
    const view = this.#view(this.#width, this.#height);
    const other = [...this.#fingers].find(([own]) => own !== id)?.[1];
    if (other === undefined) {
      this.#move(moved(this.#orbit, dx, dy, view));
      return;
    }
    const apart = Math.hypot(x - other.x, y - other.y);
    const wasApart = Math.max(1, Math.hypot(before.x - other.x, before.y - other.y));
    this.#move(closer(moved(this.#orbit, dx / 2, dy / 2, view), apart / wasApart));
  }

  up(id: number): void {
    this.#fingers.delete(id);
    if (this.#fingers.size === 0) this.#settle(0);
  }

  // Steps by keys and the wheel, in pixels of a thumb.
  turn(dx: number, dy: number): void {
    this.#move(turned(this.#orbit, dx, dy, this.#height));
    this.#settle(250);
  }

  zoom(factor: number): void {
    this.#move(closer(this.#orbit, factor));
    this.#settle(250);
  }

  #move(orbit: Orbit): void {
    this.#orbit = orbit;
    this.#moving = true;
    clearTimeout(this.#settles);
    this.draw();
  }

  // At rest, all that may be shown.
  #settle(after: number): void {
    clearTimeout(this.#settles);
    this.#settles = setTimeout(() => {
      this.#moving = false;
      this.draw();
    }, after);
  }

  #view(width: number, height: number): View {
    return viewOf(this.#orbit, width, height);
  }

  #lookAtAll(): void {
    const points = this.#points;
    if (points === undefined || points.parts.length === 0 || this.#width < 2) return;
    const shown = outlineOf(points, this.#cutHere());
    this.#orbit = around(shown, this.#options.direction - 2.1, 0.8, this.#width, this.#height);
    this.#framed = true;
  }

  #cutHere(): number {
    const { cut } = this.#options;
    return Number.isFinite(cut) ? cut - (this.#points?.origin.z ?? 0) : Infinity;
  }

  #drawNow(): void {
    const began = performance.now();
    const dense = Math.min(finest, Math.max(1, window.devicePixelRatio || 1));
    const ratio = this.#moving ? plain : dense;
    const [w, h] = [Math.round(this.#width * ratio), Math.round(this.#height * ratio)];
    const view = this.#view(w, h);
    const splatter = this.#splatter;
    splatter.resize(w, h);
    splatter.clear(this.#packed(this.#palette.ground));
    const points = this.#points;
    let drawn = 0;
    if (points !== undefined) {
      const { size } = this.#options;
      const cut = this.#cutHere();
      const wanted = points.parts.map((part) => detail(part, view, size, cut, this.#moving ? coarse : sharp));
      const counts = share(points.parts, wanted, this.#moving ? this.#budget : mostPoints);
      // The nearest first: what they hide is not painted.
      const order = points.parts
        .map((part, i) => ({ i, depth: depthOf(part, view) }))
        .filter(({ i }) => counts[i]! > 0)
        .sort((a, b) => a.depth - b.depth);
      for (const { i } of order) {
        const part = points.parts[i]!;
        const larger = Math.min(swell, Math.sqrt(part.count / counts[i]!));
        splatter.draw(points, this.#colours, part, counts[i]!, size * overlap * larger, cut, view);
        drawn += counts[i]!;
      }
      splatter.shade(edges);
    }
    this.#put(w, h, dense);
    this.#drawMarks(view, ratio);
    const took = performance.now() - began;
    if (this.#moving) {
      // Fewer points when a picture was late, more when there was time.
      if (took > inTime)
        this.#budget = Math.max(fewestPoints, Math.min(this.#budget, drawn) * Math.max(0.4, inTime / took));
      else if (took < 0.7 * inTime && drawn > 0.8 * this.#budget)
        this.#budget = Math.min(mostPoints, this.#budget * 1.2);
    }
    // For tests and whoever measures: how many points a picture had, and how many pictures there were.
    const { dataset } = this.#canvas;
    dataset.points = String(drawn);
    dataset.pictures = String(Number(dataset.pictures ?? 0) + 1);
  }

  #put(w: number, h: number, dense: number): void {
    const { image } = this.#splatter;
    if (image === undefined) return;
    const canvas = this.#canvas;
    const [width, height] = [Math.round(this.#width * dense), Math.round(this.#height * dense)];
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    const context = this.#context;
    context.setTransform(1, 0, 0, 1, 0, 0);
    if (w === width && h === height) context.putImageData(image, 0, 0);
    else {
      [this.#sheet.width, this.#sheet.height] = [w, h];
      this.#sheet.getContext("2d")?.putImageData(image, 0, 0);
      context.drawImage(this.#sheet, 0, 0, width, height);
    }
    context.setTransform(dense, 0, 0, dense, 0, 0);
  }

  #packed(colour: string): number {
    const [r, g, b] = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16)) as [number, number, number];
    return packed(r, g, b);
  }

  // Over the points: solid where nothing is before it, pale where something is.
  #drawMarks(view: View, ratio: number): void {
    const origin = this.#points?.origin ?? { x: 0, y: 0, z: 0 };
    const here = (place: Vector) => ({ x: place.x - origin.x, y: place.y - origin.y, z: place.z - origin.z });
    const { stations, target, rays } = this.#marks;
    const palette = this.#palette;
    const context = this.#context;
    context.lineCap = "round";
    if (this.#options.missing) {
      for (const { corners, label } of this.#patches) {
        const at = corners.map(here);
        at.forEach((corner, i) =>
          this.#line(view, ratio, corner, at[(i + 1) % at.length]!, hexOf(palette.missing), 2.5),
        );
        const middle = at.reduce((sum, c) => ({ x: sum.x + c.x / 4, y: sum.y + c.y / 4, z: sum.z + c.z / 4 }), {
          x: 0,
          y: 0,
          z: 0,
        });
        const pixel = projectPoint(view, middle);
        if (pixel.depth > near) this.#words(label, pixel.x / ratio, pixel.y / ratio);
      }
    }
    for (const station of stations) {
      const pixel = projectPoint(view, here(station.place));
      if (pixel.depth < near) continue;
      const [x, y] = [pixel.x / ratio, pixel.y / ratio];
      context.globalAlpha = this.#isHidden(pixel) ? 0.55 : 1;
      // As a tripod is large, within what can be read and what hides nothing.
      const radius = Math.max(10, Math.min(15, (0.4 * view.focal) / ratio / pixel.depth));
      if (station.last) this.#ring(x, y, radius + 5, palette.ink, 3);
      this.#disc(x, y, radius, palette.ink, palette.paper);
      this.#label(station.label, x, y, palette.paper, Math.round(radius + 1));
      context.globalAlpha = 1;
    }
    if (target === undefined) return;
    const scanner = here(target.place);
    for (const ray of rays) {
      this.#line(view, ratio, scanner, here(ray), palette.accent, 2.5);
      const end = projectPoint(view, here(ray));
      if (end.depth > near) this.#disc(end.x / ratio, end.y / ratio, 4, palette.accent, palette.paper);
    }
    this.#line(view, ratio, { ...scanner, z: target.floor - origin.z }, scanner, palette.accent, 4);
    const pixel = projectPoint(view, scanner);
    if (pixel.depth < near) return;
    const [x, y] = [pixel.x / ratio, pixel.y / ratio];
    this.#disc(x, y, 15, palette.accent, palette.paper);
    this.#ring(x, y, 6, palette.onAccent, 3);
  }

  #isHidden(pixel: { x: number; y: number; depth: number }): boolean {
    const { width, height, nearness } = this.#splatter;
    const [x, y] = [Math.floor(pixel.x), Math.floor(pixel.y)];
    if (x < 0 || y < 0 || x >= width || y >= height) return false;
    // By more than a voxel and a twentieth of the way.
    return nearness[y * width + x]! > 1 / Math.max(near, 0.95 * pixel.depth - this.#options.size);
  }

  #line(view: View, ratio: number, from: Vector, to: Vector, colour: string, wide: number): void {
    const [a, b] = [projectPoint(view, from), projectPoint(view, to)];
    if (a.depth < near && b.depth < near) return;
    const long = a.depth > near && b.depth > near ? Math.hypot(a.x - b.x, a.y - b.y) : 1000;
    const pieces = Math.max(1, Math.min(160, Math.ceil(long / 8)));
    const [open, hidden] = [new Path2D(), new Path2D()];
    let before = a;
    for (let i = 1; i <= pieces; ++i) {
      const share = i / pieces;
      const at = projectPoint(view, {
        x: from.x + (to.x - from.x) * share,
        y: from.y + (to.y - from.y) * share,
        z: from.z + (to.z - from.z) * share,
      });
      if (at.depth > near && before.depth > near) {
        const path = this.#isHidden(at) ? hidden : open;
        path.moveTo(before.x / ratio, before.y / ratio);
        path.lineTo(at.x / ratio, at.y / ratio);
      }
      before = at;
    }
    const context = this.#context;
    context.strokeStyle = colour;
    context.lineWidth = wide;
    context.stroke(open);
    context.globalAlpha = 0.3;
    context.stroke(hidden);
    context.globalAlpha = 1;
  }

  #disc(x: number, y: number, radius: number, fill: string, rim: string): void {
    const context = this.#context;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fillStyle = fill;
    context.fill();
    context.lineWidth = 2;
    context.strokeStyle = rim;
    context.stroke();
  }

  #ring(x: number, y: number, radius: number, colour: string, wide: number): void {
    const context = this.#context;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.lineWidth = wide;
    context.strokeStyle = colour;
    context.stroke();
  }

  #label(text: string, x: number, y: number, colour: string, size: number): void {
    const context = this.#context;
    context.font = `700 ${size}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillStyle = colour;
    context.fillText(text, x, y + 1);
  }

  #words(text: string, x: number, y: number): void {
    const context = this.#context;
    context.font = "700 16px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.lineJoin = "round";
    context.lineWidth = 4;
    context.strokeStyle = this.#palette.paper;
    context.strokeText(text, x, y);
    context.fillStyle = this.#palette.ink;
    context.fillText(text, x, y);
  }
}

function hexOf([r, g, b]: [number, number, number]): string {
  return `rgb(${r} ${g} ${b})`;
}

// Points that are looked at for a rectangle, at most: of each part an even sample, as points are ordered.
const mostTested = 60_000;

// How much of a rectangle is covered by points of what is missing or too thin, [0, 1].
export function filledShare(points: Points, corners: readonly Vector[], size: number): number {
  const [a, b, , d] = corners;
  if (a === undefined || b === undefined || d === undefined) return 0;
  const { origin, xyz, kind, density } = points;
  const [ux, uy, uz] = [b.x - a.x, b.y - a.y, b.z - a.z];
  const [vx, vy, vz] = [d.x - a.x, d.y - a.y, d.z - a.z];
  const [u2, v2] = [ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz];
  const [ax, ay, az] = [a.x - origin.x, a.y - origin.y, a.z - origin.z];
  if (u2 === 0 || v2 === 0) return 0;
  const stride = Math.max(1, Math.ceil(kind.length / mostTested));
  let count = 0;
  for (let i = 0; i < kind.length; i += stride) {
    if (kind[i] === 1 && density[i]! >= 127) continue;
    const x = xyz[3 * i]! - ax;
    const y = xyz[3 * i + 1]! - ay;
    const z = xyz[3 * i + 2]! - az;
    const u = (x * ux + y * uy + z * uz) / u2;
    const v = (x * vx + y * vy + z * vz) / v2;
    if (u < 0 || u > 1 || v < 0 || v > 1) continue;
    // Off its plane, m: a patch is as flat as voxels can be.
    const off = Math.hypot(x - u * ux - v * vx, y - u * uy - v * vy, z - u * uz - v * vz);
    if (off < 2 * size) ++count;
  }
  return Math.min(1, (stride * count * size * size) / Math.sqrt(u2 * v2));
}

function depthOf(part: Part, view: View): number {
  const { eye, forward } = view;
  return (part.x - eye.x) * forward.x + (part.y - eye.y) * forward.y + (part.z - eye.z) * forward.z;
}

// How many points of a part are of use: none where it is out of sight, and no more than one for each `apart` pixels.
export function detail(part: Part, view: View, size: number, cut: number, apart: number): number {
  if (part.z - part.radius > cut) return 0;
  const { eye, right, up, focal, width, height } = view;
  const [x, y, z] = [part.x - eye.x, part.y - eye.y, part.z - eye.z];
  const depth = depthOf(part, view);
  if (depth < near - part.radius) return 0;
  // Beyond a side of the picture: the planes through the eye and its sides.
  const across = Math.abs(x * right.x + y * right.y);
  const upright = Math.abs(x * up.x + y * up.y + z * up.z);
  const beyond = (off: number, half: number) => (off * focal - depth * half) / Math.hypot(focal, half) > part.radius;
  if (beyond(across, width / 2) || beyond(upright, height / 2)) return 0;
  const distance = Math.max(near, Math.hypot(x, y, z) - part.radius);
  const spacing = (focal * size) / distance;
  return part.count * Math.min(1, (spacing / apart) ** 2);
}

// Of what is below the cut some points, without the few that went through a window: those in the box in which all but a
// hundredth lie.
function outlineOf(points: Points, cut: number): Vector[] {
  const stride = 3 * Math.max(1, Math.floor(points.kind.length / 20_000));
  const places: Vector[] = [];
  for (let i = 0; i < points.xyz.length; i += stride) {
    const z = points.xyz[i + 2]!;
    if (z <= cut) places.push({ x: points.xyz[i]!, y: points.xyz[i + 1]!, z });
  }
  const ends = (of: (place: Vector) => number): [number, number] => {
    const sorted = places.map(of).sort((a, b) => a - b);
    return [sorted[Math.floor(0.005 * sorted.length)] ?? 0, sorted[Math.floor(0.995 * (sorted.length - 1))] ?? 0];
  };
  const [[x0, x1], [y0, y1], [z0, z1]] = [ends((p) => p.x), ends((p) => p.y), ends((p) => p.z)];
  return places.filter(({ x, y, z }) => x >= x0 && x <= x1 && y >= y0 && y <= y1 && z >= z0 && z <= z1);
}

// A surface is lit from above and a little from one side, and what is missing is hatched by its kind, as on the plan:
// nothing is told by colour alone.
function colourPoints(points: Points, options: SolidOptions, palette: Colours, dark: boolean): Uint32Array {
  const { kind, normal, density, xyz } = points;
  const { size, missing, by } = options;
  const colours = new Uint32Array(kind.length);
  const [ambient, sun] = dark ? [0.42, 0.5] : [0.5, 0.46];
  const light = { x: 0.36, y: -0.22, z: 0.9 };
  const accent = [1, 3, 5].map((at) => parseInt(palette.accent.slice(at, at + 2), 16));
  const [mr, mg, mb] = palette.missing;
  const [gr, gg, gb] = dark ? [30, 42, 52] : [214, 222, 230];
  // Twice a voxel, so that the hatching is seen from where a whole room is, m.
  const cell = 2 * size;
  for (let i = 0; i < kind.length; ++i) {
    const what = kind[i]!;
    if (what !== 1) {
      if (!missing) {
        colours[i] = invisible;
        continue;
      }
      // Along the surface and up it, in voxels.
      const u = Math.floor((xyz[3 * i]! + xyz[3 * i + 1]!) / cell);
      const v = Math.floor(xyz[3 * i + 2]! / cell + (Math.abs(normal[3 * i + 2]!) > 90 ? xyz[3 * i + 1]! / cell : 0));
      const on = hatched(what, Math.abs(u), Math.abs(v));
      colours[i] = on ? packed(mr, mg, mb) : packed((mr + 2 * gr) / 3, (mg + 2 * gg) / 3, (mb + 2 * gb) / 3);
      continue;
    }
    const facing = (normal[3 * i]! * light.x + normal[3 * i + 1]! * light.y + normal[3 * i + 2]! * light.z) / 127;
    const bright = 255 * (ambient + sun * Math.abs(facing));
    if (by === "density" && density[i]! < 127) {
      // The thinner, the more of the accent, and in stripes where there is less than half.
      const lack = 1 - density[i]! / 127;
      const u = Math.floor((xyz[3 * i]! - xyz[3 * i + 1]! + xyz[3 * i + 2]!) / cell);
      const part = lack > 0.5 && Math.abs(u) % 4 < 1 ? 0.35 * lack : lack;
      const mix = (channel: number) => bright + (accent[channel]! - bright) * part;
      colours[i] = packed(mix(0), mix(1), mix(2));
    } else colours[i] = packed(bright, bright, bright);
  }
  return colours;
}
