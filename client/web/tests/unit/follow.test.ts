import { create } from "@bufbuild/protobuf";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { SessionEventSchema } from "../../src/gen/vantage/v1/event_pb";
import { WatchSessionResponseSchema, type WatchSessionResponse } from "../../src/gen/vantage/v1/session_service_pb";
import { follow, silence, type Link, type Watch } from "../../src/job/follow";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

class Broken extends Error {}
class Ahead extends Error {}
const happened = (sequence: bigint) =>
  create(WatchSessionResponseSchema, { step: { case: "event", value: create(SessionEventSchema, { sequence }) } });

function job(streams: ((after: bigint, signal: AbortSignal) => AsyncGenerator<WatchSessionResponse>)[]) {
  const heard: bigint[] = [];
  const opened: bigint[] = [];
  const told: string[] = [];
  const stop = new AbortController();
  let last = 0n;
  const watch: Watch = {
    open(after, signal) {
      opened.push(after);
      const next = streams.shift();
      if (next === undefined) {
        stop.abort();
        return (async function* () {})();
      }
      return next(after, signal);
    },
    sequence: () => last,
    isPassing: (error) => error instanceof Broken,
    isAhead: (error) => error instanceof Ahead,
    async startOver() {
      last = 0n;
      told.push("over");
    },
  };
  const link: Link = {
    heard: () => undefined,
    event(event) {
      heard.push(event.sequence);
      last = event.sequence;
    },
    lost: () => void told.push("lost"),
    refused: () => void told.push("refused"),
  };
  return { heard, opened, told, run: () => follow(watch, link, stop.signal), stop };
}

test("a stream that breaks is begun again after the last event that was heard", async () => {
  const it = job([
    async function* () {
      yield happened(1n);
      yield happened(2n);
      throw new Broken();
    },
    async function* () {
      throw new Broken();
    },
    async function* () {
      yield happened(3n);
    },
  ]);
  const run = it.run();
  await vi.advanceTimersByTimeAsync(120_000);
  await run;
  expect(it.heard).toEqual([1n, 2n, 3n]);
  expect(it.opened).toEqual([0n, 2n, 2n, 3n]);
  expect(it.told).toEqual(["lost", "lost"]);
});

test("a link that falls silent is dead", async () => {
  const it = job([
    async function* (_, signal) {
      yield happened(1n);
      await new Promise((_, reject) => signal.addEventListener("abort", () => reject(new Broken())));
    },
  ]);
  const run = it.run();
  await vi.advanceTimersByTimeAsync(silence - 1_000);
  expect(it.told).toEqual([]);
  await vi.advanceTimersByTimeAsync(60_000);
  await run;
  expect(it.told).toEqual(["lost"]);
  expect(it.opened).toEqual([0n, 1n]);
});

test("a server that lost events is read anew, one that says no is not asked again", async () => {
  const it = job([
    async function* () {
      throw new Ahead();
    },
    async function* () {
      throw new Error("deleted");
    },
  ]);
  const run = it.run();
  await vi.advanceTimersByTimeAsync(60_000);
  await run;
  expect(it.told).toEqual(["over", "refused"]);
  expect(it.opened.length).toBe(2);
});
