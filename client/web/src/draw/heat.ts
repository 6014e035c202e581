// Draws where it pays to stand: a heat map of scores.
import type { Colours } from "./colours";
import { matrix, type Projection } from "./projection";

export interface Heat {
  // World, m, of viewcells' centres, and their scores over the largest, [0, 1].
  x: Float32Array;
  y: Float32Array;
  score: Float32Array;
  size: number;
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

export function drawHeat(
  context: CanvasRenderingContext2D,
  projection: Projection,
  heat: Heat,
  colours: Colours,
): void {
  const picture = heatPicture(heat, colours.accent);
  if (picture === undefined) return;
  const { canvas, x, y } = picture;
  context.save();
  context.transform(...matrix(projection));
  context.imageSmoothingEnabled = true;
  context.drawImage(canvas, x, y, canvas.width * heat.size, canvas.height * heat.size);
  context.restore();
}
