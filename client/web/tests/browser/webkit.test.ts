// The main path of a job in WebKit, which is what many tablets have and nothing else.
import { writeFileSync } from "node:fs";
import { join } from "node:path";
import { afterAll, beforeAll, expect, test } from "vitest";
import { Site } from "./harness";
import { Surveyor } from "./simulated_site";
import { hasWebKit, WebKit } from "./webkit";

const site = new Site();
const browser = new WebKit();
if (!hasWebKit) console.log("skipped in WebKit: no WebKitWebDriver or no Xvfb (./dev install web)");
beforeAll(async () => {
  if (!hasWebKit) return;
  await site.startServer();
  await browser.start();
});
afterAll(async () => {
  await browser.stop();
  await site.stop();
});

test.skipIf(!hasWebKit)(
  "in WebKit: a job is opened, a scan is sent, the three buttons do what they say",
  async () => {
    const surveyor = new Surveyor();
    const file = (name: string, bytes: Uint8Array) => {
      const path = join(site.folder, name);
      writeFileSync(path, bytes);
      return path;
    };
    await browser.open(site.url);
    // Errors of the page, from here on, and short searches.
    await browser.run(
      `window.troubles = []; addEventListener("error", (e) => troubles.push(e.message));
       addEventListener("unhandledrejection", (e) => troubles.push(String(e.reason)));
       localStorage.setItem("vantage.search", "quick");`,
    );
    await browser.press("New job");
    await browser.type("Name of the job", "Flat in WebKit");
    await browser.press("Coarse, 5 cm");
    await browser.press("Start");
    await browser.see("Make the first scan");
    await browser.press("Send a scan file");
    await browser.pick(file("kitchen.vrim", surveyor.first()));
    await browser.see("Scan here next");
    await browser.see("aligns to");
    await browser.gone("Still improving");

    const { sessions, fleet, plans, scans } = site.api;
    const session = (await sessions.listSessions({})).sessions[0]!.name;
    const merged = async () =>
      (await scans.listScans({ parent: session })).scans.filter((scan) => scan.merge !== undefined).length;
    // Pictures are drawn: the plan, and what the last station sees.
    const drawn = `return [...document.querySelectorAll("canvas")].map((canvas) => {
      const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
      const colours = new Set();
      for (let i = 0; i < data.length; i += 404) colours.add(data[i] << 16 | data[i + 1] << 8 | data[i + 2]);
      return colours.size; })`;
    await expect
      .poll(async () => (await browser.run<number[]>(drawn)).every((colours) => colours > 4), { timeout: 20_000 })
      .toBe(true);

    await browser.press("What's left");
    await browser.see("of the surface is at full density");
    await browser.press("Close");
    await browser.press("Can't stand here");
    await browser.press("Something is in the way");
    await expect
      .poll(async () => (await plans.listRejections({ parent: session })).rejections.length, { timeout: 20_000 })
      .toBe(1);
    await browser.see("aligns to");
    await browser.gone("Still improving");
    await browser.press("Scanning here");
    const stations = async () => (await fleet.listStations({ parent: session })).stations;
    await expect.poll(async () => (await stations()).length, { timeout: 20_000 }).toBe(1);
    const [station] = await stations();
    await browser.press("Stations");
    await browser.see("Made, data to come");
    await browser.press("Send a scan file");
    await browser.pick(file("second.vrim", surveyor.at(station!.position!)));
    await expect.poll(merged, { timeout: 60_000 }).toBe(2);
    await browser.see("In the model");

    await browser.press("3D");
    await expect
      .poll(() => browser.run<number>(`return Number(document.querySelector("canvas.drawn").dataset.points ?? 0)`), {
        timeout: 30_000,
      })
      .toBeGreaterThan(1000);
    if (process.env.VANTAGE_SCREENSHOTS !== undefined) {
      await browser.picture(join(process.env.VANTAGE_SCREENSHOTS, "webkit-solid.png"));
    }
    expect(await browser.run("return troubles")).toEqual([]);
  },
  180_000,
);
