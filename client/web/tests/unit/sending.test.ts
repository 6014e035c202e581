import { createHash } from "node:crypto";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { crc32c } from "../../src/send/crc32c";
import { fileKind, rangeImageSize } from "../../src/send/file_kind";
import { Surveyor } from "../browser/simulated_site";
import {
  digest,
  sendFile,
  UploadEnded,
  type Bytes,
  type Place,
  type Progress,
  type UploadServer,
} from "../../src/send/sending";
import type { Turns } from "../../src/send/turns";

interface Stored {
  bytes: number[];
  sequence: bigint;
  state: Place["state"];
  total: bigint;
  message?: string;
  reason?: string;
  scans?: string[];
  read?: number;
  setups?: number;
}
class Passing extends Error {}
class OutOfStep extends Error {}

function fileOf(bytes: Uint8Array): Bytes {
  return {
    size: bytes.length,
    slice: (from, to) => ({ arrayBuffer: async () => bytes.slice(from, to).buffer as ArrayBuffer }),
  };
}
const bytes = Uint8Array.from({ length: 300_000 }, (_, i) => (i * 2654435761) >>> 24);

// A server that keeps what came, byte by byte, and checks what it is sent.
class Server implements UploadServer {
  stored = new Map<string, Stored>();
  // What the last byte brings about.
  whole: Partial<Stored> = { state: "committed" };
  told = new Set<string>();
  // Called whenever somebody looks how far it is.
  looked: (upload: Stored) => void = () => undefined;
  pieces = 0;
  gone = new Set<string>();
  // Called before each piece is stored and after.
  fault: (when: "before" | "after", piece: number) => void = () => undefined;

  #place(name: string): Place {
    const upload = this.stored.get(name)!;
    return {
      name,
      state: upload.state,
      message: upload.message ?? "",
      reason: upload.reason ?? "",
      nextSequence: upload.sequence,
      nextOffset: BigInt(upload.bytes.length),
      maxPiece: 30_000,
      scans: upload.scans ?? (upload.state === "committed" ? [`scan of ${name}`] : []),
      read: upload.read ?? 0,
      setups: upload.setups ?? 0,
    };
  }
  async begin(requestId: string, total: { size: bigint; sha256: Uint8Array }): Promise<Place> {
    if (!this.stored.has(requestId))
      this.stored.set(requestId, { bytes: [], sequence: 0n, state: "open", total: total.size });
    return this.#place(requestId);
  }
  async get(name: string): Promise<Place> {
    this.looked(this.stored.get(name)!);
    return this.#place(name);
  }
  async piece(
    name: string,
    piece: { sequence: bigint; offset: bigint; data: Uint8Array; crc32c: number },
  ): Promise<Place> {
    const number = this.pieces++;
    this.fault("before", number);
    const upload = this.stored.get(name)!;
    if (piece.offset !== BigInt(upload.bytes.length) || piece.sequence !== upload.sequence) throw new OutOfStep();
    expect(piece.crc32c).toBe(crc32c(piece.data));
    for (const byte of piece.data) upload.bytes.push(byte);
    upload.sequence += 1n;
    if (BigInt(upload.bytes.length) === upload.total) Object.assign(upload, this.whole);
    this.fault("after", number);
    return this.#place(name);
  }
  async withdrawn(scan: string): Promise<boolean> {
    return this.gone.has(scan);
  }
  wasTold = (name: string) => this.told.has(name);
  isPassing = (error: unknown) => error instanceof Passing;
  isOutOfStep = (error: unknown) => error instanceof OutOfStep;
  content(): number[][] {
    return [...this.stored.values()].filter((upload) => upload.state === "committed").map((upload) => upload.bytes);
  }
}

// Without locks, as in browsers that have none.
const everybody: Turns = { take: async () => () => undefined };
const place = (server: Server, on: (progress: Progress) => void = () => undefined, turns = everybody) =>
  sendFile(fileOf(bytes), "", server, turns, on, new AbortController().signal);
const send = async (server: Server, signal = new AbortController().signal, about = "") =>
  (await sendFile(fileOf(bytes), about, server, everybody, () => undefined, signal)).scans[0];
beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

test("checksums are those of the standard", () => {
  // RFC 3720, appendix B.4.
  expect(crc32c(new Uint8Array(32))).toBe(0x8a9136aa);
  expect(crc32c(new Uint8Array(32).fill(0xff))).toBe(0x62a8ab43);
  expect(crc32c(Uint8Array.from({ length: 32 }, (_, i) => i))).toBe(0x46dd794e);
});

