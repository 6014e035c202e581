// Uploads that failed and that somebody on this tablet has read about: they are told of no more.
import { SvelteSet } from "svelte/reactivity";

const key = "vantage.dismissed";
// The server forgets them, too.
const most = 64;

function stored(): string[] {
  try {
    const names: unknown = JSON.parse(localStorage.getItem(key) ?? "[]");
    return Array.isArray(names) ? names.filter((name) => typeof name === "string") : [];
  } catch {
    return [];
  }
}

class Dismissed {
  readonly #names = new SvelteSet<string>(typeof localStorage === "undefined" ? [] : stored());

  has(name: string): boolean {
    return this.#names.has(name);
  }

  add(name: string): void {
    this.#names.add(name);
    localStorage.setItem(key, JSON.stringify([...this.#names].slice(-most)));
  }
}

export const dismissed = new Dismissed();
