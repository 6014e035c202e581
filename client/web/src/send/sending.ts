// Sending a scan file in pieces. The upload is named by its content, so that a file that is picked again,
// after the screen was locked or the tab closed, goes on where the server has it, and arrives once.
import { sha256 } from "@noble/hashes/sha2.js";
import { bytesToHex } from "@noble/hashes/utils.js";
import { pause } from "../job/follow";
import { crc32c } from "./crc32c";

// The server's side, of which the tests have another one.
export interface Place {
  name: string;
  state: "open" | "committed" | "ended";
  // Why it ended; the server's words.
  message: string;
  nextSequence: bigint;
  nextOffset: bigint;
  maxPiece: number;
  // The scan that it became.
  scan: string;
}

export interface UploadServer {
  // Begins the upload, or finds it where it was begun before.
  begin(requestId: string, total: { size: bigint; sha256: Uint8Array }): Promise<Place>;
  get(name: string): Promise<Place>;
  piece(upload: string, piece: { sequence: bigint; offset: bigint; data: Uint8Array; crc32c: number }): Promise<Place>;
  // The scan was withdrawn, so that it may come again.
  withdrawn(scan: string): Promise<boolean>;
  isPassing(error: unknown): boolean;
  // The piece did not fit to what the server has: it is asked where to go on.
  isOutOfStep(error: unknown): boolean;
}

export interface Progress {
  stage: "reading" | "sending" | "waiting";
  done: number;
  total: number;
}

export class UploadEnded extends Error {}

// Large enough to be quick, small enough to lose little when a link breaks.
const pieceBytes = 256 * 1024;
const readBytes = 4 * 1024 * 1024;
const pauses = [500, 1_000, 2_000, 4_000, 8_000, 15_000];
// So often a scan may have been sent and withdrawn.
const mostTimes = 100;

export interface Bytes {
  size: number;
  slice(from: number, to: number): { arrayBuffer(): Promise<ArrayBuffer> };
}

export async function digest(file: Bytes, on: (progress: Progress) => void, signal: AbortSignal): Promise<Uint8Array> {
  const hash = sha256.create();
  for (let at = 0; at < file.size; at += readBytes) {
    signal.throwIfAborted();
    hash.update(new Uint8Array(await file.slice(at, Math.min(file.size, at + readBytes)).arrayBuffer()));
    on({ stage: "reading", done: Math.min(file.size, at + readBytes), total: file.size });
  }
  return hash.digest();
}

// Returns the scan that the file became. Goes on through breaks for as long as the signal lets it.
export async function sendFile(
  file: Bytes,
  // What else tells this upload from others with the same bytes.
  about: string,
  server: UploadServer,
  on: (progress: Progress) => void,
  signal: AbortSignal,
): Promise<string> {
  const whole = await digest(file, on, signal);
  const content = bytesToHex(sha256(new TextEncoder().encode(`${bytesToHex(whole)} ${about}`))).slice(0, 32);
  const total = { size: BigInt(file.size), sha256: whole };
  let failures = 0;
  const through = async <T>(call: () => Promise<T>): Promise<T> => {
    for (;;) {
      signal.throwIfAborted();
      try {
        const result = await call();
        failures = 0;
        return result;
      } catch (error) {
        if (signal.aborted || !server.isPassing(error)) throw error;
        on({ stage: "waiting", done: sent, total: file.size });
        await pause(pauses[Math.min(failures, pauses.length - 1)] ?? 15_000, signal);
        failures += 1;
      }
    }
  };
  let sent = 0;
  let place: Place | undefined;
  for (let times = 0; times < mostTimes; ++times) {
    place = await through(() => server.begin(`scan-${content}-${times}`, total));
    const { state, scan } = place;
    if (state === "open" || (state === "committed" && !(await through(() => server.withdrawn(scan))))) break;
  }
  if (place === undefined) throw new UploadEnded("");
  let at: Place = place;
  while (at.state === "open") {
    signal.throwIfAborted();
    sent = Number(at.nextOffset);
    on({ stage: "sending", done: sent, total: file.size });
    const size = Math.min(pieceBytes, at.maxPiece > 0 ? at.maxPiece : pieceBytes, file.size - sent);
    const data = new Uint8Array(await file.slice(sent, sent + size).arrayBuffer());
    if (data.length !== size) throw new UploadEnded("the file has changed");
    const piece = { sequence: at.nextSequence, offset: at.nextOffset, data, crc32c: crc32c(data) };
    const { name } = at;
    try {
      at = await server.piece(name, piece);
      failures = 0;
    } catch (error) {
      if (signal.aborted) throw error;
      if (!server.isPassing(error) && !server.isOutOfStep(error)) throw error;
      on({ stage: "waiting", done: sent, total: file.size });
      await pause(pauses[Math.min(failures, pauses.length - 1)] ?? 15_000, signal);
      failures += 1;
      at = await through(() => server.get(name));
    }
  }
  if (at.state !== "committed") throw new UploadEnded(at.message);
  on({ stage: "sending", done: file.size, total: file.size });
  return at.scan;
}
