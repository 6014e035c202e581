// first_load.mjs FOLDER: what a browser fetches before the first screen stands, compressed, must be 300 kB at
// most. The page's own chunk, its style and one language; the rest comes when it is needed.
import { readFileSync, readdirSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";

const folder = process.argv[2] ?? "../../build/web";
const most = 300_000;
const assets = readdirSync(join(folder, "assets"));
const first = [
  "index.html",
  ...assets
    .filter((name) => /^(index|en)-.*\.(js|css)$/.test(name) || /^model\.worker-/.test(name))
    .map((name) => join("assets", name)),
];
const sizes = first.map((name) => [name, gzipSync(readFileSync(join(folder, name)), { level: 9 }).length]);
const sum = sizes.reduce((total, [, size]) => total + size, 0);
console.log(`first load: ${(sum / 1000).toFixed(0)} kB compressed, of ${most / 1000} kB`);
if (sum > most) {
  for (const [name, size] of sizes) console.error(`${name}: ${size}`);
  process.exit(1);
}
// Nothing comes from elsewhere.
for (const name of ["index.html", ...assets.map((asset) => join("assets", asset))]) {
  const text = readFileSync(join(folder, name), "latin1");
  const loads = text.match(
    /(?:src|href)="https?:\/\/[^"]*"|import\("https?:[^"]*"\)|@import[^;]*https?:[^;]*;|url\(["']?https?:[^)]*\)/g,
  );
  if (loads !== null) {
    console.error(`${name} loads from elsewhere: ${loads.join(" ")}`);
    process.exit(1);
  }
}
