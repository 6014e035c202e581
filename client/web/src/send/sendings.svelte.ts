// The files that this tablet sends. They go on while somebody looks at other screens.
import { create } from "@bufbuild/protobuf";
import { Code, ConnectError } from "@connectrpc/connect";
import { explain, isPassing, reason } from "../api/errors";
import { patience, scans } from "../api/server";
import { ScanState } from "../gen/vantage/v1/scan_pb";
import { PosePriorSchema } from "../gen/vantage/v1/geometry_pb";
import { UploadState, type Upload } from "../gen/vantage/v1/upload_pb";
import { type Place as Spot } from "../job/actions";
import { upright } from "../job/heading";
import { t, texts, type Key } from "../texts/texts.svelte";
import { megabytes } from "../words/numbers";
import { kindOf, type FileKind } from "./file_kind";
import { sendFile, UploadEnded, type Place, type Progress, type UploadServer } from "./sending";
import { tabs } from "./turns";

export interface Sending {
  id: number;
  session: string;
  name: string;
  progress: Progress;
  state: "under way" | "sent" | "failed" | "stopped";
  // Why it failed, or what came of it, for people; and the server's own words.
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

const states: Partial<Record<UploadState, Place["state"]>> = {
  [UploadState.OPEN]: "open",
  [UploadState.READING]: "reading",
  [UploadState.COMMITTED]: "committed",
  [UploadState.FAILED]: "failed",
};

function placeOf(upload: Upload | undefined): Place {
  if (upload === undefined) throw new UploadEnded("no upload in the answer");
  return {
    name: upload.name,
    state: states[upload.state] ?? "ended",
    message: upload.stateMessage,
    reason: upload.stateReason,
    nextSequence: upload.nextSequence,
    nextOffset: upload.nextOffset,
    maxPiece: Number(upload.maxPieceSizeBytes),
    scans: upload.scans.length > 0 || upload.scan === "" ? upload.scans : [upload.scan],
    read: Number(upload.readSizeBytes),
    setups: upload.setupCount,
  };
}

// Where the scanner stood, in the coordinates of a file that does not say it.
export interface StationInFile {
  at: Spot;
  // The file's unit, m.
  unit: number;
}

const notTaken: Partial<Record<FileKind, Key>> = {
  vendor: "send.vendor",
  photo: "send.photo",
  video: "send.video",
  document: "send.document",
  archive: "send.archive",
  encrypted: "send.encrypted",
  cutOff: "send.cutOff",
  empty: "send.empty",
  unknown: "send.noScan",
};

// Why the server took no scan from a file, or no file.
const refused: Record<string, Key> = {
  NOT_A_SCAN: "send.noScan",
  FILE_CUT_OFF: "send.cutOff",
  FILE_ENCRYPTED: "send.encrypted",
  FORMAT_NOT_READ: "send.vendor",
  STATION_MISSING: "send.noStation",
  FILE_TOO_COSTLY: "send.tooCostly",
  FILE_NOT_READ: "send.notRead",
  FILE_LOST: "send.notRead",
  WORK_SET_ASIDE: "send.tooCostly",
};

// What is said of an upload that failed.
export function refusal(reasonOfState: string): Key {
  return refused[reasonOfState] ?? "send.refused";
}

// How long a file that was sent is still listed, ms.
const sentStays = 10_000;

class Sendings {
  list = $state<Sending[]>([]);
  #count = 0;
  // Uploads that failed, of which this page has told.
  readonly #told = new Set<string>();

  of(session: string): Sending[] {
    return this.list.filter((sending) => sending.session === session);
  }

  forget(id: number): void {
    this.list = this.list.filter((sending) => sending.id !== id);
  }

  // Sends a file; `spot`: where the scan was made, as far as somebody knows; `station`: of points.
  async send(
    session: string,
    file: File,
    scanner: string,
    spot: Spot | undefined,
    station?: StationInFile,
  ): Promise<void> {
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
    const fail = (key: Key, detail = "", values: Record<string, string> = {}) => {
      entry.state = "failed";
      entry.words = t(key, values);
      entry.detail = detail;
    };
    try {
      const kind = await kindOf(file);
      const why = notTaken[kind];
      if (why !== undefined) return fail(why);
      if (kind === "points" && station === undefined) return fail("send.noStation");
      const isFile = kind !== "rangeImage";
      if (isFile) {
        // Told before anything of it is read or sent.
        const listed = await scans.listUploads({ parent: session, pageSize: 1 }, { timeoutMs: patience });
        const most = Number(listed.maxFileSizeBytes);
        if (most === 0) return fail("send.convert");
        if (file.size > most) {
          const sizes = { size: megabytes(file.size, texts.locale), most: megabytes(most, texts.locale) };
          return fail("send.tooLarge", "", sizes);
        }
      }
      const prior = spot === undefined ? undefined : spotPrior(spot);
      const displayName = file.name.replace(/\.[^.]+$/, "").slice(0, 200);
      const server: UploadServer = {
        async begin(requestId, total) {
          const upload = {
            displayName,
            scanner,
            prior,
            total: { encodedSizeBytes: total.size, sha256: total.sha256 },
            file: isFile ? { name: file.name.slice(0, 200), station: station?.at, unitM: station?.unit } : undefined,
          };
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
        wasTold: (name) => this.#told.has(name),
        isPassing,
        isOutOfStep(error) {
          const { code } = ConnectError.from(error);
          return code === Code.OutOfRange || code === Code.DataLoss || code === Code.AlreadyExists;
        },
      };
      const place = (at: Spot | undefined) => (at === undefined ? "" : `${at.x} ${at.y} ${at.z}`);
      const stood = station === undefined ? "" : ` in file ${place(station.at)} of ${station.unit} m`;
      const about = `${scanner} ${place(spot)}${stood}`;
      const on = (progress: Progress) => (entry.progress = progress);
      const became = await sendFile(file, about, server, tabs, on, stopped.signal);
      entry.state = "sent";
      entry.words = isFile ? t("send.doneScans", { n: became.scans.length }) : t("send.done");
      entry.detail = became.message;
      // It is among the scans from now on. What is to be read stays until somebody clears it.
      if (entry.detail === "") setTimeout(() => this.forget(id), sentStays);
    } catch (error) {
      if (stopped.signal.aborted) entry.state = "stopped";
      else if (error instanceof UploadEnded) {
        this.#told.add(error.upload);
        fail(refusal(error.reason), error.message);
      }
      // What a browser throws where the file was moved or the stick pulled out.
      else if (error instanceof DOMException) fail("send.unreadable");
      else {
        const { key, detail } = explain(error);
        const { code, rawMessage } = ConnectError.from(error);
        // The job was deleted meanwhile; the file is still on the tablet.
        if (code === Code.NotFound) fail("send.jobGone");
        else if (reason(error) === "FILE_TOO_LARGE") fail("send.tooLargeNow", rawMessage);
        else if (code === Code.ResourceExhausted) fail(key, rawMessage);
        // What came is not what it said to be.
        else fail(code === Code.InvalidArgument ? "send.refused" : key, detail);
      }
    }
  }
}

export const sendings = new Sendings();
