// The signs on a plan: stations, places on offer, doors and what else has a place of its own.
import type { Colours } from "./colours";
import { toScreen, type Point, type Projection } from "./projection";

export function disc(context: CanvasRenderingContext2D, at: Point, radius: number): void {
  context.beginPath();
  context.arc(at.x, at.y, radius, 0, 2 * Math.PI);
}

export function words(
  context: CanvasRenderingContext2D,
  text: string,
  at: Point,
  fill: string,
  halo: string,
  font: string,
): void {
  context.font = font;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.lineJoin = "round";
  context.lineWidth = 4;
  context.strokeStyle = halo;
  context.strokeText(text, at.x, at.y);
  context.fillStyle = fill;
  context.fillText(text, at.x, at.y);
}

export function drawTarget(context: CanvasRenderingContext2D, at: Point, colours: Colours): void {
  disc(context, at, 19);
  context.fillStyle = colours.paper;
  context.fill();
  disc(context, at, 16);
  context.fillStyle = colours.accent;
  context.fill();
  context.lineWidth = 3;
  context.strokeStyle = colours.onAccent;
  context.beginPath();
  for (const [dx, dy] of [
    [1, 0],
    [-1, 0],
    [0, 1],
    [0, -1],
  ] as const) {
    context.moveTo(at.x + 4 * dx, at.y + 4 * dy);
    context.lineTo(at.x + 11 * dx, at.y + 11 * dy);
  }
  context.stroke();
}

// A disc of paper with a rim and a sign in it.
export function drawBadge(
  context: CanvasRenderingContext2D,
  at: Point,
  sign: { text: string; radius: number; rim: string; ink: string; broken?: boolean },
  selected: boolean,
  colours: Colours,
  font: string,
): void {
  disc(context, at, selected ? 17 : sign.radius);
  context.fillStyle = colours.paper;
  context.fill();
  context.lineWidth = selected ? 4 : 2.5;
  context.strokeStyle = sign.rim;
  context.setLineDash(sign.broken ? [4, 4] : []);
  context.stroke();
  context.setLineDash([]);
  inside(context, sign.text, at, sign.ink, font);
}

// Text in the middle of a disc.
function inside(context: CanvasRenderingContext2D, text: string, at: Point, ink: string, font: string): void {
  context.font = font;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = ink;
  context.fillText(text, at.x, at.y + 1);
}

export function drawStation(
  context: CanvasRenderingContext2D,
  at: Point,
  mark: { label: string; here: boolean; weak: boolean; who: string },
  selected: boolean,
  colours: Colours,
  font: string,
): void {
  if (mark.here) {
    disc(context, at, 21);
    context.lineWidth = 3;
    context.strokeStyle = colours.ink;
    context.stroke();
  }
  disc(context, at, 15);
  context.fillStyle = colours.ink;
  context.fill();
  context.lineWidth = selected ? 4 : 2;
  context.strokeStyle = selected ? colours.accent : colours.paper;
  // Weakly held scans have a broken rim.
  context.setLineDash(mark.weak ? [5, 5] : []);
  context.stroke();
  context.setLineDash([]);
  inside(context, mark.label, at, colours.paper, font);
  if (mark.who !== "") words(context, mark.who, { x: at.x, y: at.y + 32 }, colours.ink, colours.paper, font);
}

export function drawPending(
  context: CanvasRenderingContext2D,
  at: Point,
  label: string,
  colours: Colours,
  font: string,
): void {
  context.beginPath();
  context.moveTo(at.x, at.y - 15);
  context.lineTo(at.x + 14, at.y + 11);
  context.lineTo(at.x - 14, at.y + 11);
  context.closePath();
  context.fillStyle = colours.paper;
  context.fill();
  context.lineWidth = 3;
  context.strokeStyle = colours.ink;
  context.stroke();
  if (label !== "") words(context, label, { x: at.x, y: at.y + 25 }, colours.ink, colours.paper, font);
}

