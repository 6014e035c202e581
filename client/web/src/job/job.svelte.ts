// The job that is open on this tablet: the site as it is known, the link to the server, the plan, and
// what this tablet did.
import { create } from "@bufbuild/protobuf";
import { Code, ConnectError } from "@connectrpc/connect";
import { explain, isPassing } from "../api/errors";
import { fleet, lastPart, models, newRequestId, patience, plans, scans, sessions } from "../api/server";
import { PlanState, type Plan, type RankedView } from "../gen/vantage/v1/plan_pb";
import { Vector3Schema } from "../gen/vantage/v1/geometry_pb";
import type { GetCoverageResponse } from "../gen/vantage/v1/model_service_pb";
import type { PoseGraph } from "../gen/vantage/v1/pose_graph_pb";
import type { SitePrior } from "../gen/vantage/v1/site_prior_pb";
import { UploadState } from "../gen/vantage/v1/upload_pb";
import { send, type Kind, type Payloads, type Place } from "./actions";
import { ExistingPlan } from "./existing_plan.svelte";
import { follow, pause } from "./follow";
import { FollowedRoute } from "./followed_route.svelte";
import { freeViews } from "./free_views";
import { Outbox, type Entry } from "./outbox";
import {
  apply,
  changedByLists,
  freshPlan,
  lastStation,
  merged,
  serves,
  stationNumber,
  underWay,
  withoutExpired,
  type Site,
} from "./site";
import { crc32c } from "../send/crc32c";
import { notices } from "./notices.svelte";
import { search } from "./search_time.svelte";
import { Tours } from "./tours.svelte";

const pageSize = 1000;

export type LinkState = "connecting" | "live" | "lost" | "gone" | "unknownTablet";

function kept(session: string, what: string): string {
  return `vantage.${what}.${session}`;
}

// Stops of a route, told apart by a short name.
function named(stops: readonly Place[]): string {
  return crc32c(new TextEncoder().encode(JSON.stringify(stops))).toString(16);
}

export class Job {
  readonly name: string;
  site = $state.raw<Site | undefined>(undefined);
  link = $state<LinkState>("connecting");
  // When the server was last heard, ms since 1970.
  heard = $state(0);
  waiting = $state.raw<readonly Entry[]>([]);
  // The scanner that this tablet is with, by resource name; empty: none in particular.
  scanner = $state("");
  plan = $state.raw<Plan | undefined>(undefined);
  #creating = $state(false);
  #watchedPlan = $state("");
  // A plan is being asked for, or runs.
  readonly planning = $derived(this.#creating || this.#watchedPlan !== "");
  coverage = $state.raw<GetCoverageResponse | undefined>(undefined);
  // What ties the scans to each other.
  graph = $state.raw<PoseGraph | undefined>(undefined);
  // Which of the plan's views is shown, from 0.
  rank = $state(0);
  // What was known of the site before, and the rest of the job as a tour.
  readonly existing: ExistingPlan;
  readonly tours: Tours;
  readonly route: FollowedRoute;

  readonly last = $derived(this.site === undefined ? undefined : lastStation(this.site, this.scanner));
  readonly hasModel = $derived(this.site !== undefined && merged(this.site).length > 0);
  // The plan was made before something happened that it depends on.
  readonly stale = $derived.by(
    () =>
      this.site !== undefined &&
      this.plan !== undefined &&
      freshPlan(this.site, this.scanner, this.route.ahead)?.name !== this.plan.name,
  );
  readonly claim = $derived(this.site?.claims.find((claim) => this.scanner !== "" && claim.scanner === this.scanner));
  // Without what is taken, of which the plan may not know yet: so the next choice is there at once, also without a
  // connection.
  readonly views = $derived<RankedView[]>(
    this.site === undefined ? [] : freeViews(this.plan?.result?.views ?? [], this.site, this.scanner, this.waiting),
  );
  // What is shown is the place that this scanner has reserved.
  readonly targetIsKept = $derived(this.#claimedView() !== undefined);
  // Where to go: what this scanner has reserved, where the plan ranks it, else the view that is shown.
  readonly target = $derived<RankedView | undefined>(
    this.#claimedView() ?? this.views[Math.min(this.rank, this.views.length - 1)],
  );

  #outbox: Outbox;
  #running = new AbortController();
  #watching: AbortController | undefined;
  #measured = new Set<string>();
  #failures = 0;
  #results = new Map<string, Promise<string>>();
  #clock: ReturnType<typeof setInterval> | undefined;
  #onVisibility = () => {
    if (document.hidden) this.#stop();
    else this.#start();
  };

  constructor(name: string) {
    this.name = name;
    this.existing = new ExistingPlan(this);
    this.tours = new Tours(this);
    this.route = new FollowedRoute(this, kept(name, "route"));
    this.scanner = localStorage.getItem(kept(name, "scanner")) ?? "";
    const key = kept(name, "outbox");
    this.#outbox = new Outbox(
      {
        read: () => JSON.parse(localStorage.getItem(key) ?? "[]") as Entry[],
        write: (entries) => localStorage.setItem(key, JSON.stringify(entries)),
      },
      async (entry) => {
        const result = send(entry);
        result.catch(() => undefined);
        this.#results.set(entry.id, result);
        await result;
      },
      {
        changed: (entries) => (this.waiting = entries),
        refused: (entry, error) => notices.refused(entry, error, this),
        unknown: () => {
          this.link = "unknownTablet";
          this.#stop();
        },
      },
    );
    this.waiting = this.#outbox.entries;
  }

