// What became of a route that the next place was to follow, in words.
import type { PlanResult } from "../gen/vantage/v1/plan_pb";
import type { Hindrance } from "../job/followed_stops";
import type { Key, Parameters } from "../texts/texts.svelte";

const hindrances: Record<Hindrance, Key> = {
  scanner: "follow.scanner",
  stations: "follow.stations",
  claims: "follow.claims",
  refused: "follow.refused",
};

// Where a route is to be followed and no plan can be asked to.
export function hindranceWords(hindrance: Hindrance | undefined, ahead: number, say: (key: Key) => string): string {
  if (hindrance !== undefined) return say(hindrances[hindrance]);
  return ahead === 0 ? say("follow.made") : "";
}

// `shown`: which of the plan's views is shown. Empty: nothing is known yet, or nothing to be said of it.
export function followedWords(
  result: PlanResult | undefined,
  shown: number,
  say: (key: Key, parameters?: Parameters) => string,
): string {
  const followed = result?.followedTour;
  if (followed === undefined) return "";
  const { stationIndex, otherwiseViewIndex } = followed;
  if (stationIndex === undefined) return say("follow.none");
  if (shown === 0) return say(otherwiseViewIndex === 0 ? "follow.stopAnyway" : "follow.stop", { n: stationIndex + 1 });
  return shown === otherwiseViewIndex ? say("follow.otherwise") : "";
}
