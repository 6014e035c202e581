// The model in 3D. Loaded only where it is shown: three.js is larger than the rest of the page.
import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  Color,
  Group,
  Line,
  LineBasicMaterial,
  LineLoop,
  Mesh,
  MeshBasicMaterial,
  PerspectiveCamera,
  Plane,
  Points as Cloud,
  PointsMaterial,
  Scene,
  SphereGeometry,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { share, type Points } from "../model/points";

export interface Place {
  x: number;
  y: number;
  z: number;
}

export interface SolidOptions {
  by: "kind" | "density";
  missing: boolean;
  // What is higher than this is cut off, m, world.
  cut: number;
  // Of the walls, rad: the first look is along them, at a slant.
  direction: number;
}

export interface SolidMarks {
  stations: { place: Place; last: boolean }[];
  target: Place | undefined;
  // Where the target's gain comes from.
  rays: Place[];
  // Corners of rectangles that are missing most.
  patches: Place[][];
}

// Of a point, m: a little more than a voxel of 5 cm, so that surfaces close.
const pointSize = 0.065;

// Points on the screen at most; and at least, however slow the tablet.
export const mostPoints = 500_000;
const fewestPoints = 15_000;
// While a thumb moves the model a picture may take so long, ms: 15 a second are enough for the eye to follow.
const slowest = 60;

export class Solid {
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(55, 1, 0.05, 2000);
  readonly #controls: OrbitControls;
  readonly #canvas: HTMLCanvasElement;
  readonly #cut = new Plane(new Vector3(0, 0, -1), 0);
  #clouds: Cloud[] = [];
  #marks = new Group();
  #points: Points | undefined;
  #options: SolidOptions = { by: "kind", missing: true, cut: Infinity, direction: 0 };
  #asked = 0;
  // How many points a picture has while a thumb moves the model: as many as come in time.
  #inTime = mostPoints;
  #moving = false;
  #drawnAt = 0;

