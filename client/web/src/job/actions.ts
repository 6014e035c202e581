// What a crew does to a job, as entries of the outbox and as calls to the server.
import { create } from "@bufbuild/protobuf";
import { fleet, patience, plans, scans } from "../api/server";
import { upright } from "./heading";
import type { Entry } from "./outbox";
import { Vector3Schema, type Vector3 } from "../gen/vantage/v1/geometry_pb";
import { PoseUse } from "../gen/vantage/v1/scan_service_pb";

// A place, m, world: what of a Vector3 can be kept as JSON.
export interface Place {
  x: number;
  y: number;
  z: number;
}

export function placeOf(vector: Vector3): Place {
  return { x: vector.x, y: vector.y, z: vector.z };
}

export interface Payloads {
  // A scan was made here; its data come later.
  createStation: { position: Place; scanner: string; heading?: number };
  deleteStation: { name: string };
  // Nobody can stand here; for some time, s, or for good.
  rejectView: { position: Place; radius: number; reason: string; lasts?: number };
  deleteRejection: { name: string };
  claimView: { position: Place; scanner: string; plan: string; heading?: number };
  releaseClaim: { name: string };
  // `etag`: of the scan as its poses were shown; absent in what an earlier page kept to be sent.
  acceptScan: { name: string; rivalPose: number; etag?: string };
  withdrawScan: { name: string };
  // Align the scan again from this place and heading, rad; or merge it at exactly that pose.
  setScanPose: { name: string; position: Place; heading: number; asIs: boolean };
}

export type Kind = keyof Payloads;

// How long a claim holds, s; one that waited longer than this to be sent is of no use any more.
export const claimLasts = 1800;

const senders: {
  [K in Kind]: (parent: string, requestId: string, what: Payloads[K], time: number) => Promise<string>;
} = {
  async createStation(parent, requestId, { position, scanner, heading }) {
    const station = { position: create(Vector3Schema, position), scanner, headingRad: heading };
    const response = await fleet.createStation({ parent, requestId, station }, { timeoutMs: patience });
    return response.station?.name ?? "";
  },
  async deleteStation(_, requestId, { name }) {
    await fleet.deleteStation({ name, requestId }, { timeoutMs: patience });
    return "";
  },
  async rejectView(parent, requestId, { position, radius, reason, lasts }) {
    const ttl = lasts === undefined ? undefined : { seconds: BigInt(lasts), nanos: 0 };
    const response = await plans.rejectView(
      { parent, requestId, position, radiusM: radius, reason, ttl },
      { timeoutMs: patience },
    );
    return response.rejection?.name ?? "";
  },
  async deleteRejection(_, requestId, { name }) {
    await plans.deleteRejection({ name, requestId }, { timeoutMs: patience });
    return "";
  },
  async claimView(parent, requestId, { position, scanner, plan, heading }, time) {
    if (Date.now() - time > claimLasts * 1000) return "";
    const response = await fleet.claimView(
      {
        parent,
        requestId,
        scanner,
        position,
        plan,
        headingRad: heading,
        ttl: { seconds: BigInt(claimLasts), nanos: 0 },
      },
      { timeoutMs: patience },
    );
    return response.claim?.name ?? "";
  },
  async releaseClaim(_, requestId, { name }) {
    await fleet.releaseClaim({ name, requestId }, { timeoutMs: patience });
    return "";
  },
  async acceptScan(_, requestId, { name, rivalPose, etag }) {
    await scans.acceptScan({ name, rivalPose, etag, requestId }, { timeoutMs: patience });
    return name;
  },
  async withdrawScan(_, requestId, { name }) {
    await scans.withdrawScan({ name, requestId }, { timeoutMs: patience });
    return name;
  },
  async setScanPose(_, requestId, { name, position, heading, asIs }) {
    const prior = { pose: { rotation: upright(heading), translation: position } };
    await scans.setScanPose(
      { name, prior, use: asIs ? PoseUse.AS_IS : PoseUse.ALIGN, requestId },
      { timeoutMs: patience },
    );
    return name;
  },
};

// Returns the name of what came of it, where something did.
export function send(entry: Entry): Promise<string> {
  const kind = entry.kind as Kind;
  const sender = senders[kind] as (parent: string, id: string, what: unknown, time: number) => Promise<string>;
  // A later release of the page may have left something that this one does not know.
  if (sender === undefined) return Promise.resolve("");
  return sender(entry.session, entry.id, entry.payload, entry.time);
}
