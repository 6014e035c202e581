// What is known of the site before it is scanned, a plan or a model of the building (SitePrior): as the server has it
// and judges it, with its walls.
import { Code, ConnectError } from "@connectrpc/connect";
import { isPassing } from "../api/errors";
import { models, newRequestId, patience } from "../api/server";
import type { SitePrior, SitePriorPoint, SitePriorStanding } from "../gen/vantage/v1/site_prior_pb";
import type { Outline } from "../prior/outlines";
import { atSite, type PlacedWall } from "../prior/placement";
import type { Job } from "./job.svelte";

// Sending up to 3 MiB over a site's Wi-Fi, and reading it there, ms.
const sendingPatience = 180_000;

// The server may have no time or memory to compare it just now: it is asked again after so long, ms, and then each time
// after twice as long.
const firstWait = 2000;
const longestWait = 30_000;

export class ExistingPlan {
  standing = $state.raw<SitePriorStanding | undefined>(undefined);
  #job: Job;
  #unread = false;
  #wait = firstWait;
  #timer: ReturnType<typeof setTimeout> | undefined;
  // The page is shown.
  #attended = false;
  // Those of the prior that it stands for.
  #walls = $state.raw<PlacedWall[]>([]);
  readonly prior = $derived.by<SitePrior | undefined>(() => this.#job.site?.prior);

  constructor(job: Job) {
    this.#job = job;
  }

  // Those of a storey, of so many, m, world: none where it is known not to lie there.
  wallsOn(storey: { floor: number; top: number }, count: number): Outline[] {
    return this.#walls
      .filter(({ floor }) => count <= 1 || (floor >= storey.floor - 1 && floor < storey.top - 1))
      .map(({ outline }) => outline);
  }

  // The page is shown: what had no answer is asked again.
  attend(): void {
    this.#attended = true;
    if (this.#unread && this.#timer === undefined) void this.refresh();
  }

  pause(): void {
    this.#attended = false;
    clearTimeout(this.#timer);
    this.#timer = undefined;
  }

  // As the server has it. Undefined: there is none, the server knows no such call, or it has no answer yet, and is
  // asked again in a moment or with the next change, without a word.
  async read(): Promise<SitePrior | undefined> {
    clearTimeout(this.#timer);
    this.#timer = undefined;
    try {
      const answer = await models.getSitePrior({ parent: this.#job.name, withWalls: true }, { timeoutMs: patience });
      this.standing = answer.standing;
      this.#walls = atSite(answer);
      this.#unread = false;
      this.#wait = firstWait;
      return answer.sitePrior;
    } catch (error) {
      this.#unread = ![Code.NotFound, Code.Unimplemented].includes(ConnectError.from(error).code);
      if (this.#attended && isPassing(error)) {
        clearTimeout(this.#timer);
        this.#timer = setTimeout(() => void this.refresh(), this.#wait);
        this.#wait = Math.min(longestWait, 2 * this.#wait);
      }
      return undefined;
    }
  }

  // How it stands by the newest model.
  async refresh(): Promise<void> {
    if (this.prior === undefined && !this.#unread) {
      this.#forget();
      return;
    }
    const prior = await this.read();
    if (this.prior === undefined && prior !== undefined) this.#job.knowPrior(prior);
  }

  async set(
    what: { displayName: string; unitM: number; yUp: boolean; wallHeightM: number; darkest: number },
    points: SitePriorPoint[],
    file: Uint8Array<ArrayBuffer>,
  ): Promise<void> {
    const { sitePrior } = await models.setSitePrior(
      { parent: this.#job.name, sitePrior: { ...what, points }, file, requestId: newRequestId() },
      { timeoutMs: sendingPatience },
    );
    if (sitePrior === undefined) return;
    this.#job.knowPrior(sitePrior);
    await this.refresh();
  }

  async clear(): Promise<void> {
    await models.clearSitePrior({ parent: this.#job.name, requestId: newRequestId() }, { timeoutMs: patience });
    this.#job.knowPrior(undefined);
    this.#forget();
  }

  #forget(): void {
    this.standing = undefined;
    this.#walls = [];
  }
}