  open(): void {
    document.addEventListener("visibilitychange", this.#onVisibility);
    if (!document.hidden) this.#start();
  }

  close(): void {
    document.removeEventListener("visibilitychange", this.#onVisibility);
    this.#stop();
  }

  // What people call a scan.
  stationName(name: string): string {
    const number = this.site === undefined ? 0 : stationNumber(this.site, name);
    return number > 0 ? String(number) : lastPart(name);
  }

  scannerName(name: string): string {
    const scanner = this.site?.scanners.find((other) => other.name === name);
    return scanner?.displayName || (name === "" ? "" : lastPart(name));
  }

  chooseScanner(name: string): void {
    this.scanner = name;
    localStorage.setItem(kept(this.name, "scanner"), name);
    this.plan = undefined;
    this.rank = 0;
    this.#attend();
  }

  // Keeps and sends what a person did; returns its id, by which it can be undone.
  act<K extends Kind>(kind: K, payload: Payloads[K]): string {
    const entry: Entry = { id: newRequestId(), session: this.name, kind, payload, time: Date.now() };
    if (!this.#outbox.add(entry)) notices.say("outbox.full");
    return entry.id;
  }

  // Undoes an action: takes it out of the outbox, or, where the server has it already, does `reverse` with
  // the name of what came of it.
  async undo(id: string, reverse: (name: string) => void): Promise<void> {
    if (this.#outbox.takeBack(id)) return;
    const name = await this.#results.get(id)?.catch(() => "");
    if (name) reverse(name);
  }

  // The name of what came of an action, once the server has done it.
  result(id: string): Promise<string> | undefined {
    return this.#results.get(id);
  }

  // Shows another of the plan's views.
  showRank(rank: number): void {
    this.rank = Math.max(0, Math.min(rank, this.views.length - 1));
    this.measure(this.target);
  }

  // Somebody looks at a view: where the plan ended without knowing what it brings, it is asked for.
  measure(view: RankedView | undefined): void {
    if (this.plan !== undefined && !this.planning) void this.#measure(this.plan, view);
  }

  // Plans anew although nothing has changed.
  planAgain(): void {
    void this.#createPlan(newRequestId());
  }

  // A prior was set or taken out by this tablet, before the event is heard.
  knowPrior(prior: SitePrior | undefined): void {
    if (this.site !== undefined) this.site = { ...this.site, prior };
  }

  // A tour takes the plan's stream, so that a page has two at most. The plan goes on on the server.
  tourBegins(): void {
    this.#watching?.abort();
  }

  // Somebody wants the next place to be of the tour that is shown, or no longer does.
  followTour(wanted: boolean): void {
    if (wanted) this.route.begin(this.tours);
    else this.route.end();
    this.rank = 0;
    this.#attend();
  }

  tourEnded(): void {
    this.route.renew(this.tours);
    if (!this.#running.signal.aborted) this.#attend();
  }

  async refreshCoverage(): Promise<void> {
    void this.#refreshGraph();
    void this.existing.refresh();
    try {
      this.coverage = await models.getCoverage({ name: this.name }, { timeoutMs: patience });
    } catch {
      // The link's state says it; asked again with the next change.
    }
  }

  async #refreshGraph(): Promise<void> {
    try {
      this.graph = (await models.getPoseGraph({ name: this.name }, { timeoutMs: patience })).graph;
    } catch {
      // An earlier release of the server knows none; then none is shown.
      this.graph = undefined;
    }
  }

  #claimedView(): RankedView | undefined {
    const claimed = this.claim?.position;
    if (claimed === undefined) return undefined;
    return this.views.find(
      (view) =>
        view.position !== undefined && Math.hypot(view.position.x - claimed.x, view.position.y - claimed.y) < 0.05,
    );
  }

  #start(): void {
    this.#running.abort();
    this.#running = new AbortController();
    const { signal } = this.#running;
    this.link = this.site === undefined ? "connecting" : this.link;
    clearInterval(this.#clock);
    this.#clock = setInterval(() => {
      if (this.site !== undefined) this.site = withoutExpired(this.site, Date.now() / 1000);
    }, 10_000);
    void this.#outbox.flush();
    this.tours.attend();
    this.existing.attend();
    void this.#run(signal);
  }

  #stop(): void {
    clearInterval(this.#clock);
    this.#running.abort();
    this.tours.pause();
    this.existing.pause();
    this.#watching?.abort();
    this.#watchedPlan = "";
  }

  async #run(signal: AbortSignal): Promise<void> {
    for (let wait = 500; this.site === undefined; wait = Math.min(8000, 2 * wait)) {
      try {
        await this.#load();
        this.#hear();
      } catch (error) {
        if (signal.aborted) return;
        if (!isPassing(error)) return this.#refuse(error);
        this.link = "lost";
        await pause(wait, signal);
      }
      if (signal.aborted) return;
    }
    this.#attend();
    await follow(
      {
        open: (afterSequence, attempt) =>
          sessions.watchSession({ name: this.name, afterSequence }, { signal: attempt }),
        sequence: () => this.site?.sequence ?? 0n,
        isPassing,
        isAhead: (error) => ConnectError.from(error).code === Code.OutOfRange,
        startOver: () => this.#load(),
      },
      {
        heard: () => this.#hear(),
        event: (event) => {
          if (this.site === undefined) return;
          const before = this.site;
          this.site = apply(before, event);
          notices.happened(event, this);
          this.#attend();
          if (this.site.changed !== before.changed) void this.refreshCoverage();
        },
        lost: () => {
          if (!signal.aborted) this.link = "lost";
        },
        refused: (error) => this.#refuse(error),
      },
      signal,
    );
  }

