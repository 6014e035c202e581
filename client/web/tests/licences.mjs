// licences.mjs FOLDER: each npm package that the page has parts of is named in FOLDER/licences.txt, with its version
// and the licence file that it comes with. What it has parts of is told by the source maps of a build of their own.
import { execFileSync } from "node:child_process";
import { mkdtempSync, readdirSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const said = readFileSync(join(process.argv[2] ?? "../../build/web", "licences.txt"), "utf8");
const folder = mkdtempSync(join(tmpdir(), "vantage-licences-"));
try {
  execFileSync("npx", ["vite", "build", "--sourcemap", "hidden", "--outDir", folder, "--logLevel", "error"], {
    stdio: ["ignore", "ignore", "inherit"],
  });
  const maps = readdirSync(join(folder, "assets")).filter((name) => name.endsWith(".map"));
  const sources = maps.flatMap((name) => JSON.parse(readFileSync(join(folder, "assets", name), "utf8")).sources);
  const names = new Set(sources.flatMap((path) => /.*node_modules\/((?:@[^/]+\/)?[^/]+)/.exec(path)?.[1] ?? []));
  // The page is written in Svelte: without it the maps told nothing.
  if (!names.has("svelte")) throw new Error(`${maps.length} source maps name ${[...names].join(", ") || "no package"}`);
  const missing = [];
  for (const name of names) {
    const home = join("node_modules", name);
    const { version } = JSON.parse(readFileSync(join(home, "package.json"), "utf8"));
    if (!said.includes(`\n== ${name} ${version} (`)) missing.push(`${name} ${version}`);
    const file = readdirSync(home).find((entry) => /^licen[cs]e/i.test(entry));
    const text = file === undefined ? "" : readFileSync(join(home, file), "utf8").trim();
    if (!said.includes(text)) missing.push(`the licence of ${name}`);
  }
  if (missing.length > 0) {
    console.error(`licences.txt lacks ${missing.join(", ")}`);
    process.exitCode = 1;
  } else {
    console.log(`licences: ${[...names].sort().join(", ")} are named`);
  }
} finally {
  rmSync(folder, { recursive: true, force: true });
}
