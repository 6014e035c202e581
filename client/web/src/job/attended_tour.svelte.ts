// The tour while somebody looks at it. To be called while a component is made: it ends with the component.
import { untrack } from "svelte";
import type { Job } from "./job.svelte";

export function attendTour(job: () => Job, shown: () => boolean): void {
  $effect(() => {
    const { tours } = job();
    if (!shown()) return;
    const away = untrack(() => tours.look());
    return () => untrack(away);
  });
  // What plans depend on.
  $effect(() => {
    const { site, planning, link, tours } = job();
    void [site?.modelVersion, site?.changed, planning, link];
    untrack(() => tours.attend());
  });
}
