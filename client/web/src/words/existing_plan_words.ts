// How a plan or a model of the building stands by what was scanned, in words, with the cure where it is not used.
import { SitePriorState, type SitePriorStanding } from "../gen/vantage/v1/site_prior_pb";
import type { Key, Parameters } from "../texts/texts.svelte";
import { area, centimetres, percent } from "./numbers";

export interface Verdict {
  standing: "good" | "doubtful" | "bad" | "unknown";
  words: string;
  // What it means, and what helps.
  more: string[];
}

export function existingVerdict(
  standing: SitePriorStanding | undefined,
  say: (key: Key, parameters?: Parameters) => string,
  language: string,
): Verdict {
  const agreeing = () =>
    say("existing.agrees", {
      share: percent(standing?.agreeingShare ?? 0, language),
      area: area(standing?.wallAreaM2 ?? 0, language),
    });
  switch (standing?.state) {
    case SitePriorState.PLACED:
      return { standing: "unknown", words: say("existing.placed"), more: [say("existing.placedMore")] };
    case SitePriorState.NOT_ENOUGH_SEEN:
      return { standing: "unknown", words: say("existing.notEnough"), more: [say("existing.notEnoughMore")] };
    case SitePriorState.ALIGNED: {
      const more = [agreeing()];
      if (standing.refutedShare >= 0.01) {
        more.push(say("existing.gone", { share: percent(standing.refutedShare, language) }));
      }
      if (standing.newAreaM2 >= 0.5) more.push(say("existing.new", { area: area(standing.newAreaM2, language) }));
      const scale = Math.abs(standing.scale - 1);
      if (scale >= 0.005) {
        const key = standing.scale > 1 ? "existing.drawnSmall" : "existing.drawnLarge";
        more.push(say(key, { share: percent(scale, language) }));
      }
      const accuracy = centimetres(standing.residualM, language);
      return { standing: "good", words: say("existing.aligned", { accuracy }), more };
    }
    case SitePriorState.NOT_ALIGNED:
      return { standing: "bad", words: say("existing.notAligned"), more: [agreeing(), say("existing.notAlignedMore")] };
    case SitePriorState.REFUTED:
      return {
        standing: "bad",
        words: say("existing.refuted"),
        more: [say("existing.refutedMore", { share: percent(standing.refutedShare, language) })],
      };
    case SitePriorState.UNUSABLE:
      return { standing: "bad", words: say("existing.unusable"), more: [say("existing.unusableMore")] };
    default:
      return { standing: "unknown", words: say("existing.unknown"), more: [] };
  }
}
