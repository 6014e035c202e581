// The rest of the job as a tour: which stations, in which order, by whom; all that is left, or the best within some
// minutes or scans. Worked out by the server while somebody looks at it, and anew after each scan.
import { create } from "@bufbuild/protobuf";
import { explain, isPassing, reason } from "../api/errors";
import { plans } from "../api/server";
import { Vector3Schema, type Vector3 } from "../gen/vantage/v1/geometry_pb";
import { TourWishSchema, type Tour, type TourStop, type TourWish } from "../gen/vantage/v1/tour_pb";
import type { Key } from "../texts/texts.svelte";
import { placeOf } from "./actions";
import { silence } from "./follow";
import type { Job } from "./job.svelte";
import { search, type SearchTime } from "./search_time.svelte";
import { merged, type Site } from "./site";

// What is left of the day, the battery or the cards.
export type Left = { of: "all" } | { of: "minutes"; minutes: number } | { of: "scans"; scans: number };

// How long a tour is searched, s; the first one comes much sooner.
const tourSeconds: Readonly<Record<SearchTime, number>> = { quick: 6, usual: 20, thorough: 90 };

// A scan as near as this to a stop is the stop's, m: nobody sets up a tripod better than by eye.
const sameStop = 0.8;

// Of a tour's stops those that nobody has made yet.
export function notMade(stops: readonly TourStop[], site: Site): TourStop[] {
  const made = [...merged(site).map((scan) => scan.pose?.translation), ...site.stations.map((s) => s.position)];
  const near = (a: Vector3, b: Vector3 | undefined) =>
    b !== undefined && Math.hypot(a.x - b.x, a.y - b.y) < sameStop && Math.abs(a.z - b.z) < 1.5;
  return stops.filter((stop) => stop.position !== undefined && !made.some((place) => near(stop.position!, place)));
}

// Scans that were made, also those whose data are to come.
export function madeCount(site: Site): number {
  return merged(site).length + site.stations.length;
}

// As the contract has it. `previous`: the stops that are left of the tour before; the contract takes them with a goal,
// and not with minutes or scans, where what fits in is another choice each time.
const mostPrevious = 1000;
export function wishOf(
  left: Left,
  scanners: readonly string[],
  seconds: number,
  previous: readonly TourStop[],
): TourWish {
  const duration = (s: number) => ({ seconds: BigInt(Math.round(s)), nanos: 0 });
  return create(TourWishSchema, {
    scanners: [...scanners],
    timeBudget: duration(seconds),
    availableDuration: left.of === "minutes" ? duration(Math.max(1, 60 * left.minutes)) : undefined,
    availableScanCount: left.of === "scans" ? left.scans : undefined,
    previousStations:
      left.of === "all"
        ? previous
            .slice(0, mostPrevious)
            .flatMap((stop) => (stop.position === undefined ? [] : [create(Vector3Schema, placeOf(stop.position))]))
        : [],
  });
}

// Of a fleet those that one tour is made for: all of one model, as many as the contract takes.
const mostScanners = 16;
export function fleetOf(site: Site): string[] {
  const model = site.scanners[0]?.scannerModelId;
  return site.scanners
    .filter((scanner) => scanner.scannerModelId === model)
    .slice(0, mostScanners)
    .map((scanner) => scanner.name);
}

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

  // While a tour is shown: after a scan, or what else plans depend on, the rest is planned anew.
  attend(): void {
    if (this.left === undefined || this.problem !== undefined || this.over || !this.possible) return;
    if (this.#job.link !== "live" || document.hidden || this.#job.planning || this.#asked === this.#now()) return;
    void this.#search();
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
        if (response.step.case === "tour") this.tour = response.step.value;
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
