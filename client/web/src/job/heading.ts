// Turns about the vertical, rad: of a scanner that stands upright, or nearly so.

// A turn about the vertical.
export function upright(heading: number): { w: number; x: number; y: number; z: number } {
  return { w: Math.cos(heading / 2), x: 0, y: 0, z: Math.sin(heading / 2) };
}

// Where the scanner's +x points, rad, of a scanner that stands upright or nearly so.
export function headingOf(rotation: { w: number; x: number; y: number; z: number } | undefined): number {
  if (rotation === undefined) return 0;
  const { w, x, y, z } = rotation;
  return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
}
