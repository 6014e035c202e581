import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, test } from "vitest";
import english from "../../src/texts/en.json";
import german from "../../src/texts/de.json";
import { fill } from "../../src/texts/texts.svelte";

const names = (sentence: string) => [...new Set([...sentence.matchAll(/\{(\w+)/g)].map((match) => match[1]))].sort();

test("both languages have the same texts with the same names in them", () => {
  expect(Object.keys(german).sort()).toEqual(Object.keys(english).sort());
  for (const [key, sentence] of Object.entries(english)) {
    expect(names((german as Record<string, string>)[key]!), key).toEqual(names(sentence));
  }
});

test("numbers choose the form of a word", () => {
  expect(fill("{n} {n|scan is|scans are} here", { n: 1 }, "en")).toBe("1 scan is here");
  expect(fill("{n} {n|scan is|scans are} here", { n: 0 }, "en")).toBe("0 scans are here");
  expect(fill("{unknown} stays", {}, "en")).toBe("{unknown} stays");
});

const sources = (folder: string): string[] =>
  readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
    const path = join(folder, entry.name);
    if (entry.isDirectory()) return entry.name === "gen" ? [] : sources(path);
    return /\.(svelte|ts)$/.test(entry.name) ? [readFileSync(path, "utf8")] : [];
  });

test("every text is used", () => {
  const all = sources("src").join("\n");
  const built = /^(nav|look|action|outcome|search|find\.wall|align\.why)\./;
  const unused = Object.keys(english).filter((key) => !built.test(key) && !all.includes(`"${key}"`));
  expect(unused).toEqual([]);
});

test("no text stands in the components themselves", () => {
  for (const source of sources("src").filter((text) => text.includes("<script"))) {
    const markup = source.replace(/<script[\s\S]*?<\/script>|<style[\s\S]*?<\/style>|<!--[\s\S]*?-->/g, "");
    const words = markup.match(/>[^<>{}]*[A-Za-z]{3,}[^<>{}]*</g) ?? [];
    expect(words.filter((found) => !/Vantage/.test(found) && !/=>|\?|&&|=/.test(found))).toEqual([]);
  }
});

test("no text speaks of what is inside", () => {
  const inside = /voxel|viewcell|registration|pose|frontier|occlusion|session|RPC|brick|octree|Voxel|Pose/i;
  for (const [key, sentence] of Object.entries(english)) expect(sentence, key).not.toMatch(inside);
});
