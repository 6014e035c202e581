// What a file with a plan or a model of a building is, by how it begins, before a byte is sent. The server looks
// again (core/site_prior/prior_file.h).
import { characters } from "../send/file_kind";

export type PriorKind =
  | "picture"
  | "dxf"
  | "obj"
  | "ply"
  // What people pick by mistake, and what helps.
  | "dwg"
  | "pdf"
  | "scan"
  | "empty"
  | "unknown";

// As the contract has it (SetSitePriorRequest.file), bytes.
export const mostPriorBytes = 3 * 2 ** 20;

// Enough of a file to tell.
const headBytes = 65_536;

export async function priorKindOf(file: File): Promise<PriorKind> {
  return priorKind(new Uint8Array(await file.slice(0, headBytes).arrayBuffer()), file.type);
}

const pictures: readonly (readonly [at: number, bytes: string])[] = [
  [0, "\x89PNG"],
  [0, "\xff\xd8\xff"],
  [0, "GIF8"],
  [0, "BM"],
  [8, "WEBP"],
  [4, "ftypavif"],
];

// `head`: the first bytes; `type`: what the browser takes it for, which tells pictures of other kinds.
export function priorKind(head: Uint8Array, type = ""): PriorKind {
  if (head.length === 0) return "empty";
  const text = characters(head);
  if (pictures.some(([at, bytes]) => text.startsWith(bytes, at))) return "picture";
  if (text.startsWith("%PDF")) return "pdf";
  if (text.startsWith("AC10") || text.startsWith("AutoCAD Binary DXF")) return "dwg";
  if (/^ply\r?\n/.test(text)) return /\belement\s+face\s+[1-9]/.test(text) ? "ply" : "scan";
  if (text.startsWith("ASTM-E57") || text.startsWith("VRIM") || text.startsWith("LASF")) return "scan";
  if (/(^|\n)\s*0\r?\n\s*SECTION\b/.test(text)) return "dxf";
  if (/(^|\n)v\s+[-+.\d]/.test(text)) return "obj";
  return type.startsWith("image/") ? "picture" : "unknown";
}
