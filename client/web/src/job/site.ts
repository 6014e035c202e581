// What is known of a job, folded from what the server lists and then from its events. Pure: a fold
// gives a new value, and the same events in a row give the same site however often they were heard.
import type { Timestamp } from "@bufbuild/protobuf/wkt";
import type { SessionEvent } from "../gen/vantage/v1/event_pb";
import type { Claim, Scanner, Station } from "../gen/vantage/v1/fleet_pb";
import type { Plan } from "../gen/vantage/v1/plan_pb";
import { ScanState, type Scan } from "../gen/vantage/v1/scan_pb";
import type { Rejection, Session } from "../gen/vantage/v1/session_pb";
import type { SitePrior } from "../gen/vantage/v1/site_prior_pb";
import { UploadState, type Upload } from "../gen/vantage/v1/upload_pb";
import type { Place } from "./actions";

export interface Site {
  session: Session;
  // In the order in which they arrived.
  scans: Scan[];
  scanners: Scanner[];
  claims: Claim[];
  stations: Station[];
  rejections: Rejection[];
  // Those that are open, being read, or failed.
  uploads: Upload[];
  // What is known of the site besides the scans.
  prior: SitePrior | undefined;
  // Plans that were heard of, by name.
  plans: Map<string, Plan>;
  // Of the last event that is in here.
  sequence: bigint;
  // Version of the model.
  modelVersion: bigint;
  // When something last changed that a plan depends on, the server's time, ns since 1970: a plan that
  // was created before does not know of it.
  changed: bigint;
}

export function nanoseconds(time: Timestamp | undefined): bigint {
  return time === undefined ? 0n : time.seconds * 1_000_000_000n + BigInt(time.nanos);
}

export function seconds(time: Timestamp | undefined): number {
  return time === undefined ? 0 : Number(time.seconds) + time.nanos / 1e9;
}

function put<T extends { name: string }>(list: T[], entry: T | undefined): T[] {
  if (entry === undefined) return list;
  const at = list.findIndex((other) => other.name === entry.name);
  return at < 0 ? [...list, entry] : list.map((other, i) => (i === at ? entry : other));
}

function drop<T extends { name: string }>(list: T[], name: string | undefined): T[] {
  return list.filter((entry) => entry.name !== name);
}

const keptPlans = 32;

function putPlan(plans: Map<string, Plan>, plan: Plan | undefined): Map<string, Plan> {
  if (plan === undefined) return plans;
  const next = new Map(plans);
  next.delete(plan.name);
  next.set(plan.name, plan);
  // Old ones are asked for again where somebody wants them.
  for (const name of next.keys()) {
    if (next.size <= keptPlans) break;
    next.delete(name);
  }
  return next;
}

// The last change that plans depend on, as the lists tell it.
export function changedByLists(site: Omit<Site, "changed">): bigint {
  const times = [
    ...site.scans.filter((scan) => scan.merge !== undefined).map((scan) => scan.updateTime),
    ...site.stations.map((station) => station.createTime),
    ...site.rejections.map((rejection) => rejection.createTime),
    ...site.claims.map((claim) => claim.createTime),
    site.prior?.createTime,
  ].map(nanoseconds);
  return times.reduce((latest, time) => (time > latest ? time : latest), 0n);
}

