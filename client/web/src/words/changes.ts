// What was moved on the site since earlier scans, in words.
import { SiteChangeKind, type Scan, type SiteChange } from "../gen/vantage/v1/scan_pb";
import type { Vector3 } from "../gen/vantage/v1/geometry_pb";
import type { Key } from "../texts/texts.svelte";
import { metres } from "./numbers";
import type { Say } from "./sentences";

// Of what a scan tells, the kinds that there are words for: a newer server may know more.
export function changesOf(scan: Scan): SiteChange[] {
  return (scan.merge?.changes ?? []).filter(
    (change) => change.kind === SiteChangeKind.CAME || change.kind === SiteChangeKind.GONE,
  );
}

// As the plan and the list beside it call one: '+2' is the second, and came.
export function changeLabel(change: SiteChange, index: number): string {
  return `${change.kind === SiteChangeKind.CAME ? "+" : "−"}${index + 1}`;
}

// What came or is gone, since which scan, how large, and how far from where the scanner stood.
export function changeWords(
  change: SiteChange,
  station: Vector3 | undefined,
  stationName: (scan: string) => string,
  say: Say,
  language: string,
): string {
  const came = change.kind === SiteChangeKind.CAME;
  const said = [
    change.since === ""
      ? say(came ? "change.came" : "change.gone")
      : say(came ? "change.cameSince" : "change.goneSince", { station: stationName(change.since) }),
  ];
  const { min, max } = change.box ?? {};
  if (min !== undefined && max !== undefined) {
    said.push(
      say("change.size", {
        length: metres(Math.max(max.x - min.x, max.y - min.y), language),
        height: metres(max.z - min.z, language),
      }),
    );
  }
  if (station !== undefined && change.centre !== undefined) {
    const away = Math.hypot(change.centre.x - station.x, change.centre.y - station.y);
    said.push(say("change.away", { distance: metres(away, language) }));
  }
  return said.join(" · ");
}

// All of it in a sentence: how many things came, and how many are gone; empty where nothing was moved.
export function changesSentence(scan: Scan, say: Say, language: string): string {
  const changes = changesOf(scan);
  const counts: [SiteChangeKind, Key][] = [
    [SiteChangeKind.CAME, "changes.came"],
    [SiteChangeKind.GONE, "changes.gone"],
  ];
  const parts = counts
    .map(([kind, key]) => ({ key, n: changes.filter((change) => change.kind === kind).length }))
    .filter(({ n }) => n > 0)
    .map(({ key, n }) => say(key, { n }));
  if (parts.length === 0) return "";
  return say("changes.sentence", { parts: new Intl.ListFormat(language).format(parts) });
}
