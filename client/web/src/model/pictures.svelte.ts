// Pictures that a screen shows, kept up with the model while the screen is there.
import type { Vector3 } from "../gen/vantage/v1/geometry_pb";
import type { Scan } from "../gen/vantage/v1/scan_pb";
import { within } from "../draw/marks";
import type { FloorPlan } from "./floor_plan";
import type { Model, StoreyBand } from "./model.svelte";
import type { Panorama } from "./panorama";

export interface Place {
  x: number;
  y: number;
}

// The storey that a place belongs to, else the lowest.
export function storeyOf(storeys: readonly StoreyBand[], z: number | undefined): StoreyBand {
  const found = z === undefined ? undefined : storeys.find((storey) => within(storey, z));
  return found ?? storeys[0] ?? { index: 0, name: "", floor: 0, top: Infinity };
}

// To be made while a component is: its effects end with the component.
export class PlanPicture {
  raster = $state.raw<FloorPlan | undefined>(undefined);
  way = $state.raw<readonly Place[]>([]);

  constructor(
    model: () => Model,
    storey: () => StoreyBand,
    from: () => Vector3 | undefined,
    to: () => Vector3 | undefined,
  ) {
    $effect(() => {
      const band = storey();
      if (model().stamp === 0) return;
      let current = true;
      model()
        .plan(band)
        .then(
          (raster) => current && (this.raster = raster),
          () => undefined,
        );
      return () => (current = false);
    });
    $effect(() => {
      const [start, end, band] = [from(), to(), storey()];
      if (start === undefined || end === undefined || !within(band, start.z) || !within(band, end.z)) {
        this.way = [];
        return;
      }
      // A straight line, until the floor is known.
      this.way = [start, end];
      if (model().stamp === 0) return;
      let current = true;
      model()
        .way(band, start, end)
        .then(
          (way) => current && (this.way = way),
          () => undefined,
        );
      return () => (current = false);
    });
  }
}

export class PanoramaPicture {
  panorama = $state.raw<Panorama | undefined>(undefined);

  constructor(model: () => Model, scan: () => Scan | undefined) {
    // As soon as some of the model has come: of it no more than what was too near for the scan is needed.
    const hasModel = $derived(model().stamp !== 0);
    $effect(() => {
      const shown = scan();
      // The model fills what was too near for the scan; which version of it does not matter.
      if (shown === undefined || !hasModel) return;
      const fetching = new AbortController();
      model()
        .panorama(shown, fetching.signal)
        .then(
          (panorama) => !fetching.signal.aborted && (this.panorama = panorama),
          () => undefined,
        );
      return () => fetching.abort();
    });
  }
}