export function drawClaim(
  context: CanvasRenderingContext2D,
  at: Point,
  label: string,
  own: boolean,
  colours: Colours,
  font: string,
): void {
  disc(context, at, 24);
  context.lineWidth = 3;
  context.strokeStyle = own ? colours.accent : colours.ink;
  context.setLineDash([7, 5]);
  context.stroke();
  context.setLineDash([]);
  words(context, label, { x: at.x, y: at.y + 36 }, colours.ink, colours.paper, font);
}

export function drawRejection(
  context: CanvasRenderingContext2D,
  projection: Projection,
  mark: Point & { radius: number },
  colours: Colours,
): void {
  const at = toScreen(projection, mark);
  const radius = Math.max(10, mark.radius * projection.scale);
  disc(context, at, radius);
  context.lineWidth = 2.5;
  context.strokeStyle = colours.soft;
  context.stroke();
  context.beginPath();
  context.moveTo(at.x - 0.7 * radius, at.y - 0.7 * radius);
  context.lineTo(at.x + 0.7 * radius, at.y + 0.7 * radius);
  context.stroke();
}

export function drawDoor(
  context: CanvasRenderingContext2D,
  projection: Projection,
  mark: Point & { width: number; direction: number },
  colours: Colours,
  font: string,
): void {
  const half = mark.width / 2;
  const across = mark.direction + Math.PI / 2;
  const a = toScreen(projection, { x: mark.x + half * Math.cos(across), y: mark.y + half * Math.sin(across) });
  const b = toScreen(projection, { x: mark.x - half * Math.cos(across), y: mark.y - half * Math.sin(across) });
  context.beginPath();
  context.moveTo(a.x, a.y);
  context.lineTo(b.x, b.y);
  context.lineWidth = 5;
  context.strokeStyle = colours.ink;
  context.setLineDash([3, 5]);
  context.stroke();
  context.setLineDash([]);
  const beyond = toScreen(projection, {
    x: mark.x + 0.45 * Math.cos(mark.direction),
    y: mark.y + 0.45 * Math.sin(mark.direction),
  });
  words(context, "?", beyond, colours.ink, colours.paper, font);
}

export function drawTrial(
  context: CanvasRenderingContext2D,
  at: Point,
  label: string,
  colours: Colours,
  font: string,
): void {
  disc(context, at, 18);
  context.fillStyle = colours.paper;
  context.fill();
  context.lineWidth = 5;
  context.strokeStyle = colours.accent;
  context.stroke();
  disc(context, at, 5);
  context.fillStyle = colours.accent;
  context.fill();
  if (label !== "") words(context, label, { x: at.x, y: at.y - 32 }, colours.ink, colours.paper, font);
}

export function drawPose(
  context: CanvasRenderingContext2D,
  at: Point,
  mark: { label: string; heading: number; chosen: boolean },
  projection: Projection,
  colours: Colours,
  font: string,
): void {
  const heading = mark.heading + projection.turn;
  const tip = { x: at.x + 46 * Math.cos(heading), y: at.y - 46 * Math.sin(heading) };
  context.beginPath();
  context.moveTo(at.x, at.y);
  context.lineTo(tip.x, tip.y);
  context.lineWidth = 6;
  context.lineCap = "round";
  context.strokeStyle = mark.chosen ? colours.accent : colours.ink;
  context.stroke();
  disc(context, at, 20);
  context.fillStyle = mark.chosen ? colours.accent : colours.paper;
  context.fill();
  context.lineWidth = 3;
  context.strokeStyle = mark.chosen ? colours.paper : colours.ink;
  context.stroke();
  context.font = font;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = mark.chosen ? colours.onAccent : colours.ink;
  context.fillText(mark.label, at.x, at.y + 1);
}

