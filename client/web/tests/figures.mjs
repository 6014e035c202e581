// figures.mjs: how soon the page shows a large site, answers a tap and tells what happened. It makes a job of an
// office of 1,000 m2 with the simulated scanner, so it takes minutes:
//
//   VANTAGE_BINARIES=../../build/release node tests/figures.mjs
import { spawn, execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, existsSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { chromium } from "playwright-core";

const binaries = process.env.VANTAGE_BINARIES ?? "../../build/release";
const binary = (path, name) => [join(binaries, path, name), join(binaries, name)].find((file) => existsSync(file));
const scans = process.env.VANTAGE_FIGURE_SCANS ?? "24";
const folder = mkdtempSync(join(tmpdir(), "vantage-figures-"));
const server = spawn(
  binary("server", "vantaged"),
  [
    "--in-memory",
    "--listen",
    "127.0.0.1:0",
    "--port-file",
    join(folder, "port"),
    "--web",
    "127.0.0.1:0",
    "--web-port-file",
    join(folder, "web-port"),
    "--web-root",
    "../../build/web",
    "--calls-per-second",
    "0",
    "--log-level",
    "off",
  ],
  { stdio: ["ignore", "ignore", "inherit"] },
);
let browser;
const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];
const figure = (name, value) => console.log(`${name} ${value.toFixed(value < 10 ? 2 : 0)}`);
try {
  while (!existsSync(join(folder, "port")) || readFileSync(join(folder, "port"), "utf8") === "")
    await new Promise((r) => setTimeout(r, 100));
  const address = `127.0.0.1:${readFileSync(join(folder, "port"), "utf8").trim()}`;
  execFileSync(
    binary("client/cli", "vantage"),
    [
      "--server",
      address,
      "simulate",
      "--scene",
      "office",
      "--area",
      "1000",
      "--scans",
      scans,
      "--session",
      "office",
      "--budget",
      "2",
      "--step",
      "0.5",
      "--density",
      "400",
      "--no-hints",
    ],
    { stdio: ["ignore", "ignore", "inherit"] },
  );
  const url = `http://127.0.0.1:${readFileSync(join(folder, "web-port"), "utf8").trim()}`;
  const call = async (method, body) => {
    const response = await fetch(`${url}/vantage.v1.${method}`, {
      method: "POST",
      headers: { "content-type": "application/json" },
      body: JSON.stringify(body),
    });
    return response.json();
  };
  browser = await chromium.launch({
    executablePath: process.env.VANTAGE_BROWSER ?? "/usr/bin/chromium",
    args: ["--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader"],
  });
  const open = async () => {
    const context = await browser.newContext({
      viewport: { width: 800, height: 1280 },
      hasTouch: true,
      locale: "en-GB",
    });
    return context.newPage();
  };
  // There is a plan by the time that somebody opens the page, as on the site.
  const warm = await open();
  await warm.goto(`${url}/#/office/next`);
  await warm
    .getByText(/aligns to|may not align|Nowhere|No place/)
    .first()
    .waitFor({ timeout: 60_000 });
  await warm.getByText("Still improving").waitFor({ state: "detached", timeout: 60_000 });
  await warm.context().close();

  const [first, drawn] = [[], []];
  for (let i = 0; i < 3; ++i) {
    const page = await open();
    const began = performance.now();
    await page.goto(`${url}/#/office/next`);
    await page
      .getByText(/from station/)
      .first()
      .waitFor();
    first.push((performance.now() - began) / 1000);
    await page.getByText(/Drawing the plan/).waitFor({ state: "detached", timeout: 120_000 });
    drawn.push((performance.now() - began) / 1000);
    if (i === 2) {
      // From a tap to the screen that it asks for.
      const taps = [];
      for (let k = 0; k < 9; ++k) {
        const [to, sign] = k % 2 === 0 ? ["Stations", "Send a scan file"] : ["Next", "What's left"];
        taps.push(
          await page.evaluate(
            ([name, text]) =>
              new Promise((resolve) => {
                const link = [...document.querySelectorAll("nav a")].find((a) => a.textContent.includes(name));
                const start = performance.now();
                link.click();
                const look = () =>
                  [...document.querySelectorAll("button")].some((b) => b.textContent.includes(text))
                    ? requestAnimationFrame(() => resolve(performance.now() - start))
                    : requestAnimationFrame(look);
                look();
              }),
            [to, sign],
          ),
        );
      }
      figure("page.tap.ms", median(taps));
      // From an event to the screen.
      await page.goto(`${url}/#/office/stations`);
      await page.getByText("Send a scan file").waitFor();
      await page.getByText("Live").waitFor();
      const updates = [];
      for (let k = 0; k < 5; ++k) {
        const made = await call("FleetService/CreateStation", {
          parent: "sessions/office",
          station: { position: { x: 0, y: 0.1 * k, z: 0 } },
        });
        const start = performance.now();
        await page.waitForFunction((n) => document.body.textContent.split("Not made after all").length > n, k + 1, {
          polling: "raf",
        });
        updates.push(Math.max(0, performance.now() - start));
        void made;
      }
      figure("page.update.ms", median(updates));
      await page.goto(`${url}/#/office/solid`);
      await page.getByText("Arranging the points").waitFor({ state: "detached", timeout: 60_000 });
      // A thumb that turns the model for five seconds; pictures are counted by the page itself.
      const canvas = page.locator("canvas.drawn");
      await page.waitForFunction(() => Number(document.querySelector("canvas.drawn")?.dataset.points) > 0);
      const box = await canvas.boundingBox();
      const state = () => page.evaluate(() => ({ ...document.querySelector("canvas.drawn").dataset }));
      await page.waitForTimeout(1000);
      const before = await state();
      figure("page.rest.points", Number(before.points));
      await page.mouse.move(box.x + 100, box.y + 200);
      await page.mouse.down();
      const start = performance.now();
      const points = [];
      for (let k = 0; performance.now() - start < 5000; ++k) {
        await page.mouse.move(box.x + 100 + ((3 * k) % 600), box.y + 200 + (k % 100));
        if (k % 10 === 0) points.push(Number((await state()).points));
      }
      const seconds = (performance.now() - start) / 1000;
      const after = await state();
      await page.mouse.up();
      figure("page.orbit.frames_per_second", (Number(after.pictures) - Number(before.pictures)) / seconds);
      figure("page.orbit.points", median(points));
    }
    await page.context().close();
  }
  figure("page.first_picture.1000m2.seconds", median(first));
  figure("page.whole_plan.1000m2.seconds", median(drawn));
} finally {
  await browser?.close();
  server.kill();
  rmSync(folder, { recursive: true, force: true });
}