  #hear(): void {
    if (this.link !== "live") {
      // A new link: what waits is sent, and what was missed of plans is asked for.
      this.link = "live";
      void this.#outbox.flush();
      this.#attend();
    }
    this.heard = Date.now();
  }

  #refuse(error: unknown): void {
    const code = ConnectError.from(error).code;
    this.link = code === Code.Unauthenticated || code === Code.PermissionDenied ? "unknownTablet" : "gone";
  }

  // The job as the server lists it. What happens meanwhile is heard again as events.
  async #load(): Promise<void> {
    const options = { timeoutMs: patience };
    const parent = this.name;
    const session = (await sessions.getSession({ name: parent }, options)).session;
    if (session === undefined) throw new Error("no session in the answer");
    const [scanList, scannerList, claimList, stationList, rejectionList, uploadList, running, coverage, prior] =
      await Promise.all([
        pages(async (pageToken) => {
          const page = await scans.listScans({ parent, pageSize, pageToken }, options);
          return [page.scans, page.nextPageToken];
        }),
        pages(async (pageToken) => {
          const page = await fleet.listScanners({ parent, pageSize, pageToken }, options);
          return [page.scanners, page.nextPageToken];
        }),
        pages(async (pageToken) => {
          const page = await fleet.listClaims({ parent, pageSize, pageToken }, options);
          return [page.claims, page.nextPageToken];
        }),
        pages(async (pageToken) => {
          const page = await fleet.listStations({ parent, pageSize, pageToken }, options);
          return [page.stations, page.nextPageToken];
        }),
        pages(async (pageToken) => {
          const page = await plans.listRejections({ parent, pageSize, pageToken }, options);
          return [page.rejections, page.nextPageToken];
        }),
        pages(async (pageToken) => {
          const states = [UploadState.OPEN, UploadState.READING, UploadState.FAILED];
          const page = await scans.listUploads({ parent, pageSize, pageToken, states }, options);
          return [page.uploads, page.nextPageToken];
        }),
        plans.listPlans({ parent, pageSize: 200, states: [PlanState.QUEUED, PlanState.RUNNING] }, options),
        models.getCoverage({ name: parent }, options),
        this.existing.read(),
      ]);
    this.coverage = coverage;
    void this.#refreshGraph();
    const known = new Map(running.plans.map((plan) => [plan.name, plan]));
    // The last plan that ended well, which is what somebody who opens the page wants to see.
    if (coverage.plan !== "" && !known.has(coverage.plan)) {
      const plan = (await plans.getPlan({ name: coverage.plan }, options)).plan;
      if (plan !== undefined) known.set(plan.name, plan);
    }
    const site = {
      session,
      scans: scanList,
      scanners: scannerList,
      claims: claimList,
      stations: stationList,
      rejections: rejectionList,
      uploads: uploadList,
      prior,
      plans: known,
      sequence: session.lastSequence,
      modelVersion: session.modelVersion,
    };
    this.site = { ...site, changed: changedByLists(site) };
    if (!scannerList.some((scanner) => scanner.name === this.scanner)) this.scanner = "";
    const shown = [...known.values()].filter((plan) => plan.result !== undefined && serves(plan, this.scanner)).at(-1);
    if (shown !== undefined) this.plan = shown;
  }

  // Sees to it that there is a plan for the site as it is, and shows it as it improves.
  #attend(): void {
    const site = this.site;
    if (site === undefined || this.link !== "live" || document.hidden || !this.hasModel) return;
    // The plan follows the tour; both at once would take twice as long.
    if (this.tours.searching) return;
    const fresh = freshPlan(site, this.scanner, this.route.ahead);
    if (fresh === undefined) {
      // A scan that is being merged changes the site in a moment.
      if (underWay(site).length > 0 && this.plan !== undefined) return;
      // Tablets that see the same site ask for the same plan.
      const followed = this.route.ahead.length === 0 ? "" : `-${named(this.route.ahead)}`;
      const asked = `${site.modelVersion}-${site.changed}-${search.seconds}-${lastPart(this.scanner)}${followed}`;
      void this.#createPlan(`page-${asked}`);
      return;
    }
    this.#show(fresh);
    const ended = ![PlanState.QUEUED, PlanState.RUNNING, PlanState.UNSPECIFIED].includes(fresh.state);
    if (!ended && this.#watchedPlan !== fresh.name) void this.#watchPlan(fresh.name);
  }

  async #createPlan(requestId: string): Promise<void> {
    // One after the other: what has changed meanwhile is attended to when it has ended.
    if (this.planning) return;
    this.#creating = true;
    const scanners = this.scanner === "" ? [] : [this.scanner];
    const changed = this.site?.changed ?? 0n;
    let withoutRoute = false;
    const tourStations = this.route.ahead.map((stop) => create(Vector3Schema, stop));
    const budget = { case: "timeBudget" as const, value: { seconds: BigInt(search.seconds), nanos: 0 } };
    try {
      const response = await plans.createPlan(
        { parent: this.name, requestId, plan: { scanners, budget, tourStations } },
        { timeoutMs: patience },
      );
      const plan = response.plan;
      if (plan === undefined) return;
      this.route.answered(tourStations.length, plan.tourStations.length);
      if (this.site !== undefined && !this.site.plans.has(plan.name)) {
        this.site = { ...this.site, plans: new Map(this.site.plans).set(plan.name, plan) };
      }
      this.#failures = 0;
      void this.#watchPlan(plan.name);
    } catch (error) {
      if (isPassing(error)) {
        // With the next sign of life.
        this.#failures += 1;
        setTimeout(() => this.#attend(), Math.min(15_000, 1000 * 2 ** this.#failures));
      } else if (tourStations.length > 0 && ConnectError.from(error).code === Code.InvalidArgument) {
        this.route.refused(changed);
        withoutRoute = true;
      } else {
        const { key, detail } = explain(error);
        notices.say(key, { detail });
      }
    } finally {
      this.#creating = false;
      if (withoutRoute) this.#attend();
    }
  }

  async #watchPlan(name: string): Promise<void> {
    // It is watched when the tour has ended.
    if (this.tours.searching) return;
    this.#watching?.abort();
    const watching = new AbortController();
    this.#watching = watching;
    this.#watchedPlan = name;
    try {
      for await (const response of plans.watchPlan({ name }, { signal: watching.signal })) {
        if (response.step.case === "plan") {
          const plan = response.step.value;
          if (this.site !== undefined) this.site = { ...this.site, plans: new Map(this.site.plans).set(name, plan) };
          this.#show(plan);
        }
        if (response.last) break;
      }
    } catch {
      // PlanEnded tells the end, too; a broken link is said by the job's own stream. Not again at once.
      await pause(1000, watching.signal);
    } finally {
      if (this.#watching === watching) {
        this.#watchedPlan = "";
        watching.abort();
        // Something may have happened that this plan does not know of.
        if (!this.#running.signal.aborted) this.#attend();
      }
    }
  }

  #show(plan: Plan): void {
    // A plan that has no answer yet does not take the place of one that has.
    const ended = ![PlanState.QUEUED, PlanState.RUNNING].includes(plan.state);
    const result = plan.result;
    const says = result !== undefined && (result.views.length > 0 || ended);
    if (!says && this.plan !== undefined && !(ended && plan.state === PlanState.FAILED)) return;
    if (plan.name !== this.plan?.name) this.rank = 0;
    this.plan = plan;
    if (ended) void this.#measure(plan, this.target);
  }

  // On a busy server a plan may end before it knows what a view brings; one that somebody looks at is then asked for
  // by itself.
  async #measure(plan: Plan, shown: RankedView | undefined): Promise<void> {
    const views = plan.result?.views ?? [];
    const index = shown === undefined ? -1 : views.indexOf(shown);
    const key = `${plan.name} ${index}`;
    if (
      plan.result === undefined ||
      shown?.position === undefined ||
      shown.exact ||
      index < 0 ||
      this.#measured.has(key)
    )
      return;
    this.#measured.add(key);
    try {
      const { position, headingRad } = shown;
      const answer = await plans.evaluateView(
        { parent: this.name, position, headingRad, scannerModelId: plan.scannerModelId },
        { timeoutMs: 2 * patience },
      );
      const current = this.plan;
      if (answer.view === undefined || current?.name !== plan.name || current.result === undefined) return;
      // How to find the place stays as the plan has it.
      const view = {
        ...answer.view,
        location: shown.location,
        region: shown.region,
        travelDistanceM: shown.travelDistanceM,
      };
      this.plan = {
        ...current,
        result: { ...current.result, views: current.result.views.map((other, i) => (i === index ? view : other)) },
      };
    } catch {
      // What is known of it is shown as it is.
    }
  }
}

async function pages<T>(page: (token: string) => Promise<[T[], string]>): Promise<T[]> {
  const all: T[] = [];
  let token = "";
  do {
    const [entries, next] = await page(token);
    all.push(...entries);
    token = next;
  } while (token !== "");
  return all;
}
