// Which of a plan's views are still to be had: not where somebody else goes, where a scan was made, or where nobody can
// stand, whether the server knows of it already or it waits to be sent.
import type { RankedView } from "../gen/vantage/v1/plan_pb";
import type { Payloads, Place } from "./actions";
import type { Entry } from "./outbox";
import type { Site } from "./site";

// Claims nearer than this are in the same place, m: as ClaimView refuses them.
const samePlace = 0.6;
// Places this far over one another, m, are on different floors.
const anotherFloor = 1.5;

export function freeViews(
  views: readonly RankedView[],
  site: Pick<Site, "claims" | "stations" | "rejections">,
  scanner: string,
  waiting: readonly Pick<Entry, "kind" | "payload">[],
): RankedView[] {
  const taken: { place: Place; radius: number }[] = [];
  const take = (place: Place | undefined, radius: number) => {
    if (place !== undefined) taken.push({ place, radius });
  };
  for (const claim of site.claims) if (claim.scanner !== scanner) take(claim.position, samePlace);
  for (const station of site.stations) take(station.position, samePlace);
  for (const rejection of site.rejections) take(rejection.position, rejection.radiusM);
  for (const { kind, payload } of waiting) {
    if (kind === "createStation") take((payload as Payloads["createStation"]).position, samePlace);
    if (kind === "rejectView") {
      const refused = payload as Payloads["rejectView"];
      take(refused.position, refused.radius);
    }
  }
  return views.filter(({ position }) => {
    if (position === undefined) return false;
    return !taken.some(
      ({ place, radius }) =>
        Math.hypot(place.x - position.x, place.y - position.y) < radius &&
        Math.abs(place.z - position.z) < anotherFloor,
    );
  });
}
