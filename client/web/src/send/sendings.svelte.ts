// The files that this tablet sends. They go on while somebody looks at other screens.
import { create } from "@bufbuild/protobuf";
import { Code, ConnectError } from "@connectrpc/connect";
import { isPassing, explain } from "../api/errors";
import { patience, scans } from "../api/server";
import { ScanState } from "../gen/vantage/v1/scan_pb";
import { PosePriorSchema } from "../gen/vantage/v1/geometry_pb";
import { UploadState, type Upload } from "../gen/vantage/v1/upload_pb";
import { upright, type Place as Spot } from "../job/actions";
import { t, type Key } from "../texts/texts.svelte";
import { fileKind, rangeImageSize, type FileKind } from "./file_kind";
import { sendFile, UploadEnded, type Place, type Progress, type UploadServer } from "./sending";

export interface Sending {
  id: number;
  session: string;
  name: string;
  progress: Progress;
  state: "under way" | "sent" | "failed" | "stopped";
  // Why it failed, for people; and the server's own words.
  words: string;
  detail: string;
  stop: () => void;
}

// Where a scan was made, as a person on the site knows it: the spot to some decimetres, and nothing of
// where the scanner's front pointed. Roll and pitch are those of a tripod set up by eye.
const spotSigma = 0.3;
const turnSigma = 1.2;
const tiltSigma = 0.05;

export function spotPrior(spot: Spot) {
  const sigmas = [tiltSigma, tiltSigma, turnSigma, spotSigma, spotSigma, spotSigma];
  const covariance = Array.from({ length: 36 }, (_, i) => {
    const row = Math.floor(i / 6);
    return row === i % 6 ? sigmas[row]! ** 2 : 0;
  });
  return create(PosePriorSchema, { pose: { rotation: upright(0), translation: spot }, covariance });
}

function placeOf(upload: Upload | undefined): Place {
  if (upload === undefined) throw new UploadEnded("no upload in the answer");
  const state =
    upload.state === UploadState.OPEN ? "open" : upload.state === UploadState.COMMITTED ? "committed" : "ended";
  return {
    name: upload.name,
    state,
    message: upload.stateMessage,
    nextSequence: upload.nextSequence,
    nextOffset: upload.nextOffset,
    maxPiece: Number(upload.maxPieceSizeBytes),
    scan: upload.scan,
  };
}

const notTaken: Partial<Record<FileKind, Key>> = {
  e57: "send.convert",
  las: "send.convert",
  pcd: "send.convert",
  ply: "send.convert",
  ptx: "send.convert",
  vendor: "send.vendor",
  unknown: "send.noScan",
};

// How long a file that was sent is still listed, ms.
const sentStays = 10_000;

class Sendings {
  list = $state<Sending[]>([]);
  #count = 0;

  of(session: string): Sending[] {
    return this.list.filter((sending) => sending.session === session);
  }

  forget(id: number): void {
    this.list = this.list.filter((sending) => sending.id !== id);
  }

  // Sends a file; `spot`: where the scan was made, as far as somebody knows.
  async send(session: string, file: File, scanner: string, spot: Spot | undefined): Promise<void> {
    const stopped = new AbortController();
    const id = ++this.#count;
    this.list.push({
      id,
      session,
      name: file.name,
      progress: { stage: "reading", done: 0, total: file.size },
      state: "under way",
      words: "",
      detail: "",
      stop: () => stopped.abort(),
    });
    const entry = this.list.find((sending) => sending.id === id)!;
    const fail = (key: Key, detail = "") => {
      entry.state = "failed";
      entry.words = t(key);
      entry.detail = detail;
    };
    try {
      const head = new Uint8Array(await file.slice(0, 64).arrayBuffer());
      const refusal = notTaken[fileKind(file.name, head)];
      if (refusal !== undefined) return fail(refusal);
      if (rangeImageSize(head) !== file.size) return fail("send.cutOff");
      const prior = spot === undefined ? undefined : spotPrior(spot);
      const displayName = file.name.replace(/\.[^.]+$/, "").slice(0, 200);
      const server: UploadServer = {
        async begin(requestId, total) {
          const upload = { displayName, scanner, prior, total: { encodedSizeBytes: total.size, sha256: total.sha256 } };
          return placeOf(
            (await scans.createUpload({ parent: session, requestId, upload }, { timeoutMs: patience })).upload,
          );
        },
        async get(name) {
          return placeOf((await scans.getUpload({ name }, { timeoutMs: patience })).upload);
        },
        async piece(upload, piece) {
          return placeOf((await scans.uploadPiece({ upload, piece }, { timeoutMs: 2 * patience })).upload);
        },
        async withdrawn(name) {
          return (await scans.getScan({ name }, { timeoutMs: patience })).scan?.state === ScanState.WITHDRAWN;
        },
        isPassing,
        isOutOfStep(error) {
          const { code } = ConnectError.from(error);
          return code === Code.OutOfRange || code === Code.DataLoss || code === Code.AlreadyExists;
        },
      };
      const about = `${scanner} ${spot === undefined ? "" : `${spot.x} ${spot.y} ${spot.z}`}`;
      await sendFile(file, about, server, (progress) => (entry.progress = progress), stopped.signal);
      entry.state = "sent";
      // It is among the scans from now on.
      setTimeout(() => this.forget(id), sentStays);
    } catch (error) {
      if (stopped.signal.aborted) entry.state = "stopped";
      else if (error instanceof UploadEnded) fail("send.refused", error.message);
      // What a browser throws where the file was moved or the stick pulled out.
      else if (error instanceof DOMException) fail("send.unreadable");
      else {
        const { key, detail } = explain(error);
        // What came is not what it said to be.
        fail(ConnectError.from(error).code === Code.InvalidArgument ? "send.refused" : key, detail);
      }
    }
  }
}

export const sendings = new Sendings();
