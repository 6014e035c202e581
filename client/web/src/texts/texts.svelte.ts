// What the page says, in the language of whoever holds it. The sentences are in en.json and de.json,
// which have the same keys and the same names in braces (tests/unit/texts.test.ts).
import type english from "./en.json";

export type Key = keyof typeof english;
export type Parameters = Record<string, string | number>;
export type Language = "en" | "de";

export const languages: readonly Language[] = ["en", "de"];

const stored = "vantage.language";

class Texts {
  language = $state<Language>("en");
  // How numbers and times are written: as where the tablet comes from, if that speaks the language.
  readonly locale = $derived(
    navigator.languages.find((tag) => tag.toLowerCase().startsWith(this.language)) ??
      (this.language === "en" ? "en-GB" : this.language),
  );
  #sentences = $state<Record<string, string>>({});

  async load(language: Language): Promise<void> {
    const file = language === "de" ? await import("./de.json") : await import("./en.json");
    this.#sentences = file.default;
    this.language = language;
    document.documentElement.lang = language;
  }

  say(key: Key, parameters: Parameters = {}): string {
    return fill(this.#sentences[key] ?? key, parameters, this.language);
  }
}

// Puts parameters into a sentence: {name} is replaced, and of {name|one|other} the form that the
// number asks for is taken.
export function fill(sentence: string, parameters: Parameters, language: string): string {
  return sentence.replace(/\{(\w+)(?:\|([^|}]*)\|([^|}]*))?\}/g, (whole, name, one, other) => {
    const value = parameters[name];
    if (value === undefined) return whole;
    if (one === undefined) return String(value);
    return new Intl.PluralRules(language).select(Number(value)) === "one" ? one : other;
  });
}

export const texts = new Texts();

export function t(key: Key, parameters?: Parameters): string {
  return texts.say(key, parameters);
}

// The language that was chosen on this tablet, else the first of the browser's that there is.
export function preferredLanguage(): Language {
  const candidates = [localStorage.getItem(stored) ?? "", ...navigator.languages];
  for (const candidate of candidates) {
    const match = languages.find((language) => candidate.toLowerCase().startsWith(language));
    if (match !== undefined) return match;
  }
  return "en";
}

export async function chooseLanguage(language: Language): Promise<void> {
  localStorage.setItem(stored, language);
  await texts.load(language);
}
