// What ties scans to each other, as lines of the plan.
import type { PoseGraph } from "../gen/vantage/v1/pose_graph_pb";
import type { Scan } from "../gen/vantage/v1/scan_pb";
import { within, type Band } from "./marks";
import type { Point } from "./projection";

export interface Link {
  from: Point;
  to: Point;
  // The two scans, by name.
  scans: [string, string];
  // How much both show of what either could, [0, 1].
  share: number;
  // Hardly anything else backs it, or it is in doubt itself.
  weak: boolean;
}

// `accuracy` is what the job requires, m: a link known worse than to half of it is weak, and so is one that alone ties
// some scans to the rest.
export function linksOf(graph: PoseGraph | undefined, scans: readonly Scan[], band: Band, accuracy: number): Link[] {
  if (graph === undefined) return [];
  const places = new Map(scans.map((scan) => [scan.name, scan.pose?.translation]));
  const weak = new Set(
    graph.weakLinks
      .filter((link) => link.bridge || link.relativeSigmaM > accuracy / 2)
      .map((link) => `${link.firstScan} ${link.secondScan}`),
  );
  return graph.links.flatMap((link) => {
    const [from, to] = [places.get(link.firstScan), places.get(link.secondScan)];
    if (from === undefined || to === undefined || (!within(band, from.z) && !within(band, to.z))) return [];
    return [
      {
        from: { x: from.x, y: from.y },
        to: { x: to.x, y: to.y },
        scans: [link.firstScan, link.secondScan] as [string, string],
        share: link.overlapShare,
        weak: link.inDoubt || weak.has(`${link.firstScan} ${link.secondScan}`),
      },
    ];
  });
}
