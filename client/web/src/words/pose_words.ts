// What speaks for a pose of a scan and what against it, in words.
import { DisagreementKind, type ComparedPose } from "../gen/vantage/v1/pose_comparison_pb";
import type { Key } from "../texts/texts.svelte";
import { accuracy, area, percent } from "./numbers";
import type { Say } from "./sentences";

const against: [DisagreementKind, Key][] = [
  [DisagreementKind.IN_EMPTY_SPACE, "pose.inEmptySpace"],
  [DisagreementKind.BEHIND_SURFACE, "pose.behindSurface"],
  [DisagreementKind.SEEN_THROUGH, "pose.seenThrough"],
];

export interface PoseWords {
  // What fits, and how well.
  fits: string;
  // Each way in which it contradicts, the most first.
  against: string[];
}

export function poseWords(pose: ComparedPose, say: Say, language: string): PoseWords {
  const fits =
    pose.overlapShare < 0.005
      ? say("pose.fitsNothing")
      : say("pose.fits", {
          share: percent(pose.overlapShare, language),
          residual: accuracy(pose.rmsResidualM, language),
        });
  const sums = against
    .map(([kind, key]) => ({
      key,
      m2: pose.disagreements.filter((other) => other.kind === kind).reduce((sum, other) => sum + other.areaM2, 0),
    }))
    .filter(({ m2 }) => m2 >= 0.05)
    .sort((a, b) => b.m2 - a.m2);
  return {
    fits,
    against: sums.length > 0 ? sums.map(({ key, m2 }) => say(key, { area: area(m2, language) })) : [],
  };
}
