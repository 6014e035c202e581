// What a file is, by how it begins, before a byte is sent: which scans the server reads, and what else people
// pick by mistake. The server looks again (core/sensor/file_content.h).
export type FileKind =
  // Sent as it is.
  | "rangeImage"
  // Read by the server.
  | "e57"
  | "ptx"
  | "pcd"
  // Points that do not say where the scanner stood: read by the server once somebody said it.
  | "points"
  | "vendor"
  | "photo"
  | "video"
  | "document"
  | "archive"
  | "encrypted"
  | "cutOff"
  | "empty"
  | "unknown";

const vendors = /\.(fls|fws|lsproj|imp|rtc360|zfs|zfprj|rdb|rdbx|rxp|rcp|rcs|lgs|lgsx|ptg|tzf|tzs|laz|jet|nctri)$/i;

// Enough of a file to tell.
const headBytes = 8192;

type Beginning = readonly [at: number, bytes: string, kind: FileKind];
const beginnings: readonly Beginning[] = [
  [0, "\xff\xd8\xff", "photo"],
  [0, "\x89PNG", "photo"],
  [0, "GIF8", "photo"],
  [0, "II*\0", "photo"],
  [0, "MM\0*", "photo"],
  [8, "WEBP", "photo"],
  [4, "ftyphei", "photo"],
  [4, "ftypmif", "photo"],
  [4, "ftypavif", "photo"],
  [4, "ftyp", "video"],
  [8, "AVI ", "video"],
  [0, "\x1a\x45\xdf\xa3", "video"],
  [0, "%PDF", "document"],
  [0, "{\\rtf", "document"],
  [0, "\xd0\xcf\x11\xe0", "document"],
  [0, "AC10", "document"],
  [0, "ISO-10303-21", "document"],
  [0, "<", "document"],
  [0, "7z\xbc\xaf", "archive"],
  [0, "Rar!", "archive"],
  [0, "\x1f\x8b", "archive"],
  [0, "BZh", "archive"],
  [0, "\xfd7zXZ", "archive"],
  [0, "\x28\xb5\x2f\xfd", "archive"],
  [0, "-----BEGIN PGP MESSAGE", "encrypted"],
  [0, "Salted__", "encrypted"],
  [0, "age-encryption.org/", "encrypted"],
];

// Lines of text that are no comments, as words.
function rows(text: string): string[][] {
  return text
    .split("\n")
    .slice(0, 110)
    .map((line) => line.trim())
    .filter((line) => line !== "" && !line.startsWith("#") && !line.startsWith("//"))
    .map((line) => line.split(/[\s,;]+/));
}

const isNumber = (word: string) => /^[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?$/.test(word);

function textKind(text: string): FileKind {
  const lines = rows(text);
  const numbers = (at: number, count: number) => lines[at]?.length === count && lines[at].every(isNumber);
  // Columns, rows, the scanner's place, its axes.
  if (numbers(0, 1) && numbers(1, 1) && numbers(2, 3) && numbers(3, 3)) return "ptx";
  return lines.some((words) => words.length >= 3 && words.slice(0, 3).every(isNumber)) ? "points" : "unknown";
}

// Looks at the beginning of a file.
export async function kindOf(file: File): Promise<FileKind> {
  return fileKind(file.name, new Uint8Array(await file.slice(0, headBytes).arrayBuffer()), file.size);
}

// A character for each byte. A browser's decoder for 'latin1' is none: it takes 0x89, with which PNG begins, for a sign
// of per mille.
export function characters(bytes: Uint8Array): string {
  let text = "";
  for (let at = 0; at < bytes.length; at += 8192) text += String.fromCharCode(...bytes.subarray(at, at + 8192));
  return text;
}

// `head`: the first bytes, headBytes of them where there are so many; `size`: of the file.
export function fileKind(name: string, head: Uint8Array, size: number): FileKind {
  if (size === 0) return "empty";
  const text = characters(head);
  if (text.startsWith("VRIM")) return rangeImageSize(head) === size ? "rangeImage" : "cutOff";
  if (text.startsWith("ASTM-E57")) {
    if (head.length < 48) return "cutOff";
    const said = new DataView(head.buffer, head.byteOffset, head.byteLength).getBigUint64(16, true);
    return said > BigInt(size) ? "cutOff" : "e57";
  }
  if (text.startsWith("LASF") || /^ply\r?\n/.test(text)) return vendors.test(name) ? "vendor" : "points";
  if (/^(# \.PCD|VERSION )/.test(text)) return "pcd";
  if (text.startsWith("PK\x03\x04")) return (head[6] ?? 0) & 1 ? "encrypted" : "archive";
  const found = beginnings.find(([at, bytes]) => text.startsWith(bytes, at));
  if (found !== undefined) return found[2];
  if (vendors.test(name)) return "vendor";
  if (head.every((byte) => byte === 0)) return "cutOff";
  // Control characters but for blanks and ends of lines.
  if (head.some((byte) => byte < 32 && ![9, 10, 12, 13].includes(byte))) return "unknown";
  return textKind(text);
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
