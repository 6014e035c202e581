// Reads the model and makes pictures of it, beside the page, which goes on answering meanwhile.
import { floorPlan, wayOver, type FloorPlan } from "./floor_plan";
import { PanoramaPainter } from "./panorama";
import { arrange } from "./points";
import { readHeader, SurfaceReader, type Surface } from "./surface";
import type { Ask, Answer } from "./model_messages";

let reader = new SurfaceReader();
let surface: Surface | undefined;
let plans = new Map<string, FloorPlan>();
// Pictures of scans that are being made, by the number that the page gave them.
const pictures = new Map<number, { painter: PanoramaPainter; take: (bytes: Uint8Array) => void }>();

function planOf(floor: number, top: number, size: number, required: number): FloorPlan | undefined {
  if (surface === undefined) return undefined;
  const key = `${floor} ${top} ${required}`;
  const known = plans.get(key);
  if (known !== undefined) return known;
  const made = floorPlan(surface, floor, top, size, required);
  plans.set(key, made);
  return made;
}

// A reader of the samples of a scan (EXPORT_FORMAT_SCANS_PLY) that paints them as they come.
function sampleReader(painter: PanoramaPainter, spacing: number): (bytes: Uint8Array) => void {
  let left = new Uint8Array(0);
  let header: ReturnType<typeof readHeader>;
  return (bytes) => {
    const data = new Uint8Array(left.length + bytes.length);
    data.set(left);
    data.set(bytes, left.length);
    let at = 0;
    if (header === undefined) {
      header = readHeader(data);
      if (header === undefined) {
        left = data;
        return;
      }
      at = header.length;
    }
    const { stride, properties } = header.header;
    const intensity = properties.get("intensity")?.at;
    const view = new DataView(data.buffer);
    for (; at + stride <= data.length; at += stride) {
      painter.addRay(
        view.getFloat64(at, true),
        view.getFloat64(at + 8, true),
        view.getFloat64(at + 16, true),
        spacing,
        intensity === undefined ? -1 : view.getUint16(at + intensity, true) / 65_535,
      );
    }
    left = data.slice(at);
  };
}

// What was measured, as voxels of edge `size`, m.
function paintSurface(painter: PanoramaPainter, size: number): void {
  if (surface === undefined) return;
  const { xyz, origin } = surface;
  for (let i = 0; i < surface.count; ++i) {
    if (surface.kind[i] !== 1) continue;
    painter.add(xyz[3 * i]! + origin.x, xyz[3 * i + 1]! + origin.y, xyz[3 * i + 2]! + origin.z, size);
  }
}

function answer(ask: Ask): Answer {
  switch (ask.what) {
    case "begin":
      reader = new SurfaceReader();
      return { what: "done" };
    case "surface":
      reader.add(ask.bytes);
      return { what: "done" };
    case "peek":
      surface = reader.soFar();
      plans = new Map();
      return { what: "done" };
    case "end":
      surface = reader.end();
      reader = new SurfaceReader();
      plans = new Map();
      return { what: "done" };
    case "plan":
      return { what: "plan", plan: planOf(ask.floor, ask.top, ask.size, ask.required) };
    case "way": {
      const plan = planOf(ask.floor, ask.top, ask.size, ask.required);
      return {
        what: "way",
        way: plan === undefined ? [ask.from, ask.to] : wayOver(plan, ask.from, ask.to, ask.clearance),
      };
    }
    case "points":
      return { what: "points", points: surface === undefined ? undefined : arrange(surface, ask.required) };
    case "panorama": {
      if (surface === undefined) return { what: "panorama", panorama: undefined };
      const painter = new PanoramaPainter(ask.eye, ask.ahead, ask.width);
      paintSurface(painter, ask.size);
      return { what: "panorama", panorama: painter.finish() };
    }
    case "beginSamples": {
      const painter = new PanoramaPainter(ask.eye, ask.ahead, ask.width);
      pictures.set(ask.picture, { painter, take: sampleReader(painter, ask.spacing) });
      return { what: "done" };
    }
    case "samples":
      pictures.get(ask.picture)?.take(ask.bytes);
      return { what: "done" };
    case "endSamples": {
      const painter = pictures.get(ask.picture)?.painter;
      pictures.delete(ask.picture);
      if (painter === undefined || !ask.whole) return { what: "panorama", panorama: undefined };
      const rest = painter.rest();
      paintSurface(rest, ask.size);
      painter.takeWhereEmpty(rest, ask.near);
      return { what: "panorama", panorama: painter.finish() };
    }
  }
}

self.onmessage = (event: MessageEvent<{ id: number; ask: Ask }>) => {
  const { id, ask } = event.data;
  try {
    self.postMessage({ id, answer: answer(ask) });
  } catch (error) {
    self.postMessage({ id, error: String(error) });
  }
};
