// The rest of the job as a tour: which stations, in which order, by whom; all that is left, or the best within some
// minutes or scans. Worked out by the server while somebody looks at it, and anew after each scan.
import { explain, isPassing, reason } from "../api/errors";
import { plans } from "../api/server";
import type { Tour, TourStop } from "../gen/vantage/v1/tour_pb";
import type { Key } from "../texts/texts.svelte";
import { silence } from "./follow";
import type { Job } from "./job.svelte";
import { search, type SearchTime } from "./search_time.svelte";
import type { Site } from "./site";
import { fleetOf, madeCount, notMade, wishOf, type Left } from "./tour_wish";

// How long a tour is searched, s; the first one comes much sooner.
const tourSeconds: Readonly<Record<SearchTime, number>> = { quick: 6, usual: 20, thorough: 90 };

const byReason: Record<string, Key> = {
  NOWHERE_TO_STAND: "tour.nowhere",
  TOO_MANY_TOURS: "tour.busy",
  TOO_MANY_EVALUATIONS: "tour.busy",
  MEMORY_SHORT: "tour.busy",
  PLAN_TOO_LARGE: "error.planTooLarge",
};

export class Tours {
  left = $state.raw<Left | undefined>(undefined);
  // All scanners of the fleet take part, or this tablet's alone.
  everyone = $state(true);
  tour = $state.raw<Tour | undefined>(undefined);
  // For whom it was made, by resource name, in the order of its letters; one or none: for one scanner.
  scanners = $state.raw<readonly string[]>([]);
  searching = $state(false);
  // When the search that goes on began, ms since 1970.
  began = $state(0);
  // How long it goes on at most, s.
  budget = $state(0);
  problem = $state.raw<{ key: Key; detail: string } | undefined>(undefined);
  // Until when there is time, ms since 1970; of minutes alone.
  until = $state<number | undefined>(undefined);
  // Nothing is left of the minutes or scans.
  over = $state(false);
  #job: Job;
  #scansBefore = 0;
  // What the site was like when the tour was last asked for.
  #asked = "";
  // Of how many parts of the page.
  #looking = 0;
  #running: AbortController | undefined;

  // What is still to be done of it, in its order.
  readonly stops = $derived.by<TourStop[]>(() =>
    this.tour === undefined || this.#job.site === undefined ? [] : notMade(this.tour.stops, this.#job.site),
  );

  // There is something to plan by: a scan, or a plan of the building.
  get possible(): boolean {
    return this.#job.hasModel || this.#job.site?.prior !== undefined;
  }

  constructor(job: Job) {
    this.#job = job;
  }

  // Somebody says what is left.
  choose(left: Left): void {
    this.left = left;
    this.until = left.of === "minutes" ? Date.now() + 60_000 * left.minutes : undefined;
    this.#scansBefore = this.#job.site === undefined ? 0 : madeCount(this.#job.site);
    this.tour = undefined;
    void this.#search();
  }

  again(): void {
    void this.#search();
  }

  // Ends the search; what was found stays.
  cancel(): void {
    if (this.#running === undefined) return;
    this.#running.abort();
    this.#running = undefined;
    this.searching = false;
    this.#job.tourEnded();
  }

  // Somebody looks at the tour, until what is returned is called: then the search ends.
  look(): () => void {
    this.#looking += 1;
    this.attend();
    return () => {
      this.#looking -= 1;
      if (this.#looking === 0) this.cancel();
    };
  }

  // The page is hidden, or the job is left: the search goes on, from the start, when somebody looks again.
  pause(): void {
    if (this.searching) this.#asked = "";
    this.cancel();
  }

  // While somebody looks: after a scan, or what else plans depend on, the rest is planned anew.
  attend(): void {
    if (this.#looking === 0 || this.left === undefined || this.problem !== undefined || this.over || !this.possible)
      return;
    if (this.#job.link !== "live" || document.hidden || this.#job.planning) return;
    const unanswered = this.tour === undefined && !this.searching;
    if (unanswered || this.#asked !== this.#now()) void this.#search();
  }

  #now(): string {
    return `${this.#job.site?.modelVersion} ${this.#job.site?.changed}`;
  }

  // What is left now of what was left when somebody said it.
  #rest(site: Site): Left | undefined {
    const left = this.left;
    if (left?.of === "minutes") {
      const minutes = ((this.until ?? 0) - Date.now()) / 60_000;
      return minutes > 0.5 ? { of: "minutes", minutes } : undefined;
    }
    if (left?.of === "scans") {
      const scans = left.scans - (madeCount(site) - this.#scansBefore);
      return scans > 0 ? { of: "scans", scans } : undefined;
    }
    return left;
  }

  async #search(): Promise<void> {
    const site = this.#job.site;
    if (site === undefined) return;
    this.problem = undefined;
    const rest = this.#rest(site);
    this.over = rest === undefined;
    if (rest === undefined) {
      this.cancel();
      this.tour = undefined;
      return;
    }
    this.#running?.abort();
    const running = new AbortController();
    this.#running = running;
    this.searching = true;
    this.#job.tourBegins();
    this.#asked = this.#now();
    this.began = Date.now();
    this.budget = tourSeconds[search.time];
    const scanners = this.everyone ? fleetOf(site) : this.#job.scanner === "" ? [] : [this.#job.scanner];
    const wish = wishOf(rest, scanners, this.budget, this.stops);
    // The server speaks every 15 s; a stream that is silent for longer is dead.
    const attempt = new AbortController();
    running.signal.addEventListener("abort", () => attempt.abort());
    let timer = setTimeout(() => attempt.abort(), silence);
    try {
      for await (const response of plans.createTour({ parent: this.#job.name, wish }, { signal: attempt.signal })) {
        clearTimeout(timer);
        timer = setTimeout(() => attempt.abort(), silence);
        if (running.signal.aborted) return;
        if (response.step.case === "tour") {
          this.tour = response.step.value;
          this.scanners = scanners;
        }
        if (response.last) break;
      }
    } catch (error) {
      if (running.signal.aborted) return;
      const known = byReason[reason(error)];
      this.problem =
        known !== undefined
          ? { key: known, detail: "" }
          : isPassing(error)
            ? { key: "tour.lost", detail: "" }
            : explain(error);
    } finally {
      clearTimeout(timer);
      if (this.#running === running) {
        this.#running = undefined;
        this.searching = false;
        this.#job.tourEnded();
      }
    }
  }
}
