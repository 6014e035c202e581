// A tour on the plan: its stops with their numbers, and each scanner's walk from one to the next.
import type { TourStop } from "../gen/vantage/v1/tour_pb";
import type { Colours } from "./colours";
import { within, type Band, type Mark } from "./marks";
import { toScreen, type Point, type Projection } from "./projection";

// The walk of one scanner on this storey, in the order in which it goes.
export interface TourLine {
  zone: number;
  way: Point[];
}

// Scanners have letters where there are several: 'B3' is the third stop of the second one.
export function zoneLetter(zone: number): string {
  return String.fromCharCode(65 + (zone % 26));
}

// What people call a stop: by its number among those that its scanner still makes. `zones`: the scanners that the tour
// was made for.
export function stopLabels(stops: readonly TourStop[], zones: readonly string[]): Map<TourStop, string> {
  const counts = new Map<string, number>();
  return new Map(
    stops.map((stop) => {
      const number = (counts.get(stop.scanner) ?? 0) + 1;
      counts.set(stop.scanner, number);
      return [stop, zones.length > 1 ? `${zoneLetter(zoneOf(stop, zones))}${number}` : String(number)];
    }),
  );
}

// By whom it is made: a tour for one scanner has one zone, whatever its name.
export function zoneOf(stop: TourStop, zones: readonly string[]): number {
  return Math.max(0, zones.indexOf(stop.scanner));
}

export function stopMarks(stops: readonly TourStop[], zones: readonly string[], band: Band): Mark[] {
  const labels = stopLabels(stops, zones);
  const begun = new Set<string>();
  return stops.flatMap((stop) => {
    const first = !begun.has(stop.scanner);
    begun.add(stop.scanner);
    const at = stop.position;
    if (at === undefined || !within(band, at.z)) return [];
    const zone = zoneOf(stop, zones);
    return [{ type: "stop" as const, stop, label: labels.get(stop) ?? "", zone, first, x: at.x, y: at.y, z: at.z }];
  });
}

// What of the walks lies on the storey. Where the way is not known it is a straight line.
export function tourLines(stops: readonly TourStop[], zones: readonly string[], band: Band): TourLine[] {
  const lines: TourLine[] = [];
  for (let zone = 0; zone < Math.max(1, zones.length); ++zone) {
    let way: Point[] = [];
    const end = () => {
      if (way.length > 1) lines.push({ zone, way });
      way = [];
    };
    for (const stop of stops.filter((other) => zoneOf(other, zones) === zone)) {
      const at = stop.position;
      if (at === undefined) continue;
      // The way lies on the floor, which a storey begins with.
      const corners = stop.way.filter((corner) => corner.z >= band.floor - 0.5 && corner.z < band.top - 0.3);
      if (corners.length < stop.way.length) end();
      way.push(...corners.map(({ x, y }) => ({ x, y })));
      if (within(band, at.z)) way.push({ x: at.x, y: at.y });
      else end();
    }
    end();
  }
  return lines;
}

// Zones are told apart by the dashes of their lines, the shape of their stops and their letters; by colour, too.
const dashes: readonly number[][] = [[], [14, 7], [3, 7], [14, 6, 3, 6]];
// Corners of a stop's sign, and by how much they are turned.
const shapes: readonly (readonly [corners: number, turn: number, radius: number])[] = [
  [4, Math.PI / 4, 20],
  [6, 0, 18],
  [4, 0, 22],
  [5, -Math.PI / 2, 19],
];

export function drawTourLines(
  context: CanvasRenderingContext2D,
  projection: Projection,
  lines: readonly TourLine[],
  colours: Colours,
): void {
  context.lineCap = "round";
  context.lineJoin = "round";
  for (const { zone, way } of lines) {
    const path = new Path2D();
    const at = way.map((point) => toScreen(projection, point));
    at.forEach((point, i) => (i === 0 ? path.moveTo(point.x, point.y) : path.lineTo(point.x, point.y)));
    context.setLineDash([]);
    context.lineWidth = 8;
    context.strokeStyle = colours.paper;
    context.stroke(path);
    context.lineWidth = 3.5;
    context.strokeStyle = zoneColour(colours, zone);
    context.setLineDash(dashes[zone % dashes.length]!);
    context.stroke(path);
    context.setLineDash([]);
    drawArrows(context, at, zoneColour(colours, zone), colours.paper);
  }
}

// Which way it goes: an arrow in the middle of every longer piece, pixels.
const pieceWithArrow = 70;
function drawArrows(context: CanvasRenderingContext2D, way: readonly Point[], colour: string, halo: string): void {
  for (let i = 1; i < way.length; ++i) {
    const [a, b] = [way[i - 1]!, way[i]!];
    const length = Math.hypot(b.x - a.x, b.y - a.y);
    if (length < pieceWithArrow) continue;
    const [ux, uy] = [(b.x - a.x) / length, (b.y - a.y) / length];
    const tip = { x: (a.x + b.x) / 2 + 8 * ux, y: (a.y + b.y) / 2 + 8 * uy };
    context.beginPath();
    context.moveTo(tip.x, tip.y);
    context.lineTo(tip.x - 15 * ux - 8 * uy, tip.y - 15 * uy + 8 * ux);
    context.lineTo(tip.x - 15 * ux + 8 * uy, tip.y - 15 * uy - 8 * ux);
    context.closePath();
    context.lineWidth = 4;
    context.strokeStyle = halo;
    context.stroke();
    context.fillStyle = colour;
    context.fill();
  }
}

export function drawStop(
  context: CanvasRenderingContext2D,
  at: Point,
  mark: { label: string; zone: number; first: boolean },
  selected: boolean,
  colours: Colours,
  font: string,
): void {
  const [corners, turn, radius] = shapes[mark.zone % shapes.length]!;
  const colour = zoneColour(colours, mark.zone);
  const shape = (r: number) => {
    context.beginPath();
    for (let i = 0; i < corners; ++i) {
      const angle = turn + (2 * Math.PI * i) / corners;
      context.lineTo(at.x + r * Math.cos(angle), at.y + r * Math.sin(angle));
    }
    context.closePath();
  };
  context.lineJoin = "round";
  shape(radius + (selected ? 8 : 3));
  context.fillStyle = selected ? colours.ink : colours.paper;
  context.fill();
  shape(radius);
  context.fillStyle = mark.first ? colour : colours.paper;
  context.fill();
  context.lineWidth = 3;
  context.strokeStyle = colour;
  context.stroke();
  context.font = font;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = mark.first ? colours.onAccent : colours.ink;
  context.fillText(mark.label, at.x, at.y + 1);
}

function zoneColour(colours: Colours, zone: number): string {
  return colours.zones[zone % colours.zones.length] ?? colours.ink;
}
