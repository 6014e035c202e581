// A tour in words: what it comes to, and what the last scans of it are worth.
import type { Tour, TourStop } from "../gen/vantage/v1/tour_pb";
import type { Key, Parameters } from "../texts/texts.svelte";
import { area, hoursAndMinutes, percent, percentFine, spacing } from "./numbers";

type Say = (key: Key, parameters?: Parameters) => string;

export function secondsOf(duration: { seconds: bigint; nanos: number } | undefined): number {
  return duration === undefined ? 0 : Number(duration.seconds) + duration.nanos / 1e9;
}

// '23 stations, 3 h 10 min, 97 % at 2 cm'.
export function tourHeadline(tour: Tour, say: Say, language: string): string {
  return say("tour.headline", {
    n: tour.stops.length,
    time: hoursAndMinutes(secondsOf(tour.duration), language),
    share: percent(tour.coverage, language),
    spacing: spacing(tour.requiredDensityPerM2 || 2500, language),
  });
}

// The scans that are least worth going for: as many as bring little together, else the last one or two of several.
const little = 0.02;
export function leastWorth(tour: Tour, say: Say, language: string): string {
  const all = tour.worth.at(-1);
  if (all === undefined || tour.worth.length < 2) return "";
  const brings = (fewer: number) => Math.max(0, all.coverage - (tour.worth.at(-1 - fewer)?.coverage ?? 0));
  let fewer = tour.worth.length >= 5 ? 2 : 1;
  while (fewer + 1 < tour.worth.length && brings(fewer + 1) <= little) ++fewer;
  const share = percentFine(brings(fewer), language);
  const less = secondsOf(all.duration) - secondsOf(tour.worth.at(-1 - fewer)?.duration);
  const said = fewer === 1 ? say("tour.leastOne", { share }) : say("tour.least", { n: fewer, share });
  // Of several scanners the others may be at work as long.
  return less < 30 ? said : `${said} ${say("tour.less", { n: fewer, time: hoursAndMinutes(less, language) })}`;
}

// What else there is to know of it, a sentence each.
export function tourRemarks(tour: Tour, limited: boolean, say: Say, language: string): string[] {
  const remarks: string[] = [];
  const open = tour.attainableAreaM2 - tour.areaM2;
  if (limited && open >= 0.1) remarks.push(say("tour.open", { area: area(open, language) }));
  if (!limited && !tour.reachesGoal) remarks.push(say("tour.short"));
  const expected = tour.stops.filter((stop) => stop.expected).length;
  if (expected > 0) remarks.push(say("tour.expected", { n: expected }));
  if (tour.unregisteredCount > 0) remarks.push(say("tour.unregistered", { n: tour.unregisteredCount }));
  if (tour.keptCount > 0) remarks.push(say("tour.kept", { n: tour.keptCount }));
  return remarks;
}

// A stop in the list.
export function stopWords(stop: TourStop, say: Say, language: string): { brings: string; then: string } {
  return {
    brings: say("tour.brings", { area: area(Math.max(0, stop.areaM2), language) }),
    then: say("tour.then", {
      time: hoursAndMinutes(secondsOf(stop.endOffset), language),
      share: percent(stop.coverage, language),
    }),
  };
}