export function apply(site: Site, happened: SessionEvent): Site {
  if (happened.sequence <= site.sequence) return site;
  const next: Site = { ...site, sequence: happened.sequence };
  const event = happened.event;
  switch (event.case) {
    case "sessionCreated":
    case "sessionUpdated":
      // Events leave out what only GetSession fills in.
      if (event.value.session !== undefined) next.session = event.value.session;
      break;
    case "scanReceived":
    case "scanReplaced":
    case "scanRegistered":
    case "scanRefused":
    case "scanAccepted":
    case "scanPoseSet":
    case "scanMerged":
    case "scanWithdrawn":
    case "scanRemoved": {
      const scan = event.value.scan;
      next.scans = put(site.scans, scan);
      // A file becomes several; its upload ends by itself.
      if (event.case === "scanReceived" && scan?.fileSetup === 0) next.uploads = drop(site.uploads, scan.upload);
      if (event.case === "scanMerged" && scan?.merge !== undefined) next.modelVersion = scan.merge.modelVersion;
      if (event.case === "scanRemoved") next.modelVersion = event.value.modelVersion;
      break;
    }
    case "posesAdjusted": {
      const moved = new Map(event.value.poses.map((adjusted) => [adjusted.scan, adjusted.pose]));
      next.scans = site.scans.map((scan) => {
        const pose = moved.get(scan.name);
        return pose === undefined ? scan : { ...scan, pose };
      });
      next.modelVersion = event.value.modelVersion;
      break;
    }
    case "planCreated":
    case "planEnded":
      next.plans = putPlan(site.plans, event.value.plan);
      break;
    case "planDeleted":
      next.plans = new Map([...site.plans].filter(([name]) => name !== event.value.plan));
      break;
    case "viewRejected":
      next.rejections = put(site.rejections, event.value.rejection);
      break;
    case "rejectionDeleted":
      next.rejections = drop(site.rejections, event.value.rejection?.name);
      break;
    case "claimTaken":
    case "claimRenewed":
      next.claims = put(site.claims, event.value.claim);
      break;
    case "claimEnded":
      next.claims = drop(site.claims, event.value.claim?.name);
      break;
    case "uploadCreated":
    case "uploadReceived":
      next.uploads = put(site.uploads, event.value.upload);
      break;
    case "uploadEnded":
      next.uploads =
        event.value.upload?.state === UploadState.FAILED
          ? put(site.uploads, event.value.upload)
          : drop(site.uploads, event.value.upload?.name);
      break;
    case "scannerCreated":
    case "scannerUpdated":
      next.scanners = put(site.scanners, event.value.scanner);
      break;
    case "scannerDeleted":
      next.scanners = drop(site.scanners, event.value.scanner?.name);
      break;
    case "stationCreated":
      next.stations = put(site.stations, event.value.station);
      break;
    case "stationEnded":
      next.stations = drop(site.stations, event.value.station?.name);
      break;
    case "sitePriorSet":
      next.prior = event.value.sitePrior;
      break;
    case "sitePriorCleared":
      next.prior = undefined;
      break;
    case "eventsLeftOut":
    case undefined:
      break;
  }
  const concernsPlans = [
    "scanMerged",
    "scanRemoved",
    "posesAdjusted",
    "sessionUpdated",
    "viewRejected",
    "rejectionDeleted",
    "claimTaken",
    "claimEnded",
    "stationCreated",
    "stationEnded",
    "sitePriorSet",
    "sitePriorCleared",
  ];
  if (event.case !== undefined && concernsPlans.includes(event.case)) {
    const time = nanoseconds(happened.time);
    if (time > next.changed) next.changed = time;
  }
  return next;
}

// Claims and refusals end by themselves, at a time and without an event that is heard at once.
export function withoutExpired(site: Site, now: number): Site {
  const lasts = (entry: Claim | Rejection) => entry.expireTime === undefined || seconds(entry.expireTime) > now;
  if (site.claims.every(lasts) && site.rejections.every(lasts)) return site;
  return { ...site, claims: site.claims.filter(lasts), rejections: site.rejections.filter(lasts) };
}

export function merged(site: Site): Scan[] {
  return site.scans.filter((scan) => scan.state === ScanState.MERGED);
}

// Scans that wait for a person.
export function undecided(site: Site): Scan[] {
  return site.scans.filter((scan) => scan.state === ScanState.DOUBTFUL || scan.state === ScanState.FAILED);
}

// Scans on their way into the model.
export function underWay(site: Site): Scan[] {
  return site.scans.filter((scan) =>
    [ScanState.RECEIVED, ScanState.REGISTERING, ScanState.MERGING].includes(scan.state),
  );
}

// Files that the server reads.
export function readUploads(site: Site): Upload[] {
  return site.uploads.filter((upload) => upload.state === UploadState.READING);
}

// Files of which no scan came, of the last day before the newest of them.
export function refusedUploads(site: Site): Upload[] {
  const day = 86_400;
  const failed = site.uploads.filter((upload) => upload.state === UploadState.FAILED && upload.file !== undefined);
  const newest = Math.max(...failed.map((upload) => seconds(upload.createTime)));
  return failed.filter((upload) => seconds(upload.createTime) > newest - day);
}

// Uploads that somebody sends, or that were left.
export function openUploads(site: Site): Upload[] {
  return site.uploads.filter((upload) => upload.state === UploadState.OPEN);
}

// The number that people call a scan by: 'station 4' is the fourth that arrived.
export function stationNumber(site: Site, name: string): number {
  return site.scans.findIndex((scan) => scan.name === name) + 1;
}

// Where the scanner stands: of one of the fleet its last station, else the scan that was merged last.
export function lastStation(site: Site, scanner: string): Scan | undefined {
  const candidates = merged(site).filter((scan) => scan.pose !== undefined);
  const own = scanner === "" ? candidates : candidates.filter((scan) => scan.scanner === scanner);
  return own.at(-1) ?? candidates.at(-1);
}

// The newest plan that ended well or runs, for this scanner and for the site as it is, which follows these stops of a
// route, or none.
export function freshPlan(site: Site, scanner: string, stops: readonly Place[]): Plan | undefined {
  return [...site.plans.values()]
    .filter((plan) => serves(plan, scanner) && follows(plan, stops))
    .filter((plan) => nanoseconds(plan.createTime) >= site.changed)
    .at(-1);
}

function follows({ tourStations }: Plan, stops: readonly Place[]): boolean {
  const same = (one: Place, other: Place | undefined) => one.x === other?.x && one.y === other.y && one.z === other.z;
  return stops.length === tourStations.length && stops.every((stop, i) => same(stop, tourStations[i]));
}

export function serves(plan: Plan, scanner: string): boolean {
  return scanner === "" ? plan.scanners.length === 0 : plan.scanners.length === 1 && plan.scanners[0] === scanner;
}
