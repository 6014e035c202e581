// A plan or a model of the building that somebody chose, read as far as it is drawn and placed on the tablet.
import { dxfOutlines, type Drawing } from "./dxf_outlines";
import { meshOutlines, readObj, readPlyMesh, type Mesh } from "./mesh_outlines";
import { bounds, type Outline } from "./outlines";
import { planPicture } from "./picture_file";
import { pictureOutlines, type GreyPicture } from "./picture_outlines";
import type { Reading } from "./placement";
import { mostPriorBytes, priorKindOf } from "./prior_kind";

export interface ChosenFile {
  name: string;
  // As it is sent.
  bytes: Uint8Array<ArrayBuffer>;
  kind: Reading["kind"];
  picture?: GreyPicture;
  drawing?: Drawing;
  mesh?: Mesh;
}

export type Unfit = "dwg" | "pdf" | "scan" | "empty" | "unknown" | "tooLarge" | "damaged" | "noWalls";

export async function openFile(file: File): Promise<ChosenFile | Unfit> {
  const kind = await priorKindOf(file);
  if (kind !== "picture" && kind !== "dxf" && kind !== "obj" && kind !== "ply") return kind;
  // Pictures are made smaller on the way.
  if (kind !== "picture" && file.size > mostPriorBytes) return "tooLarge";
  try {
    if (kind === "picture") {
      const made = await planPicture(file);
      return made === undefined ? "tooLarge" : { name: file.name, kind, bytes: made.bytes, picture: made.picture };
    }
    const bytes = new Uint8Array(await file.arrayBuffer());
    const chosen = { name: file.name, kind, bytes };
    if (kind === "dxf") {
      const drawing = dxfOutlines(new TextDecoder().decode(bytes));
      return drawing.outlines.length === 0 ? "noWalls" : { ...chosen, drawing };
    }
    const mesh = kind === "ply" ? readPlyMesh(bytes) : readObj(new TextDecoder().decode(bytes));
    return mesh.triangles.length === 0 ? "noWalls" : { ...chosen, mesh };
  } catch {
    return "damaged";
  }
}

// Its walls as somebody means it: what of a picture is dark enough, which axis of a model points up, in which unit.
export function wallsOf(
  file: ChosenFile,
  meant: { unit: number; yUp: boolean; darkest: number },
): { outlines: Outline[]; floor: number } {
  if (file.picture !== undefined) return { outlines: pictureOutlines(file.picture, meant.darkest), floor: 0 };
  if (file.mesh !== undefined) return meshOutlines(file.mesh, meant.unit, meant.yUp);
  return { outlines: file.drawing?.outlines ?? [], floor: 0 };
}

// The unit that makes a building of it, m: what the file says, else the first of those in use.
const building: readonly [number, number] = [3, 500];
export function likelyUnit(file: ChosenFile): number {
  if (file.drawing !== undefined && file.drawing.unit > 0) return file.drawing.unit;
  const wide = widest(file);
  return [1, 0.001, 0.01, 0.3048].find((unit) => wide * unit >= building[0] && wide * unit <= building[1]) ?? 1;
}

function widest(file: ChosenFile): number {
  if (file.drawing !== undefined) {
    const [min, max] = bounds(file.drawing.outlines.flat());
    return Math.max(max.x - min.x, max.y - min.y);
  }
  return Math.max(...[0, 1, 2].map((axis) => span(file.mesh, axis)));
}

// Along an axis, in the file's coordinates.
function span(mesh: Mesh | undefined, axis: number): number {
  const vertices = mesh?.vertices ?? new Float64Array();
  let [low, high] = [Infinity, -Infinity];
  for (let i = axis; i < vertices.length; i += 3) {
    [low, high] = [Math.min(low, vertices[i]!), Math.max(high, vertices[i]!)];
  }
  return Math.max(0, high - low);
}

// Buildings are wider than high: of a model that spans least along y, that axis points up.
export function likelyYUp(file: ChosenFile): boolean {
  return file.mesh !== undefined && span(file.mesh, 1) < 0.8 * span(file.mesh, 2);
}
