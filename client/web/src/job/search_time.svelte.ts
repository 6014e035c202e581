// How long a plan may take, s: as somebody chose on this tablet. Its first answer comes within a second and
// improves.
const stored = "vantage.search";

export type SearchTime = "quick" | "usual" | "thorough";
export const searchSeconds: Readonly<Record<SearchTime, number>> = { quick: 2, usual: 5, thorough: 20 };

class Search {
  time = $state<SearchTime>(read());

  choose(time: SearchTime): void {
    this.time = time;
    localStorage.setItem(stored, time);
  }

  get seconds(): number {
    return searchSeconds[this.time];
  }
}

function read(): SearchTime {
  const kept = localStorage.getItem(stored);
  return kept === "quick" || kept === "thorough" ? kept : "usual";
}

export const search = new Search();
