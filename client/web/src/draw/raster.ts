// The raster of a storey's walls, floor and furniture as a picture.
import { cell, type FloorPlan } from "../model/floor_plan";
import type { Colours } from "./colours";
import type { Point } from "./projection";

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
