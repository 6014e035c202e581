// Where on the page somebody is, in the address behind '#': the job and the screen.
export type Screen = "next" | "plan" | "stations" | "solid" | "job";
const screens: readonly Screen[] = ["next", "plan", "stations", "solid", "job"];

export interface Route {
  // sessions/{session}; empty: the list of jobs.
  job: string;
  screen: Screen;
}

export function readRoute(hash: string): Route {
  const [, id = "", screen = ""] = hash.replace(/^#/, "").split("/");
  return {
    job: id === "" ? "" : `sessions/${decodeURIComponent(id)}`,
    screen: screens.find((known) => known === screen) ?? "next",
  };
}

export function address(job: string, screen: Screen = "next"): string {
  return job === "" ? "#/" : `#/${encodeURIComponent(job.replace(/^sessions\//, ""))}/${screen}`;
}

class Place {
  now = $state.raw<Route>(readRoute(location.hash));
  constructor() {
    window.addEventListener("hashchange", () => (this.now = readRoute(location.hash)));
  }
  go(job: string, screen: Screen = "next"): void {
    location.hash = address(job, screen);
  }
}

export const place = new Place();
