// The samples of a scan as dots on the plan: where they would lie if the scan had been made at a pose, and how they
// agree there with what is known.
import { SampleAgreement } from "../gen/vantage/v1/pose_comparison_pb";

export type Agreement = "fits" | "against" | "unknown";

export interface SampleDots {
  // World, m.
  x: Float64Array;
  y: Float64Array;
  how: Agreement[];
}

interface Pose {
  rotation: { w: number; x: number; y: number; z: number };
  translation: { x: number; y: number; z: number };
}

// Over and below the scanner, m: what stands in a room, without its floor and ceiling, which would cover the plan.
const [above, below] = [0.6, 1.2];

// `points`: x, y, z of each sample, m, the scanner's frame. Without `agreements` nothing is said of them.
export function dotsAt(points: readonly number[], pose: Pose, agreements: readonly SampleAgreement[]): SampleDots {
  const { w, x: a, y: b, z: c } = pose.rotation;
  const [xs, ys, how]: [number[], number[], Agreement[]] = [[], [], []];
  for (let i = 0; 3 * i + 2 < points.length; ++i) {
    const [px, py, pz] = [points[3 * i]!, points[3 * i + 1]!, points[3 * i + 2]!];
    // The rotation of a unit quaternion: p + 2 w (q x p) + 2 q x (q x p).
    const [ux, uy, uz] = [2 * (b * pz - c * py), 2 * (c * px - a * pz), 2 * (a * py - b * px)];
    const z = pz + w * uz + a * uy - b * ux;
    if (z > above || z < -below) continue;
    xs.push(pose.translation.x + px + w * ux + b * uz - c * uy);
    ys.push(pose.translation.y + py + w * uy + c * ux - a * uz);
    how.push(agreementOf(agreements[i]));
  }
  return { x: Float64Array.from(xs), y: Float64Array.from(ys), how };
}

function agreementOf(agreement: SampleAgreement | undefined): Agreement {
  switch (agreement) {
    case SampleAgreement.FITS:
      return "fits";
    case SampleAgreement.FITS_NOTHING:
    case SampleAgreement.IN_EMPTY_SPACE:
    case SampleAgreement.BEHIND_SURFACE:
      return "against";
    default:
      return "unknown";
  }
}
