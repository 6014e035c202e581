import { createHash } from "node:crypto";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { crc32c } from "../../src/send/crc32c";
import { fileKind, rangeImageSize } from "../../src/send/file_kind";
import { Surveyor } from "../browser/simulated_site";
import { digest, sendFile, UploadEnded, type Bytes, type Place, type UploadServer } from "../../src/send/sending";

class Passing extends Error {}
class OutOfStep extends Error {}

function fileOf(bytes: Uint8Array): Bytes {
  return {
    size: bytes.length,
    slice: (from, to) => ({ arrayBuffer: async () => bytes.slice(from, to).buffer as ArrayBuffer }),
  };
}
const bytes = Uint8Array.from({ length: 1_000_000 }, (_, i) => (i * 2654435761) >>> 24);

// A server that keeps what came, byte by byte, and checks what it is sent.
class Server implements UploadServer {
  stored = new Map<string, { bytes: number[]; sequence: bigint; state: Place["state"]; total: bigint }>();
  pieces = 0;
  gone = new Set<string>();
  // Called before each piece is stored and after.
  fault: (when: "before" | "after", piece: number) => void = () => undefined;

  #place(name: string): Place {
    const upload = this.stored.get(name)!;
    return {
      name,
      state: upload.state,
      message: "",
      nextSequence: upload.sequence,
      nextOffset: BigInt(upload.bytes.length),
      maxPiece: 100_000,
      scan: upload.state === "committed" ? `scan of ${name}` : "",
    };
  }
  async begin(requestId: string, total: { size: bigint; sha256: Uint8Array }): Promise<Place> {
    if (!this.stored.has(requestId))
      this.stored.set(requestId, { bytes: [], sequence: 0n, state: "open", total: total.size });
    return this.#place(requestId);
  }
  async get(name: string): Promise<Place> {
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
    if (BigInt(upload.bytes.length) === upload.total) upload.state = "committed";
    this.fault("after", number);
    return this.#place(name);
  }
  async withdrawn(scan: string): Promise<boolean> {
    return this.gone.has(scan);
  }
  isPassing = (error: unknown) => error instanceof Passing;
  isOutOfStep = (error: unknown) => error instanceof OutOfStep;
  content(): number[][] {
    return [...this.stored.values()].filter((upload) => upload.state === "committed").map((upload) => upload.bytes);
  }
}

const send = (server: Server, signal = new AbortController().signal, about = "") =>
  sendFile(fileOf(bytes), about, server, () => undefined, signal);
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

test("files are told apart by how they begin", () => {
  const head = (text: string) => new TextEncoder().encode(text.padEnd(64, "\0"));
  expect(fileKind("a.vrim", head("VRIM\x01"))).toBe("rangeImage");
  expect(fileKind("a.e57", head("ASTM-E57"))).toBe("e57");
  expect(fileKind("a.ptx", head("1440\n600\n0 0 0\n"))).toBe("ptx");
  expect(fileKind("a.fls", head("\x01\x02"))).toBe("vendor");
  expect(fileKind("holiday.jpg", head("\xff\xd8\xff"))).toBe("unknown");
  expect(fileKind("empty", new Uint8Array(0))).toBe("unknown");
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