test("a digest read in parts is the digest of the whole", async () => {
  const large = new Uint8Array(9_000_001).map((_, i) => i % 251);
  const hash = await digest(fileOf(large), () => undefined, new AbortController().signal);
  expect(Buffer.from(hash).toString("hex")).toBe(createHash("sha256").update(large).digest("hex"));
});

test("a file arrives whole, and links that break at any piece change nothing", async () => {
  for (const [when, at] of [
    ["before", 0],
    ["after", 0],
    ["before", 4],
    ["after", 9],
  ] as const) {
    const server = new Server();
    let broken = false;
    server.fault = (now, piece) => {
      if (!broken && now === when && piece === at) {
        broken = true;
        throw new Passing();
      }
    };
    const sent = send(server);
    await vi.advanceTimersByTimeAsync(60_000);
    expect(await sent).toMatch(/^scan of scan-/);
    expect(server.content()).toEqual([Array.from(bytes)]);
    expect(broken).toBe(true);
  }
});

test("a file that is picked again goes on where the server has it", async () => {
  const server = new Server();
  const closed = new AbortController();
  server.fault = (when, piece) => {
    if (when === "after" && piece === 3) closed.abort();
  };
  await expect(send(server, closed.signal)).rejects.toThrow();
  expect(server.pieces).toBe(4);
  server.fault = () => undefined;
  await send(server);
  expect(server.pieces).toBe(10);
  expect(server.content()).toEqual([Array.from(bytes)]);
  // Once more: it is there.
  await send(server);
  expect(server.pieces).toBe(10);
});

test("a scan that was withdrawn may come again, another place is another upload", async () => {
  const server = new Server();
  const scan = await send(server);
  server.gone.add(scan);
  expect(await send(server)).not.toBe(scan);
  await send(server, undefined, "elsewhere");
  expect(server.stored.size).toBe(3);
});

test("two tabs on one file: both end with the same scan", async () => {
  const server = new Server();
  const both = Promise.all([send(server), send(server)]);
  await vi.advanceTimersByTimeAsync(600_000);
  const [one, other] = await both;
  expect(one).toBe(other);
  expect(server.content()).toEqual([Array.from(bytes)]);
});

test("an upload that the server ended says so", async () => {
  const server = new Server();
  server.fault = (when) => {
    if (when === "after") for (const upload of server.stored.values()) upload.state = "ended";
  };
  // Every name for it has ended: it is begun anew each time, and each is told.
  await expect(send(server)).rejects.toThrow(UploadEnded);
});

test("a file is followed while the server reads it", async () => {
  const server = new Server();
  server.whole = { state: "reading" };
  let looks = 0;
  server.looked = (upload) => {
    upload.setups = 2;
    upload.read = 30_000 * ++looks;
    upload.scans = Array.from({ length: looks - 1 }, (_, i) => `scan-${i + 1}`);
    if (looks === 3) upload.state = "committed";
  };
  const seen: Progress[] = [];
  const sent = place(server, (progress) => seen.push(progress));
  await vi.advanceTimersByTimeAsync(10_000);
  expect((await sent).scans).toEqual(["scan-1", "scan-2"]);
  expect(seen.filter(({ stage }) => stage === "onServer")).toEqual([
    { stage: "onServer", done: 0, total: bytes.length, scans: 0, setups: 0 },
    { stage: "onServer", done: 30_000, total: bytes.length, scans: 0, setups: 2 },
    { stage: "onServer", done: 60_000, total: bytes.length, scans: 1, setups: 2 },
  ]);
});

test("a file that the server could not read is told of, and sent again only when somebody wants it", async () => {
  const server = new Server();
  server.whole = { state: "failed", reason: "FILE_CUT_OFF", message: "it is cut off" };
  const failure = async () => (await place(server).catch((error: unknown) => error)) as UploadEnded;
  const first = await failure();
  expect([first.reason, first.message]).toEqual(["FILE_CUT_OFF", "it is cut off"]);
  expect(server.pieces).toBe(10);
  // After the tab was closed: told at once, and nothing is sent.
  expect((await failure()).upload).toBe(first.upload);
  expect(server.pieces).toBe(10);
  server.told.add(first.upload);
  server.whole = { state: "committed" };
  expect((await place(server)).state).toBe("committed");
  expect(server.pieces).toBe(20);
});

