// Following a job: its events as they happen, over a link that may break at any time. The stream is
// closed while nobody looks (browsers allow six connections to a server), and begun again after the
// last event that was heard.
import type { SessionEvent } from "../gen/vantage/v1/event_pb";
import type { WatchSessionResponse } from "../gen/vantage/v1/session_service_pb";

export interface Link {
  // A sign of life: an event, or that there was none.
  heard(): void;
  event(event: SessionEvent): void;
  // The link is gone; it is tried again.
  lost(error: unknown): void;
  // The server says that it will never work: the job was deleted, or this tablet is not known.
  refused(error: unknown): void;
}

export interface Watch {
  open(afterSequence: bigint, signal: AbortSignal): AsyncIterable<WatchSessionResponse>;
  sequence(): bigint;
  isPassing(error: unknown): boolean;
  // Events up to the one that was heard are not there (another server, a restored backup).
  startOver(): Promise<void>;
  isAhead(error: unknown): boolean;
}

// The server speaks at least every 15 s; a link that is silent for longer than this is dead, ms.
export const silence = 20_000;
const pauses = [250, 500, 1_000, 2_000, 4_000, 8_000];

// Runs until the signal ends it.
export async function follow(watch: Watch, link: Link, signal: AbortSignal): Promise<void> {
  let failures = 0;
  while (!signal.aborted) {
    const attempt = new AbortController();
    const stop = () => attempt.abort();
    signal.addEventListener("abort", stop);
    let timer = setTimeout(stop, silence);
    try {
      for await (const response of watch.open(watch.sequence(), attempt.signal)) {
        clearTimeout(timer);
        timer = setTimeout(stop, silence);
        failures = 0;
        link.heard();
        if (response.step.case === "event") link.event(response.step.value);
        if (response.step.case === "resume") break;
      }
    } catch (error) {
      if (signal.aborted) return;
      if (watch.isAhead(error)) {
        await watch.startOver().catch((again: unknown) => link.lost(again));
      } else if (!watch.isPassing(error)) {
        link.refused(error);
        return;
      } else {
        link.lost(error);
      }
    } finally {
      clearTimeout(timer);
      signal.removeEventListener("abort", stop);
      attempt.abort();
    }
    await pause(pauses[Math.min(failures, pauses.length - 1)] ?? 8_000, signal);
    failures += 1;
  }
}

// Until the time is over, the signal comes, or the browser says that there is a network again.
export function pause(ms: number, signal: AbortSignal): Promise<void> {
  return new Promise((resolve) => {
    const timer = setTimeout(done, ms);
    function done(): void {
      clearTimeout(timer);
      signal.removeEventListener("abort", done);
      if (typeof window !== "undefined") window.removeEventListener("online", done);
      resolve();
    }
    signal.addEventListener("abort", done);
    if (typeof window !== "undefined") window.addEventListener("online", done);
  });
}
