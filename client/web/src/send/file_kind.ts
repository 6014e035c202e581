// What a file is, by how it begins. The server takes range images; what else people have is named, so that
// they are told what to do with it.
export type FileKind = "rangeImage" | "e57" | "las" | "pcd" | "ply" | "ptx" | "vendor" | "unknown";

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

// How large a range image is by what its head says (proto/vantage/v1/upload.proto), bytes; undefined where the head
// cannot be that of one. A file of another size was cut off, or is no range image, and need not be sent to find out.
export function rangeImageSize(head: Uint8Array): number | undefined {
  if (head.length < 16) return undefined;
  const view = new DataView(head.buffer, head.byteOffset, head.byteLength);
  const flags = view.getUint16(6, true);
  const [columns, rows] = [view.getUint32(8, true), view.getUint32(12, true)];
  const most = 262_144;
  if (flags > 7 || columns < 2 || columns > most || rows < 2 || rows > most) return undefined;
  const cell = 4 + (flags & 2 ? 2 : 0) + (flags & 4 ? 3 : 0);
  return 32 + 8 * rows + columns * (8 + cell * rows);
}
