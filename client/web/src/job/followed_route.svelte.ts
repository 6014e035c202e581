// The route that the next place follows, where somebody on this tablet chose that: the stops of a tour for one scanner,
// kept for the job.
import { placeOf, type Place } from "./actions";
import { hindrance, readStops, stopsAhead, type Hindrance } from "./followed_stops";
import type { Job } from "./job.svelte";
import type { Tours } from "./tours.svelte";

export class FollowedRoute {
  #job: Job;
  #key: string;
  #stops = $state.raw<readonly Place[] | undefined>(undefined);
  // The server is an earlier release that follows none.
  #unknown = $state(false);
  // Site.changed of the site for which the server did not take it.
  #refusedFor = $state<bigint | undefined>(undefined);
  // Somebody wants it to be followed.
  readonly on = $derived(this.#stops !== undefined && !this.#unknown);
  readonly hindrance = $derived.by<Hindrance | undefined>(() => {
    const site = this.#job.site;
    if (site === undefined) return undefined;
    return hindrance(site, this.#job.scanner) ?? (this.#refusedFor === site.changed ? "refused" : undefined);
  });
  // What of it the next plan is asked to follow; none: it is made without.
  readonly ahead = $derived.by<Place[]>(() =>
    !this.on || this.#stops === undefined || this.#job.site === undefined || this.hindrance !== undefined
      ? []
      : stopsAhead(this.#stops, this.#job.site),
  );

  constructor(job: Job, key: string) {
    this.#job = job;
    this.#key = key;
    this.#stops = readStops(localStorage.getItem(key));
  }

  // A tour of several scanners is each scanner's own.
  possible(tours: Tours): boolean {
    return !this.#unknown && tours.scanners.length <= 1 && tours.stops.length > 0 && this.#job.scanner === "";
  }

  begin(tours: Tours): void {
    this.#keep(tours.stops.flatMap(({ position }) => (position === undefined ? [] : [placeOf(position)])));
  }

  end(): void {
    this.#keep(undefined);
  }

  // The tour was worked out anew: what is followed is the one that is shown.
  renew(tours: Tours): void {
    if (this.#stops === undefined || tours.tour === undefined) return;
    if (tours.scanners.length > 1) this.end();
    else this.begin(tours);
  }

  // What a plan was made with that was asked to follow so many stops.
  answered(asked: number, taken: number): void {
    if (asked > 0 && taken === 0) this.#unknown = true;
  }

  // No plan was made with it for this state of the site: another may have made a scan, of which this tablet had not heard.
  refused(changed: bigint): void {
    this.#refusedFor = changed;
  }

  #keep(stops: readonly Place[] | undefined): void {
    this.#stops = stops;
    try {
      if (stops === undefined) localStorage.removeItem(this.#key);
      else localStorage.setItem(this.#key, JSON.stringify(stops));
    } catch {
      // The storage is full: it is followed until the page is closed.
    }
  }
}