// The grip by which a scan that is placed by hand is turned.
export function drawTurn(context: CanvasRenderingContext2D, at: Point, colours: Colours): void {
  disc(context, at, 16);
  context.fillStyle = colours.paper;
  context.fill();
  context.lineWidth = 4;
  context.strokeStyle = colours.accent;
  context.stroke();
  context.beginPath();
  context.arc(at.x, at.y, 7, -0.4, 1.4 * Math.PI);
  context.lineWidth = 3;
  context.stroke();
}

// A target that is to be put up, as the boards look.
export function drawSign(
  context: CanvasRenderingContext2D,
  at: Point,
  label: string,
  selected: boolean,
  colours: Colours,
  font: string,
): void {
  const half = 11;
  context.fillStyle = colours.paper;
  context.fillRect(at.x - half, at.y - half, 2 * half, 2 * half);
  context.fillStyle = colours.ink;
  context.fillRect(at.x - half, at.y - half, half, half);
  context.fillRect(at.x, at.y, half, half);
  context.lineWidth = selected ? 4 : 2.5;
  context.strokeStyle = selected ? colours.accent : colours.ink;
  context.strokeRect(at.x - half, at.y - half, 2 * half, 2 * half);
  words(context, label, { x: at.x, y: at.y + 24 }, colours.ink, colours.paper, font);
}

// Where it is too narrow: two jambs, and what would pass between them.
export function drawNarrow(context: CanvasRenderingContext2D, at: Point, selected: boolean, colours: Colours): void {
  disc(context, at, 15);
  context.fillStyle = colours.paper;
  context.fill();
  context.lineWidth = selected ? 4 : 2;
  context.strokeStyle = selected ? colours.accent : colours.ink;
  context.stroke();
  context.beginPath();
  for (const side of [-1, 1]) {
    context.moveTo(at.x + 9 * side, at.y);
    context.lineTo(at.x + 3 * side, at.y);
    context.moveTo(at.x + 6 * side, at.y - 4);
    context.lineTo(at.x + 2 * side, at.y);
    context.lineTo(at.x + 6 * side, at.y + 4);
  }
  context.lineWidth = 2.5;
  context.strokeStyle = colours.ink;
  context.stroke();
}

// Where a door has to stay open: a frame, and its leaf ajar.
export function drawOpenDoor(context: CanvasRenderingContext2D, at: Point, selected: boolean, colours: Colours): void {
  disc(context, at, 16);
  context.fillStyle = colours.paper;
  context.fill();
  context.lineWidth = selected ? 4 : 2.5;
  context.strokeStyle = colours.warn;
  context.stroke();
  context.beginPath();
  // The wall on both sides of it, from above.
  context.moveTo(at.x - 11, at.y + 6);
  context.lineTo(at.x - 6, at.y + 6);
  context.moveTo(at.x + 11, at.y + 6);
  context.lineTo(at.x + 6, at.y + 6);
  // The leaf, and the arc that it went.
  context.moveTo(at.x - 6, at.y + 6);
  context.lineTo(at.x - 6, at.y - 7);
  context.lineWidth = 3;
  context.stroke();
  context.beginPath();
  context.arc(at.x - 6, at.y + 6, 12, -Math.PI / 2, 0);
  context.lineWidth = 1.5;
  context.stroke();
}

export function drawChangeLabel(
  context: CanvasRenderingContext2D,
  at: Point,
  label: string,
  selected: boolean,
  colours: Colours,
  font: string,
): void {
  context.font = font;
  const half = { x: Math.max(15, context.measureText(label).width / 2 + 6), y: 13 };
  context.fillStyle = colours.paper;
  context.fillRect(at.x - half.x, at.y - half.y, 2 * half.x, 2 * half.y);
  context.lineWidth = selected ? 4 : 2;
  context.strokeStyle = selected ? colours.accent : colours.ink;
  context.strokeRect(at.x - half.x, at.y - half.y, 2 * half.x, 2 * half.y);
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = colours.ink;
  context.fillText(label, at.x, at.y + 1);
}
