// Sending a scan file in pieces. The upload is named by its content, so that a file that is picked again,
// after the screen was locked or the tab closed, goes on where the server has it, and arrives once.
import { sha256 } from "@noble/hashes/sha2.js";
import { bytesToHex } from "@noble/hashes/utils.js";
import { pause } from "../job/follow";
import { crc32c } from "./crc32c";
import type { Turns } from "./turns";

// The server's side, of which the tests have another one.
export interface Place {
  name: string;
  // Reading: all of a file is there, and the server reads it.
  state: "open" | "reading" | "committed" | "failed" | "ended";
  // Why it failed, what it waits for, or what else is worth knowing; the server's words.
  message: string;
  // Why it failed, for programs.
  reason: string;
  nextSequence: bigint;
  nextOffset: bigint;
  maxPiece: number;
  // The scans that it became so far.
  scans: string[];
  // Of a file that is being read: how far, bytes; and the scans in it, 0: not known yet.
  read: number;
  setups: number;
}

export interface UploadServer {
  // Begins the upload, or finds it where it was begun before.
  begin(requestId: string, total: { size: bigint; sha256: Uint8Array }): Promise<Place>;
  get(name: string): Promise<Place>;
  piece(upload: string, piece: { sequence: bigint; offset: bigint; data: Uint8Array; crc32c: number }): Promise<Place>;
  // The scan was withdrawn, so that it may come again.
  withdrawn(scan: string): Promise<boolean>;
  // Somebody was told that this upload failed, and sends the file once more.
  wasTold(upload: string): boolean;
  isPassing(error: unknown): boolean;
  // The piece did not fit to what the server has: it is asked where to go on.
  isOutOfStep(error: unknown): boolean;
}

export interface Progress {
  // On the server: it reads the file. Elsewhere: another tab sends it.
  stage: "reading" | "sending" | "waiting" | "onServer" | "elsewhere";
  done: number;
  total: number;
  // Of a file on the server: scans that came of it so far, and that are in it, 0: not known yet.
  scans?: number;
  setups?: number;
}

export class UploadEnded extends Error {
  constructor(
    message: string,
    readonly reason = "",
    readonly upload = "",
  ) {
    super(message);
  }
}

// Large enough to be quick, small enough to lose little when a link breaks.
const pieceBytes = 256 * 1024;
const readBytes = 4 * 1024 * 1024;
const pauses = [500, 1_000, 2_000, 4_000, 8_000, 15_000];
// How often one looks how far the server, or another tab, is, ms.
const look = 1_000;
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

// Returns what the file became. Goes on through breaks for as long as the signal lets it.
export async function sendFile(
  file: Bytes,
  // What else tells this upload from others with the same bytes.
  about: string,
  server: UploadServer,
  turns: Turns,
  on: (progress: Progress) => void,
  signal: AbortSignal,
): Promise<Place> {
  const whole = await digest(file, on, signal);
  const content = bytesToHex(sha256(new TextEncoder().encode(`${bytesToHex(whole)} ${about}`))).slice(0, 32);
  const total = { size: BigInt(file.size), sha256: whole };
  let failures = 0;
  let sent = 0;
  const wait = async () => {
    on({ stage: "waiting", done: sent, total: file.size });
    await pause(pauses[Math.min(failures, pauses.length - 1)] ?? 15_000, signal);
    failures += 1;
  };
  const through = async <T>(call: () => Promise<T>): Promise<T> => {
    for (;;) {
      signal.throwIfAborted();
      try {
        const result = await call();
        failures = 0;
        return result;
      } catch (error) {
        if (signal.aborted || !server.isPassing(error)) throw error;
        await wait();
      }
    }
  };

  // An upload that ended without a scan, or whose scans were all withdrawn, makes room for another one.
  const mayComeAgain = async ({ name, state, scans }: Place): Promise<boolean> => {
    if (state === "ended") return true;
    if (state === "failed") return server.wasTold(name);
    if (state !== "committed") return false;
    for (const scan of scans) if (!(await through(() => server.withdrawn(scan)))) return false;
    return true;
  };
  let found: Place | undefined;
  for (let times = 0; times < mostTimes; ++times) {
    found = await through(() => server.begin(`scan-${content}-${times}`, total));
    if (!(await mayComeAgain(found))) break;
  }
  if (found === undefined) throw new UploadEnded("");
  let at: Place = found;
  const { name } = at;

  const sendPieces = async () => {
    while (at.state === "open") {
      signal.throwIfAborted();
      sent = Number(at.nextOffset);
      on({ stage: "sending", done: sent, total: file.size });
      const size = Math.min(pieceBytes, at.maxPiece > 0 ? at.maxPiece : pieceBytes, file.size - sent);
      const data = new Uint8Array(await file.slice(sent, sent + size).arrayBuffer());
      if (data.length !== size) throw new UploadEnded("the file has changed");
      const piece = { sequence: at.nextSequence, offset: at.nextOffset, data, crc32c: crc32c(data) };
      try {
        at = await server.piece(name, piece);
        failures = 0;
      } catch (error) {
        if (signal.aborted) throw error;
        if (!server.isPassing(error) && !server.isOutOfStep(error)) throw error;
        await wait();
        at = await through(() => server.get(name));
      }
    }
  };
  while (at.state === "open") {
    const end = await turns.take(name);
    if (end !== undefined) {
      try {
        await sendPieces();
      } finally {
        end();
      }
      break;
    }
    on({ stage: "elsewhere", done: Number(at.nextOffset), total: file.size });
    await pause(look, signal);
    at = await through(() => server.get(name));
  }
  while (at.state === "reading") {
    on({ stage: "onServer", done: at.read, total: file.size, scans: at.scans.length, setups: at.setups });
    await pause(look, signal);
    at = await through(() => server.get(name));
  }
  if (at.state !== "committed") throw new UploadEnded(at.message, at.reason, name);
  on({ stage: "sending", done: file.size, total: file.size });
  return at;
}
