// What the page asks of the worker that holds the model, and what it answers.
import type { FloorPlan } from "./floor_plan";
import type { Panorama } from "./panorama";
import type { Points } from "./points";

interface Place {
  x: number;
  y: number;
}

// A storey: its floor and where the next one begins, m, world; the voxels' edge, m; the density that is
// required, samples / m2.
interface Storey {
  floor: number;
  top: number;
  size: number;
  required: number;
}

interface View {
  eye: { x: number; y: number; z: number };
  ahead: number;
  width: number;
}

export type Ask =
  | { what: "begin" }
  | { what: "surface"; bytes: Uint8Array }
  // Pictures are of what has come so far, until the rest has.
  | { what: "peek" }
  | { what: "end" }
  | ({ what: "plan" } & Storey)
  | ({ what: "way"; from: Place; to: Place; clearance: number } & Storey)
  | { what: "points"; required: number }
  | ({ what: "panorama"; size: number } & View)
  // A picture of one scan, from its samples; the page numbers those that are being made. Its rays
  // are `spacing` apart, rad.
  | ({ what: "beginSamples"; picture: number; spacing: number } & View)
  | { what: "samples"; picture: number; bytes: Uint8Array }
  // `whole`: all samples came; else the picture is dropped. `size`: the voxels' edge, m, of the model's surface,
  // which fills what was too near for the scan, up to `near`, m.
  | { what: "endSamples"; picture: number; whole: boolean; size: number; near: number };

export type Answer =
  | { what: "done" }
  | { what: "plan"; plan: FloorPlan | undefined }
  | { what: "way"; way: Place[] }
  | { what: "points"; points: Points | undefined }
  | { what: "panorama"; panorama: Panorama | undefined };