  // Throws where the tablet has no WebGL.
  constructor(canvas: HTMLCanvasElement) {
    this.#canvas = canvas;
    this.#renderer = new WebGLRenderer({ canvas, antialias: false, powerPreference: "low-power" });
    this.#renderer.clippingPlanes = [this.#cut];
    this.#camera.up.set(0, 0, 1);
    this.#controls = new OrbitControls(this.#camera, canvas);
    this.#controls.addEventListener("change", () => this.draw());
    this.#controls.addEventListener("start", () => {
      this.#moving = true;
      this.#drawnAt = 0;
    });
    // At rest, all that may be shown.
    this.#controls.addEventListener("end", () => {
      this.#moving = false;
      this.draw();
    });
    this.#scene.add(this.#marks);
  }

  close(): void {
    cancelAnimationFrame(this.#asked);
    this.#controls.dispose();
    for (const cloud of this.#clouds) cloud.geometry.dispose();
    this.#renderer.dispose();
  }

  resize(width: number, height: number): void {
    this.#renderer.setPixelRatio(Math.min(1.5, window.devicePixelRatio || 1));
    this.#renderer.setSize(width, height, false);
    this.#camera.aspect = width / Math.max(1, height);
    this.#camera.updateProjectionMatrix();
    this.draw();
  }

  show(points: Points, options: SolidOptions): void {
    const first = this.#points === undefined;
    const same =
      this.#points === points && options.by === this.#options.by && options.missing === this.#options.missing;
    this.#points = points;
    this.#options = options;
    if (!same) this.#rebuild();
    this.#cut.constant = Number.isFinite(options.cut) ? options.cut - points.origin.z : 1e6;
    if (first) this.#lookAtAll();
    this.draw();
  }

  mark(marks: SolidMarks): void {
    const origin = this.#points?.origin ?? { x: 0, y: 0, z: 0 };
    const at = (place: Place) => new Vector3(place.x - origin.x, place.y - origin.y, place.z - origin.z);
    this.#marks.clear();
    const accent = this.#colour("accent");
    const ink = this.#colour("ink");
    const ball = (place: Place, radius: number, colour: Color) => {
      const mesh = new Mesh(new SphereGeometry(radius, 20, 14), new MeshBasicMaterial({ color: colour }));
      mesh.position.copy(at(place));
      this.#marks.add(mesh);
    };
    for (const station of marks.stations) ball(station.place, station.last ? 0.14 : 0.1, ink);
    if (marks.target !== undefined) {
      ball(marks.target, 0.18, accent);
      for (const ray of marks.rays) {
        const geometry = new BufferGeometry().setFromPoints([at(marks.target), at(ray)]);
        this.#marks.add(new Line(geometry, new LineBasicMaterial({ color: accent })));
      }
    }
    const missing = this.#colour("plan-missing");
    for (const corners of marks.patches) {
      const geometry = new BufferGeometry().setFromPoints(corners.map(at));
      this.#marks.add(new LineLoop(geometry, new LineBasicMaterial({ color: missing })));
    }
    this.draw();
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

  // How many points the last picture had.
  get drawn(): number {
    return this.#clouds.reduce((sum, cloud) => sum + cloud.geometry.drawRange.count, 0);
  }

  #colour(name: string): Color {
    return new Color(getComputedStyle(this.#canvas).getPropertyValue(`--${name}`).trim());
  }

  #rebuild(): void {
    const points = this.#points;
    if (points === undefined) return;
    for (const cloud of this.#clouds) {
      cloud.geometry.dispose();
      this.#scene.remove(cloud);
    }
    this.#scene.background = this.#colour("ground");
    const dark = document.documentElement.dataset.look === "dark";
    const missing = this.#colour("plan-missing");
    const accent = this.#colour("accent");
    const [low, high] = dark ? [0.28, 0.92] : [0.12, 0.74];
    let [minZ, maxZ] = [Infinity, -Infinity];
    for (const part of points.parts) {
      minZ = Math.min(minZ, part.z - part.radius);
      maxZ = Math.max(maxZ, part.z + part.radius);
    }
    const colours = new Uint8Array(3 * points.kind.length);
    const set = (i: number, r: number, g: number, b: number) => {
      colours[3 * i] = 255 * r;
      colours[3 * i + 1] = 255 * g;
      colours[3 * i + 2] = 255 * b;
    };
    const grey = { r: 0, g: 0, b: 0 };
    for (let i = 0; i < points.kind.length; ++i) {
      if (points.kind[i] !== 1) {
        // Three kinds of the same colour, lighter and darker.
        const weight = points.kind[i] === 2 ? 1 : points.kind[i] === 3 ? 0.7 : 0.45;
        const base = dark ? 0 : 1;
        set(
          i,
          base + (missing.r - base) * weight,
          base + (missing.g - base) * weight,
          base + (missing.b - base) * weight,
        );
        continue;
      }
      const height = (points.xyz[3 * i + 2]! - minZ) / Math.max(0.1, maxZ - minZ);
      // A little noise in the shade, by place, tells surfaces that lie behind one another apart.
      const shade = low + (high - low) * height;
      grey.r = grey.g = grey.b = shade;
      if (this.#options.by === "density" && points.density[i]! < 127) {
        // The thinner, the more of the accent.
        const lack = 1 - points.density[i]! / 127;
        set(
          i,
          grey.r + (accent.r - grey.r) * lack,
          grey.g + (accent.g - grey.g) * lack,
          grey.b + (accent.b - grey.b) * lack,
        );
      } else set(i, grey.r, grey.g, grey.b);
    }
    this.#clouds = points.parts.map((part) => {
      const geometry = new BufferGeometry();
      let xyz = points.xyz.subarray(3 * part.first, 3 * (part.first + part.count));
      let rgb = colours.subarray(3 * part.first, 3 * (part.first + part.count));
      if (!this.#options.missing) {
        const kept: number[] = [];
        for (let i = 0; i < part.count; ++i) if (points.kind[part.first + i] === 1) kept.push(i);
        const only = <T extends Float32Array | Uint8Array>(from: T, to: T): T => {
          kept.forEach((i, k) => to.set(from.subarray(3 * i, 3 * i + 3), 3 * k));
          return to;
        };
        xyz = only(xyz, new Float32Array(3 * kept.length));
        rgb = only(rgb, new Uint8Array(3 * kept.length));
      }
      geometry.setAttribute("position", new BufferAttribute(xyz, 3));
      geometry.setAttribute("color", new BufferAttribute(rgb, 3, true));
      const cloud = new Cloud(
        geometry,
        new PointsMaterial({ size: pointSize, sizeAttenuation: true, vertexColors: true }),
      );
      this.#scene.add(cloud);
      return cloud;
    });
  }

  #lookAtAll(): void {
    const parts = this.#points?.parts ?? [];
    if (parts.length === 0) return;
    const box = new Box3();
    for (const part of parts) {
      const half = 0.5 * part.radius;
      box.expandByPoint(new Vector3(part.x - half, part.y - half, part.z - half));
      box.expandByPoint(new Vector3(part.x + half, part.y + half, part.z + half));
    }
    const middle = box.getCenter(new Vector3());
    const reach = Math.max(2, box.getSize(new Vector3()).length() / 2);
    this.#controls.target.copy(middle);
    // So far that all of it is in sight, however narrow the screen.
    const narrow = Math.min(1, this.#camera.aspect);
    const distance = (0.7 * reach) / Math.tan((this.#camera.fov * Math.PI) / 360) / narrow;
    const walls = this.#options.direction;
    const direction = new Vector3(Math.cos(walls - 2.1), Math.sin(walls - 2.1), 1.5).normalize();
    this.#camera.position.copy(middle).addScaledVector(direction, distance);
    this.#camera.far = Math.max(200, 20 * reach);
    this.#camera.updateProjectionMatrix();
    this.#controls.update();
  }

  // Fewer points when the last picture was late, more when there was time.
  #keepTime(): void {
    const now = performance.now();
    const took = now - this.#drawnAt;
    if (this.#moving && this.#drawnAt > 0) {
      // A pause of the thumb is no slow picture.
      if (took > slowest && took < 2000)
        this.#inTime = Math.max(fewestPoints, Math.min(this.#inTime, this.drawn) * Math.max(0.3, slowest / took));
      else if (took < slowest / 2) this.#inTime = Math.min(mostPoints, this.#inTime * 1.15);
    }
    this.#drawnAt = now;
  }

  #drawNow(): void {
    const points = this.#points;
    if (points !== undefined) {
      const eye = this.#camera.position;
      this.#keepTime();
      const budget = this.#moving ? this.#inTime : mostPoints;
      const counts = share(points.parts, { x: eye.x, y: eye.y, z: eye.z }, budget);
      this.#clouds.forEach((cloud, i) => {
        const has = cloud.geometry.getAttribute("position").count;
        const count = Math.min(has, counts[i] ?? 0);
        cloud.geometry.setDrawRange(0, count);
        // Fewer points, each larger, cover the same surface.
        (cloud.material as PointsMaterial).size = pointSize * Math.min(4, Math.sqrt(has / Math.max(1, count)));
      });
    }
    this.#renderer.render(this.#scene, this.#camera);
  }
}
