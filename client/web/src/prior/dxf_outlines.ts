// The walls of a floor plan that is a DXF file in text: its lines and polylines, also those of inserted blocks, but
// for layers and blocks that are named for what is no wall. As core/site_prior/dxf.cc reads it.
import type { Point } from "../draw/projection";
import { joined, largest, type Outline } from "./outlines";

export interface Drawing {
  outlines: Outline[];
  // Metres for 1 of its coordinates, by what the file says; 0: it does not say it.
  unit: number;
}

// What plans have besides walls, in the languages of those who draw them here.
const noWalls = /door|tuer|tür|furn|moebel|möbel|möb|dim|bema|text|hatch|schraff|annot|axis|achs|sanit/i;
// $INSUNITS, m.
const units: Record<number, number> = { 1: 0.0254, 2: 0.3048, 4: 0.001, 5: 0.01, 6: 1 };
// An arc of a polyline becomes so many lines.
const bulgePieces = 8;
const mostLines = 200_000;

type Pair = [code: number, value: string];
type Line = [Point, Point];

interface Vertex extends Point {
  bulge: number;
}

interface Block {
  base: Point;
  lines: Line[];
}

function* pairs(text: string): Generator<Pair> {
  let at = 0;
  const line = () => {
    if (at >= text.length) return undefined;
    let end = text.indexOf("\n", at);
    if (end < 0) end = text.length;
    const found = text.slice(at, end).trim();
    at = end + 1;
    return found;
  };
  for (;;) {
    const [code, value] = [line(), line()];
    if (code === undefined || value === undefined) return;
    yield [Number(code), value];
  }
}

// What stands in the file between one 0 and the next: an entity, or the begin or end of something.
function* records(text: string): Generator<{ type: string; pairs: Pair[] }> {
  let record: { type: string; pairs: Pair[] } | undefined;
  for (const pair of pairs(text)) {
    if (pair[0] === 0) {
      if (record !== undefined) yield record;
      record = { type: pair[1], pairs: [] };
    } else record?.pairs.push(pair);
  }
  if (record !== undefined) yield record;
}

export function dxfOutlines(text: string): Drawing {
  const lines: Line[] = [];
  const blocks = new Map<string, Block>();
  const inserts: { block: string; at: Point; scale: Point; angle: number }[] = [];
  let unit = 0;
  let block: Block | undefined;
  // The old kind of polyline has a record for each corner.
  let polyline: { vertices: Vertex[]; closed: boolean; wanted: boolean } | undefined;
  const add = (a: Point, b: Point) => {
    const to = block?.lines ?? lines;
    if (to.length < mostLines && [a.x, a.y, b.x, b.y].every(Number.isFinite)) to.push([a, b]);
  };
  const addPolyline = (vertices: readonly Vertex[], closed: boolean) => {
    vertices.slice(1).forEach((vertex, i) => addArc(vertices[i]!, vertex, add));
    if (closed && vertices.length > 2) addArc(vertices.at(-1)!, vertices[0]!, add);
  };
  for (const { type, pairs } of records(text)) {
    const value = (code: number) => pairs.find(([other]) => other === code)?.[1];
    const number = (code: number, otherwise = 0) => Number(value(code) ?? otherwise);
    const wanted = !noWalls.test(value(8) ?? "");
    switch (type) {
      case "SECTION": {
        // Variables of the header stand in its section, each with its name before it.
        const named = pairs.findIndex(([code, name]) => code === 9 && name === "$INSUNITS");
        if (named >= 0) unit = units[Number(pairs[named + 1]?.[1])] ?? 0;
        break;
      }
      case "BLOCK":
        block = { base: { x: number(10), y: number(20) }, lines: [] };
        blocks.set(value(2) ?? "", block);
        break;
      case "ENDBLK":
        block = undefined;
        break;
      case "LINE":
        if (wanted) add({ x: number(10), y: number(20) }, { x: number(11), y: number(21) });
        break;
      case "LWPOLYLINE":
        if (wanted) addPolyline(corners(pairs), (number(70) & 1) !== 0);
        break;
      case "POLYLINE":
        polyline = { vertices: [], closed: (number(70) & 1) !== 0, wanted };
        break;
      case "VERTEX":
        polyline?.vertices.push({ x: number(10), y: number(20), bulge: number(42) });
        break;
      case "SEQEND":
        if (polyline?.wanted === true) addPolyline(polyline.vertices, polyline.closed);
        polyline = undefined;
        break;
      case "INSERT":
        // Blocks within blocks are left out.
        if (block === undefined && wanted && !noWalls.test(value(2) ?? "")) {
          inserts.push({
            block: value(2) ?? "",
            at: { x: number(10), y: number(20) },
            scale: { x: number(41, 1) || 1, y: number(42, 1) || 1 },
            angle: (number(50) * Math.PI) / 180,
          });
        }
        break;
      default:
        break;
    }
  }
  for (const insert of inserts) {
    const from = blocks.get(insert.block);
    if (from === undefined) continue;
    const [c, s] = [Math.cos(insert.angle), Math.sin(insert.angle)];
    const placed = ({ x, y }: Point) => {
      const [u, v] = [insert.scale.x * (x - from.base.x), insert.scale.y * (y - from.base.y)];
      return { x: insert.at.x + c * u - s * v, y: insert.at.y + s * u + c * v };
    };
    for (const [a, b] of from.lines) if (lines.length < mostLines) lines.push([placed(a), placed(b)]);
  }
  let size = 1e-9;
  for (const [a, b] of lines) size = Math.max(size, Math.abs(a.x), Math.abs(a.y), Math.abs(b.x), Math.abs(b.y));
  return { outlines: largest(joined(lines, 1e-6 * size)), unit };
}

function corners(pairs: readonly Pair[]): Vertex[] {
  const vertices: Vertex[] = [];
  for (const [code, value] of pairs) {
    if (code === 10) vertices.push({ x: Number(value), y: 0, bulge: 0 });
    const last = vertices.at(-1);
    if (last !== undefined && code === 20) last.y = Number(value);
    if (last !== undefined && code === 42) last.bulge = Number(value);
  }
  return vertices;
}

// `bulge`: the tangent of a quarter of the arc's angle.
function addArc(from: Vertex, to: Point, add: (a: Point, b: Point) => void): void {
  if (Math.abs(from.bulge) < 1e-6) return add(from, to);
  const angle = 4 * Math.atan(from.bulge);
  const half = 1 / Math.tan(angle / 2) / 2;
  const centre = {
    x: (from.x + to.x) / 2 - half * (to.y - from.y),
    y: (from.y + to.y) / 2 + half * (to.x - from.x),
  };
  let before: Point = from;
  for (let i = 1; i <= bulgePieces; ++i) {
    const turn = (angle * i) / bulgePieces;
    const [c, s] = [Math.cos(turn), Math.sin(turn)];
    const [dx, dy] = [from.x - centre.x, from.y - centre.y];
    const next = { x: centre.x + c * dx - s * dy, y: centre.y + s * dx + c * dy };
    add(before, next);
    before = next;
  }
}
