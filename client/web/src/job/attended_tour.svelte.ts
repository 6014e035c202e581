// The tour while somebody looks at it. To be called while a component is made: it ends with the component.
import { untrack } from "svelte";
import type { Job } from "./job.svelte";

export function attendTour(job: () => Job, shown: () => boolean): void {
  // After each scan, and whatever else plans depend on, the rest is planned anew.
  $effect(() => {
    const { site, planning, link } = job();
    void [site?.modelVersion, site?.changed, planning, link];
    if (shown()) untrack(() => job().tours.attend());
  });
  // Nobody looks any more: the search ends, and what it found stays.
  $effect(() => {
    const { tours } = job();
    if (!shown()) return;
    return () => untrack(() => tours.cancel());
  });
}
