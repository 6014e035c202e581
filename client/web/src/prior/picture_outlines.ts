// The walls of a floor plan that is a picture: what is dark, by its outlines.
import { largest, simplified, type Outline } from "./outlines";

export interface GreyPicture {
  width: number;
  height: number;
  // 0 black, 255 white, row by row from the top.
  grey: Uint8Array;
}

// Cells along the longer side: as fine as it is drawn on a tablet.
const mostCells = 800;
// What is smaller than this, as a share of the longer side, is a letter or a symbol; the server tells them by their
// size in metres, which a picture has only once it was placed.
const letter = 1 / 60;

// What is darker than `darkest`, 0 being black and 1 white, is wall.
export function pictureOutlines(picture: GreyPicture, darkest: number): Outline[] {
  const { width, height, grey } = picture;
  const cell = Math.max(1, Math.ceil(Math.max(width, height) / mostCells));
  const columns = Math.ceil(width / cell);
  const rows = Math.ceil(height / cell);
  const wall = new Uint8Array(columns * rows);
  const dark = darkest * 255;
  // Thin lines stay: a cell is wall as soon as one of its pixels is.
  for (let y = 0; y < height; ++y) {
    const row = Math.floor(y / cell) * columns;
    for (let x = 0; x < width; ++x) if (grey[y * width + x]! < dark) wall[row + Math.floor(x / cell)] = 1;
  }
  const least = Math.max(2, letter * Math.max(columns, rows));
  const outlines = rings(wall, columns, rows)
    .filter((ring) => spans(ring, columns) >= least)
    .map((ring) =>
      simplified(
        ring.map((corner) => ({
          x: (corner % (columns + 1)) * cell,
          y: -Math.floor(corner / (columns + 1)) * cell,
        })),
        0.8 * cell,
      ),
    );
  return largest(outlines);
}

function spans(ring: readonly number[], columns: number): number {
  let [x0, x1, y0, y1] = [Infinity, -Infinity, Infinity, -Infinity];
  for (const corner of ring) {
    const [x, y] = [corner % (columns + 1), Math.floor(corner / (columns + 1))];
    [x0, x1, y0, y1] = [Math.min(x0, x), Math.max(x1, x), Math.min(y0, y), Math.max(y1, y)];
  }
  return Math.max(x1 - x0, y1 - y0);
}

// Around what is wall, and around the holes in it: corners of cells, by row and column, the first one again at the end.
function rings(wall: Uint8Array, columns: number, rows: number): number[][] {
  const across = columns + 1;
  const on = new Map<number, number[]>();
  const edge = (from: number, to: number) => {
    const known = on.get(from);
    if (known === undefined) on.set(from, [to]);
    else known.push(to);
  };
  const is = (x: number, y: number) => x >= 0 && y >= 0 && x < columns && y < rows && wall[y * columns + x] === 1;
  for (let y = 0; y < rows; ++y) {
    for (let x = 0; x < columns; ++x) {
      if (wall[y * columns + x] === 0) continue;
      const corner = y * across + x;
      if (!is(x, y - 1)) edge(corner, corner + 1);
      if (!is(x + 1, y)) edge(corner + 1, corner + 1 + across);
      if (!is(x, y + 1)) edge(corner + 1 + across, corner + across);
      if (!is(x - 1, y)) edge(corner + across, corner);
    }
  }
  const found: number[][] = [];
  for (const [start, ways] of on) {
    while (ways.length > 0) {
      const ring = [start];
      let at = start;
      do {
        at = on.get(at)!.pop()!;
        ring.push(at);
      } while (at !== start);
      found.push(ring);
    }
  }
  return found;
}
