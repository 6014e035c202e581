// What a scanner saw from where it stood, unrolled: columns are directions around it, rows are heights
// over the horizon. People find a place by what they see.

export interface Panorama {
  width: number;
  height: number;
  // Of the left column's edge, rad, counter-clockwise from the world's +x; columns go on clockwise, as
  // somebody sees who stands there.
  left: number;
  // Of the upper row's edge over the horizon, rad.
  top: number;
  // A pixel's, rad, in both directions.
  step: number;
  // From where it is seen, m, world.
  eye: { x: number; y: number; z: number };
  // Of each pixel, m; Infinity where nothing is known.
  range: Float32Array;
  // How light a pixel is, 0 to 255.
  light: Uint8Array;
}

export interface Pixel {
  x: number;
  y: number;
  // Distance from the eye, m.
  range: number;
}

// Where a point of the world is in the picture.
export function project(
  panorama: Pick<Panorama, "eye" | "left" | "top" | "step">,
  point: { x: number; y: number; z: number },
): Pixel {
  const [dx, dy, dz] = [point.x - panorama.eye.x, point.y - panorama.eye.y, point.z - panorama.eye.z];
  const flat = Math.hypot(dx, dy);
  const full = 2 * Math.PI;
  const clockwise = (((panorama.left - Math.atan2(dy, dx)) % full) + full) % full;
  return {
    x: clockwise / panorama.step,
    y: (panorama.top - Math.atan2(dz, flat)) / panorama.step,
    range: Math.hypot(flat, dz),
  };
}

// Pixels over which slopes are taken.
const reach = 2;
// Over the horizon and below it, rad: from the ceiling to the floor a metre and a half away.
const highest = (38 * Math.PI) / 180;
const lowest = (-52 * Math.PI) / 180;

export class PanoramaPainter {
  readonly panorama: Panorama;
  #intensity: Float32Array;

  // All around, with the middle of the picture in direction `ahead`, rad.
  constructor(eye: { x: number; y: number; z: number }, ahead: number, width: number) {
    const step = (2 * Math.PI) / width;
    const height = Math.round((highest - lowest) / step);
    this.panorama = {
      width,
      height,
      left: ahead + Math.PI,
      top: highest,
      step,
      eye,
      range: new Float32Array(width * height).fill(Infinity),
      light: new Uint8Array(width * height),
    };
    this.#intensity = new Float32Array(width * height).fill(-1);
  }

  // What is not covered by any point so far: others may fill it, such as what was too near for this scan and
  // that others measured.
  rest(): PanoramaPainter {
    const { eye, left, width } = this.panorama;
    return new PanoramaPainter(eye, left - Math.PI, width);
  }

  // Takes what another picture has as near as `farthest`, m, where this one has nothing.
  takeWhereEmpty(other: PanoramaPainter, farthest: number): void {
    const { range } = this.panorama;
    other.panorama.range.forEach((r, at) => {
      if (range[at] === Infinity && r <= farthest) range[at] = r;
    });
  }

  // A point that was measured, m, world; with its intensity, [0, 1], where the scan has it. `size` is the
  // edge of what it stands for, m: nearer points cover more of the picture.
  add(x: number, y: number, z: number, size: number, intensity = -1): void {
    const picture = this.panorama;
    const at = project(picture, { x, y, z });
    if (at.range < 0.2) return;
    this.#cover(at, Math.min(24, (0.6 * size) / at.range / picture.step), intensity);
  }

  // A ray's end, m, world, of a scan whose rays are `spacing` apart, rad: it covers what is between them.
  addRay(x: number, y: number, z: number, spacing: number, intensity = -1): void {
    const at = project(this.panorama, { x, y, z });
    if (at.range < 0.2) return;
    this.#cover(at, Math.min(24, (0.55 * spacing) / this.panorama.step), intensity);
  }

