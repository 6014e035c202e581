import { create } from "@bufbuild/protobuf";
import { Code, ConnectError } from "@connectrpc/connect";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { ErrorInfoSchema, RetryInfoSchema } from "../../src/gen/google/rpc/error_details_pb";
import { GetSitePriorResponseSchema, SitePriorState } from "../../src/gen/vantage/v1/site_prior_pb";
import { ExistingPlan } from "../../src/job/existing_plan.svelte";
import type { Job } from "../../src/job/job.svelte";

const getSitePrior = vi.hoisted(() => vi.fn());
vi.mock("../../src/api/server", () => ({ models: { getSitePrior }, newRequestId: () => "", patience: 1 }));

const busy = (reason: string) =>
  new ConnectError("", Code.ResourceExhausted, undefined, [
    { desc: ErrorInfoSchema, value: { reason } },
    { desc: RetryInfoSchema, value: { retryDelay: { seconds: 1n } } },
  ]);
const answer = create(GetSitePriorResponseSchema, {
  sitePrior: { displayName: "flat.png" },
  standing: { state: SitePriorState.ALIGNED },
});

// The part of a job that a plan of the building is for.
function job() {
  const known: string[] = [];
  const site = { prior: undefined };
  const made = {
    name: "sessions/s",
    site,
    knowPrior: (prior: { displayName: string }) => known.push(prior.displayName),
  };
  return { known, job: made as unknown as Job };
}

beforeEach(() => {
  vi.useFakeTimers();
  getSitePrior.mockReset();
});
afterEach(() => vi.useRealTimers());

test("a server that has no time or memory to compare it is asked again, quietly", async () => {
  const of = job();
  const existing = new ExistingPlan(of.job);
  existing.attend();
  expect(getSitePrior).not.toHaveBeenCalled();
  getSitePrior.mockRejectedValueOnce(busy("MEMORY_SHORT")).mockRejectedValueOnce(busy("TOO_MANY_EVALUATIONS"));
  getSitePrior.mockResolvedValue(answer);
  expect(await existing.read()).toBeUndefined();
  await vi.advanceTimersByTimeAsync(1900);
  expect(getSitePrior).toHaveBeenCalledTimes(1);
  await vi.advanceTimersByTimeAsync(200);
  expect(getSitePrior).toHaveBeenCalledTimes(2);
  await vi.advanceTimersByTimeAsync(3800);
  expect(getSitePrior).toHaveBeenCalledTimes(2);
  await vi.advanceTimersByTimeAsync(200);
  expect(getSitePrior).toHaveBeenCalledTimes(3);
  expect(existing.standing?.state).toBe(SitePriorState.ALIGNED);
  expect(of.known).toEqual(["flat.png"]);
  await vi.advanceTimersByTimeAsync(100_000);
  expect(getSitePrior).toHaveBeenCalledTimes(3);
});

test("nothing is asked while the page is hidden, nor where there is none", async () => {
  const existing = new ExistingPlan(job().job);
  existing.attend();
  getSitePrior.mockRejectedValueOnce(busy("MEMORY_SHORT"));
  await existing.read();
  existing.pause();
  await vi.advanceTimersByTimeAsync(100_000);
  expect(getSitePrior).toHaveBeenCalledTimes(1);
  getSitePrior.mockRejectedValue(new ConnectError("", Code.NotFound));
  existing.attend();
  await vi.advanceTimersByTimeAsync(100_000);
  expect(getSitePrior).toHaveBeenCalledTimes(2);
});

test("its walls are drawn on any tablet, each on the storey that it stands on, and gone with it", async () => {
  const of = job();
  const existing = new ExistingPlan(of.job);
  const corners = (z: number) => [
    { x: 0, y: 0, z },
    { x: 4, y: 0, z },
  ];
  getSitePrior.mockResolvedValueOnce(
    create(GetSitePriorResponseSchema, {
      sitePrior: { displayName: "house.obj" },
      standing: { state: SitePriorState.ALIGNED },
      walls: [{ corners: corners(-1.4) }, { corners: corners(1.5) }],
    }),
  );
  await existing.read();
  expect(getSitePrior).toHaveBeenCalledWith({ parent: "sessions/s", withWalls: true }, expect.anything());
  expect(existing.wallsOn({ floor: -1.5, top: 1.2 }, 2).length).toBe(1);
  expect(existing.wallsOn({ floor: 1.4, top: 4 }, 2).length).toBe(1);
  expect(existing.wallsOn({ floor: 4.5, top: 7 }, 3)).toEqual([]);
  expect(existing.wallsOn({ floor: -1.5, top: 1.2 }, 1).length).toBe(2);
  // Where it is known not to lie there the server tells none.
  getSitePrior.mockResolvedValueOnce(
    create(GetSitePriorResponseSchema, { standing: { state: SitePriorState.NOT_ALIGNED } }),
  );
  await existing.read();
  expect(existing.wallsOn({ floor: -1.5, top: 1.2 }, 1)).toEqual([]);
});
