// Which stops of a route a plan is asked to follow, and whether it may.
import type { Place } from "./actions";
import type { Site } from "./site";
import { notMade } from "./tour_wish";

// As many as the contract takes.
const mostStops = 256;

// What the contract does not take together with a route; 'refused': what else the server has against it.
export type Hindrance = "scanner" | "stations" | "claims" | "refused";
export function hindrance(site: Pick<Site, "claims" | "stations">, scanner: string): Hindrance | undefined {
  if (scanner !== "") return "scanner";
  if (site.stations.length > 0) return "stations";
  return site.claims.length > 0 ? "claims" : undefined;
}

// Those that nobody has made yet, in their order.
export function stopsAhead(stops: readonly Place[], site: Site): Place[] {
  return notMade(
    stops.map((position) => ({ position })),
    site,
  )
    .slice(0, mostStops)
    .map(({ position }) => position);
}

// What was kept of a route; undefined: none is followed, or another release's.
export function readStops(text: string | null): Place[] | undefined {
  try {
    const kept: unknown = JSON.parse(text ?? "null");
    const isPlace = (place: Partial<Place> | null) =>
      [place?.x, place?.y, place?.z].every((value) => typeof value === "number");
    return Array.isArray(kept) && kept.every(isPlace) ? kept : undefined;
  } catch {
    return undefined;
  }
}
