// What went wrong, told apart by what somebody can do about it.
import { Code, ConnectError } from "@connectrpc/connect";
import { ClaimConflictSchema, type ClaimConflict } from "../gen/vantage/v1/error_pb";
import { BadRequestSchema, ErrorInfoSchema, RetryInfoSchema } from "../gen/google/rpc/error_details_pb";
import type { Key } from "../texts/texts.svelte";

// Nothing is decided yet: there is no link, or the server says that the same call may succeed after a
// short wait, which the contract tells by RetryInfo.
export function isPassing(error: unknown): boolean {
  const known = ConnectError.from(error);
  return (
    known.code === Code.Unavailable ||
    known.code === Code.DeadlineExceeded ||
    known.code === Code.Canceled ||
    // What a browser's fetch throws where there is no link at all, or one that breaks.
    (known.code === Code.Unknown && known.cause instanceof TypeError) ||
    known.findDetails(RetryInfoSchema).length > 0
  );
}

// The tablet's token has run out or was taken back: nothing is decided until somebody pairs it again.
export function isUnknownTablet(error: unknown): boolean {
  return ConnectError.from(error).code === Code.Unauthenticated;
}

// ErrorInfo.reason, by which the contract tells errors apart.
export function reason(error: unknown): string {
  return ConnectError.from(error).findDetails(ErrorInfoSchema)[0]?.reason ?? "";
}

export function claimConflict(error: unknown): ClaimConflict | undefined {
  return ConnectError.from(error).findDetails(ClaimConflictSchema)[0];
}

const byReason: Record<string, Key> = {
  CLAIMED: "error.claimed",
  CLAIM_ENDED: "error.claimEnded",
  CLAIM_OF_ANOTHER: "error.claimOfAnother",
  STATIONS_FULL: "error.stationsFull",
  QUOTA_EXCEEDED: "error.full",
  STORE_FULL: "error.full",
  TOO_MANY_SESSIONS: "error.full",
  TOO_MANY_SCANS: "error.full",
  PLAN_TOO_LARGE: "error.planTooLarge",
  UPLOAD_ENDED: "error.uploadEnded",
  DATA_LOST: "error.dataLost",
  SESSION_EXISTS: "error.jobExists",
};

const byCode: Partial<Record<Code, Key>> = {
  [Code.Unauthenticated]: "error.unknownTablet",
  [Code.PermissionDenied]: "error.notAllowed",
  [Code.NotFound]: "error.gone",
  [Code.AlreadyExists]: "error.exists",
  [Code.ResourceExhausted]: "error.full",
  [Code.Unavailable]: "error.noConnection",
  [Code.DeadlineExceeded]: "error.noConnection",
  [Code.DataLoss]: "error.dataLost",
};

// The text for people; `detail` is the server's own sentence, English, where it adds something.
export function explain(error: unknown): { key: Key; detail: string } {
  const known = ConnectError.from(error);
  const violations = known
    .findDetails(BadRequestSchema)
    .flatMap((bad) => bad.fieldViolations.map((violation) => violation.description));
  if (isPassing(error)) return { key: "error.noConnection", detail: "" };
  const byItsReason = byReason[reason(error)];
  if (byItsReason !== undefined) return { key: byItsReason, detail: "" };
  const byItsCode = byCode[known.code];
  if (byItsCode !== undefined) return { key: byItsCode, detail: "" };
  return { key: "error.other", detail: violations.length > 0 ? violations.join("; ") : known.rawMessage };
}
