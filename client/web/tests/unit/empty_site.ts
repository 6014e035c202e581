// A job in which nothing has happened.
import { create } from "@bufbuild/protobuf";
import { SessionSchema } from "../../src/gen/vantage/v1/session_pb";
import type { Site } from "../../src/job/site";

export const emptySite: Site = {
  session: create(SessionSchema, { name: "sessions/s" }),
  scans: [],
  scanners: [],
  claims: [],
  stations: [],
  rejections: [],
  uploads: [],
  prior: undefined,
  plans: new Map(),
  sequence: 0n,
  modelVersion: 0n,
  changed: 0n,
};
