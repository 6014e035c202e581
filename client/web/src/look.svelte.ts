// Light or dark: as the tablet is set, unless somebody chose on this page.
const stored = "vantage.look";

export type Choice = "auto" | "light" | "dark";

class Look {
  choice = $state<Choice>((localStorage.getItem(stored) as Choice | null) ?? "auto");
  #preferred = $state(matchMedia("(prefers-color-scheme: dark)").matches);
  readonly dark = $derived(this.choice === "auto" ? this.#preferred : this.choice === "dark");

  constructor() {
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", (event) => (this.#preferred = event.matches));
  }

  choose(choice: Choice): void {
    this.choice = choice;
    localStorage.setItem(stored, choice);
  }
}

export const look = new Look();
