// Draws points as squares with a depth buffer, on the processor alone: where a browser has no graphics card this is ten
// times as fast as WebGL is in software, and it looks the same on every tablet.
import { near, type View } from "./camera";
import type { Part, Points } from "../model/points";

// A point of this colour is not drawn.
export const invisible = 0;

// As ImageData has it in memory, on a processor that stores the lower byte first, as all with a browser do.
export function packed(r: number, g: number, b: number): number {
  return (0xff000000 | (b << 16) | (g << 8) | r) >>> 0;
}

// A square has at most so many pixels along its side: what is so near fills the screen anyhow.
const largest = 48;

export class Splatter {
  width = 0;
  height = 0;
  colour = new Uint32Array(0);
  // 1 / depth, 1/m; 0 where nothing is.
  nearness = new Float32Array(0);
  // The same bytes as `colour`, for putImageData.
  image: ImageData | undefined;

  resize(width: number, height: number): void {
    if (width === this.width && height === this.height) return;
    [this.width, this.height] = [width, height];
    const bytes = new Uint8ClampedArray(4 * width * height);
    this.colour = new Uint32Array(bytes.buffer);
    this.nearness = new Float32Array(width * height);
    // Not where tests run.
    this.image = typeof ImageData === "undefined" ? undefined : new ImageData(bytes, width, height);
  }

  clear(background: number): void {
    this.colour.fill(background);
    this.nearness.fill(0);
  }

  // The first `count` points of a part, each `size` m wide, of what is not higher than `cut`.
  draw(points: Points, colours: Uint32Array, part: Part, count: number, size: number, cut: number, view: View): void {
    const { xyz } = points;
    const { width, height, colour, nearness } = this;
    const { eye, right, up, forward, focal } = view;
    const [ex, ey, ez] = [eye.x, eye.y, eye.z];
    const [rx, ry] = [right.x, right.y];
    const [ux, uy, uz] = [up.x, up.y, up.z];
    const [fx, fy, fz] = [forward.x, forward.y, forward.z];
    const [middleX, middleY] = [width / 2, height / 2];
    const end = part.first + count;
    for (let i = part.first; i < end; ++i) {
      const rgba = colours[i]!;
      if (rgba === invisible) continue;
      const z = xyz[3 * i + 2]!;
      if (z > cut) continue;
      const dx = xyz[3 * i]! - ex;
      const dy = xyz[3 * i + 1]! - ey;
      const dz = z - ez;
      const depth = dx * fx + dy * fy + dz * fz;
      if (depth < near) continue;
      const close = 1 / depth;
      const scale = focal * close;
      const side = Math.min(largest, Math.ceil(size * scale));
      const half = side >> 1;
      let x0 = ((middleX + scale * (dx * rx + dy * ry)) | 0) - half;
      let y0 = ((middleY - scale * (dx * ux + dy * uy + dz * uz)) | 0) - half;
      let x1 = x0 + side;
      let y1 = y0 + side;
      if (x1 <= 0 || y1 <= 0 || x0 >= width || y0 >= height) continue;
      if (x0 < 0) x0 = 0;
      if (y0 < 0) y0 = 0;
      if (x1 > width) x1 = width;
      if (y1 > height) y1 = height;
      for (let y = y0; y < y1; ++y) {
        const row = y * width;
        for (let at = row + x0; at < row + x1; ++at) {
          if (close > nearness[at]!) {
            nearness[at] = close;
            colour[at] = rgba;
          }
        }
      }
    }
  }

  // Darkens what lies behind an edge: that is how an eye tells one surface from the other.
  shade(strength: number): void {
    const { width, height, colour, nearness } = this;
    const reach = 2;
    for (let y = reach; y < height - reach; ++y) {
      const row = y * width;
      for (let at = row + reach; at < row + width - reach; ++at) {
        const own = nearness[at]!;
        if (own === 0) continue;
        let ahead = 0;
        // Only what is before it, and no more than half of its depth.
        let other = nearness[at - reach]!;
        if (other > own) ahead += other - own;
        other = nearness[at + reach]!;
        if (other > own) ahead += other - own;
        other = nearness[at - reach * width]!;
        if (other > own) ahead += other - own;
        other = nearness[at + reach * width]!;
        if (other > own) ahead += other - own;
        if (ahead < 0.01 * own) continue;
        const light = 256 / (1 + strength * Math.min(0.5, ahead / own));
        const rgba = colour[at]!;
        colour[at] =
          (0xff000000 |
            (((((rgba >>> 16) & 255) * light) >> 8) << 16) |
            (((((rgba >>> 8) & 255) * light) >> 8) << 8) |
            (((rgba & 255) * light) >> 8)) >>>
          0;
      }
    }
  }
}
