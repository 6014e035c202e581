// What is known of the site before it is scanned, a plan or a model of the building (SitePrior): as the server has it
// and judges it, and the lines of its walls, which the tablet that sent it keeps.
import { Code, ConnectError } from "@connectrpc/connect";
import { isPassing } from "../api/errors";
import { models, newRequestId, patience } from "../api/server";
import type { SitePrior, SitePriorPoint, SitePriorStanding } from "../gen/vantage/v1/site_prior_pb";
import type { Outline } from "../prior/outlines";
import { atSite } from "../prior/placement";
import type { Job } from "./job.svelte";
import { nanoseconds } from "./site";

// Sending up to 3 MiB over a site's Wi-Fi, and reading it there, ms.
const sendingPatience = 180_000;

// The server may have no time or memory to compare it just now: it is asked again after so long, ms, and then each time
// after twice as long.
const firstWait = 2000;
const longestWait = 30_000;

const prefix = "vantage.existing.";

// What waits to be sent needs the tablet's storage more: the walls of other jobs go where they would take more than
// this together, characters.
const mostKept = 1_000_000;
function makeRoom(key: string, length: number): void {
  const others = Object.keys(localStorage).filter((other) => other.startsWith(prefix) && other !== key);
  let sum = length;
  for (const other of others) {
    sum += localStorage.getItem(other)?.length ?? 0;
    if (sum > mostKept) localStorage.removeItem(other);
  }
}

interface Kept {
  // SitePrior.createTime: of which prior these are the walls; ns since 1970.
  made: string;
  outlines: Outline[];
}

export class ExistingPlan {
  standing = $state.raw<SitePriorStanding | undefined>(undefined);
  #job: Job;
  #unread = false;
  #wait = firstWait;
  #timer: ReturnType<typeof setTimeout> | undefined;
  // The page is shown.
  #attended = false;
  #kept = $state.raw<Kept | undefined>(undefined);
  readonly prior = $derived.by<SitePrior | undefined>(() => this.#job.site?.prior);
  // The walls are known on this tablet.
  readonly drawn = $derived.by(() => this.#outlines().length > 0);
  // Its walls at the site, m, world; none where it is known not to lie there.
  readonly #walls = $derived.by<Outline[]>(() =>
    this.prior === undefined ? [] : atSite(this.prior, this.standing, this.#outlines()),
  );

  constructor(job: Job) {
    this.#job = job;
    try {
      this.#kept = JSON.parse(localStorage.getItem(this.#key) ?? "null") ?? undefined;
    } catch {
      // Another release's; then they are not drawn.
    }
  }

  // Those of a storey, of so many: a plan is of the one whose floor it was placed on.
  wallsOn(storey: { floor: number; top: number }, count: number): Outline[] {
    const floor = this.prior?.points[0]?.site?.z ?? 0;
    return count <= 1 || (floor >= storey.floor - 1 && floor < storey.top - 1) ? this.#walls : [];
  }

  get #key(): string {
    return `${prefix}${this.#job.name}`;
  }

  #outlines(): readonly Outline[] {
    const made = nanoseconds(this.prior?.createTime).toString();
    return this.#kept?.made === made ? this.#kept.outlines : [];
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
      const answer = await models.getSitePrior({ parent: this.#job.name }, { timeoutMs: patience });
      this.standing = answer.standing;
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
      this.standing = undefined;
      return;
    }
    const prior = await this.read();
    if (this.prior === undefined && prior !== undefined) this.#job.knowPrior(prior);
  }

  async set(
    what: { displayName: string; unitM: number; yUp: boolean; wallHeightM: number; darkest: number },
    points: SitePriorPoint[],
    file: Uint8Array<ArrayBuffer>,
    outlines: readonly Outline[],
  ): Promise<void> {
    const { sitePrior } = await models.setSitePrior(
      { parent: this.#job.name, sitePrior: { ...what, points }, file, requestId: newRequestId() },
      { timeoutMs: sendingPatience },
    );
    if (sitePrior === undefined) return;
    this.keep(sitePrior, outlines);
    this.#job.knowPrior(sitePrior);
    await this.refresh();
  }

  // Its walls, as this tablet read them from the same file.
  keep(prior: SitePrior, outlines: readonly Outline[]): void {
    // Four digits tell a place to a centimetre, in a building of a hundred metres.
    const most = Math.max(1e-9, ...outlines.flat().map(({ x, y }) => Math.max(Math.abs(x), Math.abs(y))));
    const digits = Math.min(9, Math.max(0, 4 - Math.floor(Math.log10(most))));
    const round = (value: number) => Number(value.toFixed(digits));
    const kept = {
      made: nanoseconds(prior.createTime).toString(),
      outlines: outlines.map((outline) => outline.map(({ x, y }) => ({ x: round(x), y: round(y) }))),
    };
    this.#kept = kept;
    const text = JSON.stringify(kept);
    makeRoom(this.#key, text.length);
    try {
      localStorage.setItem(this.#key, text);
    } catch {
      // The storage is full: they are drawn until the page is closed.
    }
  }

  async clear(): Promise<void> {
    await models.clearSitePrior({ parent: this.#job.name, requestId: newRequestId() }, { timeoutMs: patience });
    localStorage.removeItem(this.#key);
    this.#job.knowPrior(undefined);
    this.standing = undefined;
  }
}