test("a file comes again when all its scans were withdrawn, not before", async () => {
  const server = new Server();
  server.whole = { state: "committed", scans: ["a", "b"] };
  const { name } = await place(server);
  server.gone.add("a");
  expect((await place(server)).name).toBe(name);
  server.gone.add("b");
  expect((await place(server)).name).not.toBe(name);
});

test("one of two tabs sends, and the other goes on when that is closed", async () => {
  const server = new Server();
  const taken = new Set<string>();
  const turns: Turns = {
    async take(name) {
      if (taken.has(name)) return undefined;
      taken.add(name);
      return () => taken.delete(name);
    },
  };
  const closed = new AbortController();
  server.fault = (when, piece) => {
    if (when === "after" && piece === 4) closed.abort();
  };
  const ignored = () => undefined;
  const one = sendFile(fileOf(bytes), "", server, turns, ignored, closed.signal).catch(() => "closed");
  const stages = new Set<string>();
  const other = place(server, ({ stage }) => stages.add(stage), turns);
  await vi.advanceTimersByTimeAsync(60_000);
  expect(await one).toBe("closed");
  expect((await other).state).toBe("committed");
  // No piece came twice.
  expect(server.pieces).toBe(10);
  expect(server.content()).toEqual([Array.from(bytes)]);
  expect([...stages]).toContain("elsewhere");
});

test("files are told apart by how they begin, whatever they are called", () => {
  const kind = (text: string | Uint8Array, name = "scan.e57", size = 1_000_000) => {
    const head = typeof text === "string" ? Uint8Array.from(text, (c) => c.charCodeAt(0)) : text;
    return fileKind(name, head, size);
  };
  const e57 = (said: number) => {
    const head = new Uint8Array(64);
    head.set(new TextEncoder().encode("ASTM-E57"));
    new DataView(head.buffer).setBigUint64(16, BigInt(said), true);
    return head;
  };
  expect(kind(e57(1_000_000))).toBe("e57");
  expect(kind(e57(1_000_001))).toBe("cutOff");
  expect(kind("VRIM\x01".padEnd(64, "\0"))).toBe("cutOff");
  expect(kind("1440\n600\n0 0 0\n1 0 0\n0 1 0\n", "holiday.jpg")).toBe("ptx");
  expect(kind("1440\n600\n0 0 0\n", "s.ptx")).toBe("points");
  expect(kind("# .PCD v0.7\nVERSION 0.7\n")).toBe("pcd");
  expect(kind("x;y;z\n1.5;2;-3e2\n")).toBe("points");
  expect(kind("LASF\0\0")).toBe("points");
  expect(kind("LASF\0\0", "s.laz")).toBe("vendor");
  expect(kind("ply\nformat ascii 1.0")).toBe("points");
  expect(kind("\x01\x02", "a.fls")).toBe("vendor");
  expect(kind("\xff\xd8\xff\xe0")).toBe("photo");
  // Bytes that a browser's decoders take for other signs.
  expect(kind("\x89PNG\r\n\x1a\n")).toBe("photo");
  expect(kind("\x1f\x8b\x08")).toBe("archive");
  expect(kind("\0\0\0\x18ftypheic")).toBe("photo");
  expect(kind("\0\0\0\x18ftypmp42")).toBe("video");
  expect(kind("%PDF-1.7")).toBe("document");
  expect(kind("PK\x03\x04\x14\0\0\0")).toBe("archive");
  expect(kind("PK\x03\x04\x14\0\x01\0")).toBe("encrypted");
  expect(kind("Salted__12345678")).toBe("encrypted");
  expect(kind("\0\0\0\0")).toBe("cutOff");
  expect(kind("Dear Sir")).toBe("unknown");
  expect(kind("\x01\x02\x03")).toBe("unknown");
  expect(kind("", "scan.e57", 0)).toBe("empty");
});

test("a range image that was cut off is told by its head", () => {
  const whole = new Surveyor().first();
  expect(rangeImageSize(whole.subarray(0, 64))).toBe(whole.length);
  const coloured = whole.slice(0, 64);
  coloured[6] = 7;
  // Five bytes more for each cell.
  const [columns, rows] = [720, 299];
  expect(rangeImageSize(coloured)).toBe(whole.length + 5 * columns * rows);
  expect(rangeImageSize(new Uint8Array(64))).toBeUndefined();
  expect(rangeImageSize(new Uint8Array(3))).toBeUndefined();
});
