// Draws a panorama with the spot to go to and the way there.
import { project, type Panorama } from "../model/panorama";
import type { Colours } from "./colours";

export interface Spot {
  x: number;
  y: number;
  // Of the floor there, and of the scanner on its tripod, m, world.
  floor: number;
  z: number;
}

export interface PanoramaScene {
  panorama: Panorama;
  // Direction in the middle of the canvas, rad.
  ahead: number;
  spot: Spot | undefined;
  way: readonly { x: number; y: number }[];
  label: string;
  // Whether a wall hides a place on the floor from where the picture is seen, as the plan has it.
  behindWall: (place: { x: number; y: number }) => boolean;
}

// The heights that are shown over the horizon and below it, rad.
const [top, bottom] = [0.42, -0.74];

export function paintPanorama(panorama: Panorama): HTMLCanvasElement {
  const canvas = document.createElement("canvas");
  canvas.width = panorama.width;
  canvas.height = panorama.height;
  const context = canvas.getContext("2d");
  if (context === null) return canvas;
  const image = context.createImageData(panorama.width, panorama.height);
  panorama.light.forEach((light, at) => {
    if (panorama.range[at] === Infinity) {
      // Nothing is known there: glass, the sky, what is too near.
      image.data.set([52, 62, 70, 255], 4 * at);
      return;
    }
    // A little warm in the light and cool in the dark, as eyes expect it.
    image.data[4 * at] = Math.min(255, light * 1.02);
    image.data[4 * at + 1] = light;
    image.data[4 * at + 2] = Math.min(255, 8 + light * 0.94);
    image.data[4 * at + 3] = 255;
  });
  context.putImageData(image, 0, 0);
  return canvas;
}

// How far a screen pixel turns, rad.
export function pixelAngle(height: number): number {
  return (top - bottom) / height;
}

// Whether something stands before a point that is as far away as `range`: nearer by more than a
// scanner's spot and a person's care explain.
export function isHidden(panorama: Panorama, pixel: { x: number; y: number; range: number }): boolean {
  const [x, y] = [Math.floor(pixel.x), Math.floor(pixel.y)];
  if (y < 0 || y >= panorama.height) return false;
  const seen = panorama.range[y * panorama.width + (x % panorama.width)];
  return seen !== undefined && seen !== Infinity && seen < pixel.range - Math.max(0.25, 0.06 * pixel.range);
}

export function drawPanorama(
  context: CanvasRenderingContext2D,
  size: { width: number; height: number },
  pixelRatio: number,
  picture: HTMLCanvasElement,
  scene: PanoramaScene,
  colours: Colours,
): { spotHidden: boolean } {
  const { panorama } = scene;
  const angle = pixelAngle(size.height);
  const magnify = panorama.step / angle;
  const full = 2 * Math.PI;
  // Where a pixel of the panorama is on the canvas: the copy nearest to its middle.
  const onCanvas = (pixel: { x: number; y: number }) => {
    const direction = panorama.left - pixel.x * panorama.step;
    const off = ((((scene.ahead - direction + Math.PI) % full) + full) % full) - Math.PI;
    return { x: size.width / 2 + off / angle, y: (pixel.y - (panorama.top - top) / panorama.step) * magnify };
  };
  context.setTransform(pixelRatio, 0, 0, pixelRatio, 0, 0);
  context.fillStyle = "#10151a";
  context.fillRect(0, 0, size.width, size.height);
  context.imageSmoothingEnabled = true;
  context.imageSmoothingQuality = "high";
  const wide = panorama.width * magnify;
  const leftEdge = onCanvas({ x: 0, y: 0 });
  for (let x = leftEdge.x - Math.ceil((leftEdge.x + wide) / wide) * wide; x < size.width; x += wide) {
    // A pixel more than it is wide, so that no seam shows between two copies.
    context.drawImage(picture, x, leftEdge.y, wide + 1, panorama.height * magnify);
  }
  let spotHidden = false;
  if (scene.spot === undefined) return { spotHidden };
  const { spot } = scene;

  // The way: a dot for each 25 cm of floor, smaller where it is far; hollow where it is out of sight.
  const steps: { x: number; y: number }[] = [];
  scene.way.forEach((point, i) => {
    const before = scene.way[i - 1];
    if (before === undefined) return;
    const length = Math.hypot(point.x - before.x, point.y - before.y);
    const count = Math.max(1, Math.round(length / 0.25));
    for (let k = 1; k <= count; ++k) {
      steps.push({
        x: before.x + ((point.x - before.x) * k) / count,
        y: before.y + ((point.y - before.y) * k) / count,
      });
    }
  });
  for (const step of steps.slice(1, -1)) {
    const pixel = project(panorama, { ...step, z: spot.floor });
    const at = onCanvas(pixel);
    const radius = Math.max(2.5, Math.min(9, 9 / Math.max(0.8, pixel.range - 0.6)));
    context.beginPath();
    context.ellipse(at.x, at.y, radius * 1.5, radius * 0.8, 0, 0, full);
    if (isHidden(panorama, pixel) || scene.behindWall(step)) {
      context.lineWidth = 1.5;
      context.strokeStyle = "#ffffff";
      context.stroke();
    } else {
      context.fillStyle = colours.accent;
      context.fill();
      context.lineWidth = 1.5;
      context.strokeStyle = "#ffffff";
      context.stroke();
    }
  }

  const foot = project(panorama, { x: spot.x, y: spot.y, z: spot.floor });
  const head = project(panorama, spot);
  const [below, above] = [onCanvas(foot), onCanvas(head)];
  spotHidden = scene.behindWall(spot) || (isHidden(panorama, foot) && isHidden(panorama, head));
  context.setLineDash(spotHidden ? [7, 6] : []);
  context.lineCap = "round";
  for (const [width, style] of [
    [9, "#ffffff"],
    [5, colours.accent],
  ] as const) {
    context.lineWidth = width;
    context.strokeStyle = style;
    context.beginPath();
    context.moveTo(below.x, below.y);
    context.lineTo(above.x, above.y);
    context.stroke();
    context.beginPath();
    context.ellipse(below.x, below.y, 24, 10, 0, 0, full);
    context.stroke();
  }
  context.setLineDash([]);
  context.beginPath();
  context.arc(above.x, above.y, 15, 0, full);
  context.fillStyle = colours.accent;
  context.fill();
  context.lineWidth = 3.5;
  context.strokeStyle = "#ffffff";
  context.stroke();

  context.font = "700 17px system-ui, sans-serif";
  const width = context.measureText(scene.label).width + 24;
  const x = Math.max(8, Math.min(size.width - width - 8, above.x - width / 2));
  const y = above.y > 66 ? above.y - 58 : Math.min(size.height - 44, below.y + 18);
  context.fillStyle = "#10151a";
  context.beginPath();
  context.roundRect(x, y, width, 34, 10);
  context.fill();
  context.fillStyle = "#ffffff";
  context.textAlign = "left";
  context.textBaseline = "middle";
  context.fillText(scene.label, x + 12, y + 18);
  return { spotHidden };
}