  #cover(at: Pixel, radius: number, intensity: number): void {
    const picture = this.panorama;
    const [x0, x1] = [Math.floor(at.x - radius), Math.floor(at.x + radius)];
    const [y0, y1] = [Math.max(0, Math.floor(at.y - radius)), Math.min(picture.height - 1, Math.floor(at.y + radius))];
    for (let py = y0; py <= y1; ++py) {
      for (let px = x0; px <= x1; ++px) {
        const pixel = py * picture.width + (((px % picture.width) + picture.width) % picture.width);
        if (at.range < picture.range[pixel]!) {
          picture.range[pixel] = at.range;
          this.#intensity[pixel] = intensity;
        }
      }
    }
  }

  // Fills what no point covered beside others that did, and lights the picture: by intensity, and by how
  // the surface lies to the eye, edges dark, so that a room is recognised.
  finish(): Panorama {
    const { width, height, range, light, step } = this.panorama;
    fillGaps(range, this.#intensity, width, height);
    for (let y = 0; y < height; ++y) {
      for (let x = 0; x < width; ++x) {
        const at = y * width + x;
        const r = range[at]!;
        if (r === Infinity) {
          light[at] = 0;
          continue;
        }
        const right = range[y * width + ((x + reach) % width)]!;
        const left = range[y * width + ((x + width - reach) % width)]!;
        const up = range[Math.max(0, y - reach) * width + x]!;
        const down = range[Math.min(height - 1, y + reach) * width + x]!;
        // Steps of range against the width of the pixels between: the surface's slope to the eye. Steps of
        // a few millimetres are noise, which near surfaces would look rough with.
        const slope = (a: number, b: number) => {
          const before = a === Infinity ? r : a;
          const after = b === Infinity ? r : b;
          const rise = after - before;
          return (Math.sign(rise) * Math.max(0, Math.abs(rise) - 0.006)) / (2 * reach * r * step);
        };
        const [sx, sy] = [slope(left, right), slope(up, down)];
        const facing = 1 / Math.sqrt(1 + sx * sx + sy * sy);
        // From above left, as pictures are lit by custom.
        const side = Math.max(-1, Math.min(1, (sy - 0.6 * sx) / Math.sqrt(1 + sx * sx + sy * sy)));
        // Nearer is lighter, ever less so.
        const near = 1 / (1 + r / 14);
        // What stands before something else has a dark rim.
        let rim = 0;
        for (const other of [left, right, up, down]) {
          if (other !== Infinity && r - other > 0.06 * other) rim += Math.min(1, (r - other) / (0.5 * other));
        }
        const measured = this.#intensity[at]!;
        const body = 0.45 + 0.35 * facing + 0.2 * side;
        const shade = (measured < 0 ? body : body * (0.35 + 0.85 * Math.sqrt(measured))) * (0.55 + 0.6 * near);
        light[at] = Math.max(18, Math.min(255, 255 * shade * (1 - 0.28 * Math.min(2, rim))));
      }
    }
    return this.panorama;
  }
}

// Pixels that nothing covered take what most of their neighbours have; in a few passes, so that holes of
// what was truly not seen stay.
function fillGaps(range: Float32Array, intensity: Float32Array, width: number, height: number): void {
  for (let pass = 0; pass < 3; ++pass) {
    const seen = range.slice();
    for (let y = 1; y < height - 1; ++y) {
      for (let x = 0; x < width; ++x) {
        const at = y * width + x;
        if (seen[at] !== Infinity) continue;
        let [count, sum, bright, lit] = [0, 0, 0, 0];
        for (let dy = -1; dy <= 1; ++dy) {
          for (let dx = -1; dx <= 1; ++dx) {
            const near = (y + dy) * width + ((x + dx + width) % width);
            if (seen[near] === Infinity) continue;
            count += 1;
            sum += seen[near]!;
            if (intensity[near]! >= 0) {
              bright += intensity[near]!;
              lit += 1;
            }
          }
        }
        if (count >= 5) {
          range[at] = sum / count;
          if (lit > 0) intensity[at] = bright / lit;
        }
      }
    }
  }
}
