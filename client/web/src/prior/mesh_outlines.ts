// The walls of a model of a building (OBJ, PLY): where a level plane over most furniture cuts its triangles.
import type { Point } from "../draw/projection";
import { bytesOf, readScalar } from "../model/ply_scalars";
import { joined, largest, simplified, type Outline } from "./outlines";

export interface Mesh {
  // Three for each vertex, as the file has them.
  vertices: Float64Array;
  // Three for each triangle.
  triangles: Uint32Array;
}

// Over the floor, m: over tables and under lintels.
const cutHeight = 1.3;
// So many of the vertices lie below the floor: a few stray ones.
const belowFloor = 0.02;

export function readObj(text: string): Mesh {
  const vertices: number[] = [];
  const triangles: number[] = [];
  for (const line of text.split("\n")) {
    if (line.startsWith("v ")) {
      const [x = 0, y = 0, z = 0] = line.slice(2).trim().split(/\s+/).map(Number);
      vertices.push(x, y, z);
    } else if (line.startsWith("f ")) {
      const count = vertices.length / 3;
      const corners = line
        .slice(2)
        .trim()
        .split(/\s+/)
        .map((corner) => parseInt(corner, 10))
        // Counted from 1, or from the last one back.
        .map((index) => (index < 0 ? count + index : index - 1));
      addFan(triangles, corners, count);
    }
  }
  return { vertices: Float64Array.from(vertices), triangles: Uint32Array.from(triangles) };
}

function addFan(triangles: number[], corners: readonly number[], count: number): void {
  if (corners.some((corner) => !(corner >= 0 && corner < count))) return;
  for (let i = 2; i < corners.length; ++i) triangles.push(corners[0]!, corners[i - 1]!, corners[i]!);
}

interface Element {
  name: string;
  count: number;
  // `list`: of the count before the entries.
  properties: { name: string; type: string; list: string | undefined }[];
}

// Text or binary. An error where it is none, or not whole.
export function readPlyMesh(bytes: Uint8Array): Mesh {
  const head = new TextDecoder("latin1").decode(bytes.subarray(0, 65_536));
  const end = /end_header\r?\n/.exec(head);
  if (!head.startsWith("ply") || end === null) throw new Error("not a PLY file");
  const elements: Element[] = [];
  let format = "";
  for (const line of head.slice(0, end.index).split(/\r?\n/)) {
    const words = line.trim().split(/\s+/);
    if (words[0] === "format") format = words[1] ?? "";
    if (words[0] === "element") elements.push({ name: words[1] ?? "", count: Number(words[2]), properties: [] });
    if (words[0] === "property") {
      const list = words[1] === "list";
      const [name = "", type = ""] = list ? [words[4], words[3]] : [words[2], words[1]];
      elements.at(-1)?.properties.push({ name, type, list: list ? words[2] : undefined });
    }
  }
  const read = format === "ascii" ? textReader(bytes, end.index + end[0].length) : undefined;
  const next = read ?? binaryReader(bytes, end.index + end[0].length, format === "binary_little_endian");
  const vertices: number[] = [];
  const triangles: number[] = [];
  for (const element of elements) {
    for (let i = 0; i < element.count; ++i) {
      const at = [0, 0, 0];
      for (const property of element.properties) {
        if (property.list === undefined) {
          const value = next(property.type);
          const axis = ["x", "y", "z"].indexOf(property.name);
          if (axis >= 0) at[axis] = value;
          continue;
        }
        const corners = Array.from({ length: next(property.list) }, () => next(property.type));
        if (element.name === "face" && property.name.startsWith("vert")) {
          addFan(triangles, corners, vertices.length / 3);
        }
      }
      if (element.name === "vertex") vertices.push(...at);
    }
  }
  return { vertices: Float64Array.from(vertices), triangles: Uint32Array.from(triangles) };
}

function textReader(bytes: Uint8Array, from: number): (type: string) => number {
  const words = new TextDecoder("latin1").decode(bytes.subarray(from)).split(/\s+/);
  let at = words[0] === "" ? 1 : 0;
  return () => {
    const word = words[at++];
    if (word === undefined || word === "") throw new Error("the file is not whole");
    return Number(word);
  };
}

function binaryReader(bytes: Uint8Array, from: number, little: boolean): (type: string) => number {
  // It throws where the file ends too early.
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let at = from;
  return (type) => {
    const before = at;
    at += bytesOf(type);
    return readScalar(view, before, type, little);
  };
}

// `unit`: m for 1 of its coordinates. The outlines are in the file's coordinates, and the floor's height with them.
export function meshOutlines(mesh: Mesh, unit: number, yUp: boolean): { outlines: Outline[]; floor: number } {
  const { vertices, triangles } = mesh;
  const count = vertices.length / 3;
  const height = (i: number) => vertices[3 * i + (yUp ? 1 : 2)]!;
  // Seen from above.
  const place = (i: number): Point =>
    yUp ? { x: vertices[3 * i]!, y: -vertices[3 * i + 2]! } : { x: vertices[3 * i]!, y: vertices[3 * i + 1]! };
  const heights = Float64Array.from({ length: count }, (_, i) => height(i)).sort();
  const floor = heights[Math.floor(belowFloor * (count - 1))] ?? 0;
  const level = floor + cutHeight / unit;
  const pieces: [Point, Point][] = [];
  for (let t = 0; t + 2 < triangles.length; t += 3) {
    const crossings: Point[] = [];
    for (let side = 0; side < 3; ++side) {
      const [a, b] = [triangles[t + side]!, triangles[t + ((side + 1) % 3)]!];
      const [za, zb] = [height(a), height(b)];
      if (za < level === zb < level) continue;
      const s = (level - za) / (zb - za);
      const [pa, pb] = [place(a), place(b)];
      crossings.push({ x: pa.x + s * (pb.x - pa.x), y: pa.y + s * (pb.y - pa.y) });
    }
    if (crossings.length === 2) pieces.push([crossings[0]!, crossings[1]!]);
  }
  const near = 0.002 / unit;
  return { outlines: largest(joined(pieces, near).map((line) => simplified(line, 10 * near))), floor };
}
