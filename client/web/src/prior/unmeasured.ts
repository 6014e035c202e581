// Of the walls that a plan or a model of the building has, those that nobody has measured yet: where the site is known,
// it is shown as it is.
import type { Point } from "../draw/projection";
import { cell, type FloorPlan } from "../model/floor_plan";
import type { Outline } from "./outlines";

// As far from it a measured wall is the same one, m.
const near = 0.25;
// A wall is looked at so often, m.
const step = 0.1;

// What is left of a wall between measured ones, shorter than this, tells nobody anything, m.
const shortest = 0.5;

// The pieces of the outlines, m, world, that lie where the plan of the storey shows nothing.
export function unmeasured(outlines: readonly Outline[], plan: FloorPlan | undefined): Outline[] {
  if (plan === undefined || outlines.length === 0) return [...outlines];
  const reach = Math.ceil(near / plan.size);
  const known = wallsAround(plan, reach);
  const isOpen = ({ x, y }: Point) => {
    const [column, row] = [Math.floor((x - plan.x) / plan.size), Math.floor((y - plan.y) / plan.size)];
    if (column < 0 || row < 0 || column >= plan.columns || row >= plan.rows) return true;
    const at = row * plan.columns + column;
    return known[at] === 0 && plan.cells[at] === cell.nothing;
  };
  const pieces: Outline[] = [];
  for (const outline of outlines) {
    let piece: Outline = [];
    const end = () => {
      const whole = piece.length === outline.length && piece[0] === outline[0];
      if (piece.length > 1 && (whole || lengthOf(piece) >= shortest)) pieces.push(piece);
      piece = [];
    };
    for (let i = 0; i + 1 < outline.length; ++i) {
      const [a, b] = [outline[i]!, outline[i + 1]!];
      const steps = Math.max(1, Math.ceil(Math.hypot(b.x - a.x, b.y - a.y) / step));
      for (let k = 0; k < steps; ++k) {
        const along = (s: number) => ({ x: a.x + (s / steps) * (b.x - a.x), y: a.y + (s / steps) * (b.y - a.y) });
        if (!isOpen(along(k + 0.5))) {
          end();
          continue;
        }
        if (piece.length === 0) piece.push(along(k));
        // A straight piece is one line.
        if (piece.length > 1 && k > 0) piece.pop();
        piece.push(along(k + 1));
      }
    }
    end();
  }
  return pieces;
}

function lengthOf(line: readonly Point[]): number {
  return line.slice(1).reduce((sum, b, i) => sum + Math.hypot(b.x - line[i]!.x, b.y - line[i]!.y), 0);
}

// Cells with a measured wall within so many cells.
function wallsAround(plan: FloorPlan, reach: number): Uint8Array {
  const { columns, rows, cells } = plan;
  const across = new Uint8Array(cells.length);
  const around = new Uint8Array(cells.length);
  const spread = (
    from: Uint8Array,
    is: number,
    to: Uint8Array,
    length: number,
    lines: number,
    by: number,
    on: number,
  ) => {
    for (let line = 0; line < lines; ++line) {
      let last = -Infinity;
      for (const back of [false, true]) {
        last = -Infinity;
        for (let i = 0; i < length; ++i) {
          const at = line * on + (back ? length - 1 - i : i) * by;
          if (from[at] === is) last = i;
          if (i - last <= reach) to[at] = 1;
        }
      }
    }
  };
  spread(cells, cell.wall, across, columns, rows, 1, columns);
  spread(across, 1, around, rows, columns, columns, 1);
  return around;
}
