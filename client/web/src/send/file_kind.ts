// What a file is, by how it begins. The server takes range images; what else people have is named, so that
// they are told what to do with it.
export type FileKind = "rangeImage" | "e57" | "las" | "pcd" | "ply" | "ptx" | "vendor" | "unknown";

// What the head of a range image says of itself.
export interface RangeImageHead {
  columns: number;
  rows: number;
  // Elevations of the lowest row and of the highest, rad.
  lowest: number;
  highest: number;
}

const vendors = /\.(fls|fws|lsproj|imp|rtc360|zfs|rdbx|rxp|lgs|lgsx|pts|las|laz|jet|nctri)$/i;

export function fileKind(name: string, head: Uint8Array): FileKind {
  const text = new TextDecoder("latin1").decode(head.subarray(0, 64));
  if (text.startsWith("VRIM")) return "rangeImage";
  if (text.startsWith("ASTM-E57")) return "e57";
  if (text.startsWith("LASF")) return "las";
  if (/^(# \.PCD|VERSION )/.test(text)) return "pcd";
  if (text.startsWith("ply")) return "ply";
  if (/\.ptx$/i.test(name) && /^\s*\d+\s+\d+\s/.test(text)) return "ptx";
  if (vendors.test(name)) return "vendor";
  return "unknown";
}

export function rangeImageHead(head: Uint8Array): RangeImageHead | undefined {
  if (head.length < 48) return undefined;
  const view = new DataView(head.buffer, head.byteOffset, head.byteLength);
  const [columns, rows] = [view.getUint32(8, true), view.getUint32(12, true)];
  if (rows < 2 || rows > 262_144 || columns < 2 || columns > 262_144) return undefined;
  if (head.length < 32 + 8 * rows) return undefined;
  return {
    columns,
    rows,
    lowest: view.getFloat64(32, true),
    highest: view.getFloat64(32 + 8 * (rows - 1), true),
  };
}
