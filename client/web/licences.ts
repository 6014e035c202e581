// licences.txt beside the page: each npm package whose code is in it, with its version, licence and the texts that
// have to go along. Made from what was bundled, not from a list; where a text cannot be found, the build fails.
import { existsSync, readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { fileURLToPath } from "node:url";
import type { Plugin } from "vite";

interface Package {
  name: string;
  version: string;
  licence: string;
  text: string;
  // Of the sources that were bundled.
  notices: Set<string>;
}

// The package's folder that a module lies in; undefined: it is ours.
function folderOf(id: string): string | undefined {
  // What Vite puts in by itself.
  if (id.startsWith("\0vite/")) return fileURLToPath(new URL("node_modules/vite", import.meta.url));
  return /^.*\/node_modules\/(?:@[^/]+\/)?[^/]+/.exec(id.replace(/^\0/, "").replace(/\?.*$/, ""))?.[0];
}

function read(folder: string): Package {
  const about = JSON.parse(readFileSync(join(folder, "package.json"), "utf8")) as Record<string, unknown>;
  const [name, version, licence] = ["name", "version", "license"].map((key) => about[key]);
  if (typeof name !== "string" || typeof version !== "string" || typeof licence !== "string")
    throw new Error(`${folder} is bundled, and says no name, version or licence`);
  const file = readdirSync(folder).find((entry) => /^licen[cs]e(\.(md|txt))?$/i.test(entry));
  const whole = file === undefined ? "" : readFileSync(join(folder, file), "utf8");
  // Vite's own, without those of what it is made with, which is not in the page.
  const text = whole.split(/^# Licenses of bundled dependencies/m)[0]!.trim();
  return { name, version, licence, text, notices: new Set() };
}

// The comment that a source begins with, where it says whose it is.
function noticeOf(path: string): string | undefined {
  if (!existsSync(path)) return undefined;
  const lines = readFileSync(path, "utf8").split("\n");
  const end = lines.findIndex((line) => !line.startsWith("//"));
  const words = lines.slice(0, Math.max(0, end)).map((line) => line.replace(/^\/\/ ?/, ""));
  return /copyright/i.test(words.join(" ")) ? words.join("\n").trim() : undefined;
}

// The terms of an expression whose text has to be there; that of Apache 2.0 is our own licence.
function missingText(found: Package): boolean {
  const terms = found.licence.split(/\bAND\b|\bOR\b|[()]/).map((term) => term.trim());
  const others = terms.filter((term) => term !== "" && term !== "Apache-2.0");
  const said = [found.text, ...found.notices].join("\n");
  return others.length > 0 && !/Permission is hereby granted|Redistribution and use|Permission to use/.test(said);
}

export function licences(): { main: Plugin; worker: () => Plugin } {
  const found = new Map<string, Package>();
  const collect: Plugin["generateBundle"] = (_, bundle) => {
    for (const chunk of Object.values(bundle)) {
      if (chunk.type !== "chunk") continue;
      for (const [id, module] of Object.entries(chunk.modules)) {
        const folder = module.renderedLength > 0 ? folderOf(id) : undefined;
        if (folder === undefined) continue;
        const known = found.get(folder) ?? read(folder);
        found.set(folder, known);
        const notice = noticeOf(id.replace(/\?.*$/, ""));
        if (notice !== undefined) known.notices.add(notice);
      }
    }
  };
  return {
    worker: () => ({ name: "licences-of-workers", generateBundle: collect }),
    main: {
      name: "licences",
      apply: "build",
      generateBundle(options, bundle, isWrite) {
        collect.call(this, options, bundle, isWrite);
        const packages = [...found.values()].sort((a, b) => (a.name < b.name ? -1 : 1));
        for (const one of packages) if (missingText(one)) this.error(`the licence of ${one.name} has no text`);
        const source = [
          "The page has parts of these packages of npm. Where it is the Apache License 2.0, its text is that",
          "of Vantage itself, in the file LICENSE; on Debian it is in /usr/share/common-licenses/Apache-2.0.",
          ...packages.flatMap(({ name, version, licence, text, notices }) => [
            `\n== ${name} ${version} (${licence.replace(/^\((.*)\)$/, "$1")})\n`,
            [...new Set([text, ...notices])].filter((words) => words !== "").join("\n\n"),
          ]),
        ].join("\n");
        this.emitFile({ type: "asset", fileName: "licences.txt", source: `${source}\n` });
      },
    },
  };
}
