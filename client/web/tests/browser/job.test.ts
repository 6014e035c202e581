// A whole job by taps: opened, scanned, planned, refused, taken back, finished.
import { readFile } from "node:fs/promises";
import { afterAll, beforeAll, expect, test } from "vitest";
import { goTo, isAccessible, keepBothSizes, sendFile, Site } from "./harness";
import { Surveyor } from "./simulated_site";

const site = new Site();
beforeAll(() => site.start());
afterAll(async () => {
  await site.stop();
  expect(site.errors).toEqual([]);
});

test("a job from the first scan to 'enough'", async () => {
  const page = await site.tablet();
  const surveyor = new Surveyor();
  await page.getByRole("button", { name: "New job" }).tap();
  await page.getByLabel("Name of the job").fill("Flat by the canal");
  await page.getByRole("radio", { name: "Coarse, 5 cm" }).tap();
  await isAccessible(page, "a new job");
  await keepBothSizes(page, "new-job");
  await page.getByRole("button", { name: "Start" }).tap();

  await page.getByRole("heading", { name: "Make the first scan" }).waitFor();
  await isAccessible(page, "before the first scan");
  await sendFile(page, "kitchen.vrim", surveyor.first());
  await page.getByText("Scan here next").waitFor();
  const session = `sessions/${decodeURIComponent(/#\/([^/]+)/.exec(page.url())![1]!)}`;
  const { fleet, models, scans, plans, sessions } = site.api;

  let enough = false;
  let made = 1;
  for (; made < 7 && !enough; ++made) {
    await page.getByText(/aligns to \d+\smm/).waitFor();
    // The plan has ended: nothing improves any more.
    await page.getByText("Still improving").waitFor({ state: "detached" });
    if (made === 1) {
      await isAccessible(page, "the next place");
      await keepBothSizes(page, "next");
    }
    if (made === 2) {
      await page.getByRole("button", { name: "What's left" }).tap();
      await page.getByText(/About \d+ more scans?, \d+ (minutes|hours)/).waitFor();
      await page.getByRole("dialog").getByRole("button", { name: "Close", exact: true }).tap();
      // Nobody can stand there after all; and then they can.
      const before = (await plans.listRejections({ parent: session })).rejections.length;
      await page.getByRole("button", { name: "Can't stand here" }).tap();
      await isAccessible(page, "why nobody can stand there");
      await page.getByRole("button", { name: "Something is in the way" }).tap();
      await expect
        .poll(async () => (await plans.listRejections({ parent: session })).rejections.length)
        .toBe(before + 1);
      await page.getByRole("button", { name: "Undo" }).first().tap();
      await expect.poll(async () => (await plans.listRejections({ parent: session })).rejections.length).toBe(before);
      await page.getByText("Still improving").waitFor({ state: "detached" });
    }
    await page.getByRole("button", { name: "Scanning here" }).tap();
    const stations = async () => (await fleet.listStations({ parent: session })).stations;
    await expect.poll(async () => (await stations()).length).toBe(1);
    const [station] = await stations();
    await goTo(page, "Stations");
    await page.getByText("Made, data to come").waitFor();
    if (made === 1) {
      await isAccessible(page, "stations");
      await page.getByRole("button", { name: "Send a scan file" }).tap();
      await isAccessible(page, "sending a scan");
      await page.getByRole("dialog").getByRole("button", { name: "Close", exact: true }).tap();
    }
    await sendFile(page, `scan-${made + 1}.vrim`, surveyor.at(station!.position!));
    await expect
      .poll(
        async () =>
          (await scans.listScans({ parent: session })).scans.filter((scan) => scan.merge !== undefined).length,
        { timeout: 60_000 },
      )
      .toBe(made + 1);
    // The station's scan has come: it waits no more.
    await expect.poll(async () => (await stations()).length).toBe(0);
    await goTo(page, "Next");
    await page
      .getByText(/Scan here next|Done here|Nowhere left to stand|No place would align/)
      .first()
      .waitFor();
    await page.getByText("Still improving").waitFor({ state: "detached" });
    enough = (await page.getByText(/Enough scanned|Done here/).count()) > 0;
  }
  const coverage = (await models.getCoverage({ name: session })).coverage!;
  expect(coverage.estimatedCoverage).toBeGreaterThan(0.9);
  expect(coverage.roomsNotEnteredCount).toBe(0);
  await page.getByRole("button", { name: "What's left" }).tap();
  await page.getByText("of the surface is at full density").waitFor();
  await isAccessible(page, "what is left");
  await keepBothSizes(page, "left");
  await page.getByRole("button", { name: "Close", exact: true }).first().tap();

  // The plan: a place of one's own choice, in words.
  await goTo(page, "Plan");
  await page.getByRole("heading", { name: /Places to scan from|Scan here next/ }).waitFor();
  await isAccessible(page, "the plan");
  await keepBothSizes(page, "plan");
  // By keys alone: a station from the list, and the place in the middle of the plan.
  await page.getByRole("button", { name: "Station 1", exact: true }).press("Enter");
  await page.getByRole("heading", { name: "Station 1" }).waitFor();
  await page.getByRole("region", { name: "Details" }).getByRole("button", { name: "Close" }).press("Enter");
  await page.getByRole("img", { name: "Plan of the site" }).press("Enter");
  await page.getByRole("heading", { name: "What a scan here brings" }).waitFor();
  await page.getByRole("region", { name: "Details" }).getByRole("button", { name: "Close" }).press("Enter");
  const canvas = page.locator("canvas").first();
  const box = (await canvas.boundingBox())!;
  // Where no sign stands: a tap on one of those explains the sign.
  const close = page.getByRole("region", { name: "Details" }).getByRole("button", { name: "Close", exact: true });
  const tried = page.getByRole("heading", { name: "What a scan here brings" });
  for (const [x, y] of [
    [0.42, 0.62],
    [0.5, 0.5],
    [0.35, 0.4],
    [0.6, 0.45],
  ] as const) {
    await page.touchscreen.tap(box.x + x * box.width, box.y + y * box.height);
    await close.waitFor();
    if ((await tried.count()) > 0) break;
    await close.tap();
  }
  await tried.waitFor();
  await page.getByText("Working it out").waitFor({ state: "detached" });
  await isAccessible(page, "a place that was tried");
  await keepBothSizes(page, "trial");
  await close.tap();
  await page.getByRole("button", { name: "Where it pays" }).tap();
  await page.getByRole("button", { name: "What holds together" }).tap();
  await page.getByRole("button", { name: "Station 2", exact: true }).tap();
  await page.getByRole("heading", { name: "Station 2" }).waitFor();
  await isAccessible(page, "a station on the plan");
  await keepBothSizes(page, "heat");
  await page.getByRole("button", { name: "More about this scan" }).tap();
  await page.getByRole("dialog").getByRole("heading", { name: "Station 2" }).waitFor();
  await isAccessible(page, "a scan");
  await page.getByRole("dialog").getByRole("button", { name: "Close", exact: true }).tap();

  // An area with requirements of its own, corner by corner; and without it again.
  const regions = async () => (await sessions.getSession({ name: session })).session!.siteRules?.regions ?? [];
  await page.getByRole("button", { name: "Areas" }).tap();
  for (const [x, y] of [
    [0.4, 0.4],
    [0.6, 0.4],
    [0.5, 0.6],
  ] as const)
    await page.touchscreen.tap(box.x + x * box.width, box.y + y * box.height);
  await page.getByLabel("Name of the area").fill("Machine");
  await page.getByRole("radio", { name: "Twice as dense" }).tap();
  await isAccessible(page, "an area that is drawn");
  await page.getByRole("button", { name: "Keep this area" }).tap();
  await expect.poll(async () => (await regions()).map((region) => region.name)).toEqual(["Machine"]);
  expect((await regions())[0]!.requiredDensityPerM2).toBe(4 * 400);
  await page.getByRole("button", { name: "Remove" }).tap();
  await expect.poll(async () => (await regions()).length).toBe(0);

  await goTo(page, "3D");
  await expect
    .poll(async () => Number(await page.getByRole("img", { name: "The model in 3D" }).getAttribute("data-points")))
    .toBeGreaterThan(10_000);
  await isAccessible(page, "3D");
  await keepBothSizes(page, "solid");

  await goTo(page, "Job");
  await page.getByRole("heading", { name: "This tablet's scanner" }).waitFor();
  await isAccessible(page, "the job");
  await page.getByRole("radio", { name: "Dark" }).tap();
  await isAccessible(page, "the job, dark");
  await page.getByRole("button", { name: "Report" }).tap();
  await page.getByRole("table").waitFor();
  await isAccessible(page, "the report, dark");
  // The server's own, as a file.
  const [saved] = await Promise.all([
    page.waitForEvent("download"),
    page.getByRole("button", { name: "Save the whole report" }).tap(),
  ]);
  expect(saved.suggestedFilename()).toMatch(/\.html$/);
  const whole = await readFile(await saved.path(), "utf8");
  expect(whole).toContain("Sign-off sheet");
  expect(whole.trimEnd().endsWith("</html>")).toBe(true);
  // On paper it is as many pages as it needs, and it is still there afterwards.
  expect((await page.pdf({ format: "A4" })).length).toBeGreaterThan(10_000);
  await page.getByRole("dialog").getByRole("table").waitFor();
  await page.getByRole("button", { name: "Close", exact: true }).first().tap();
  await page.getByRole("radio", { name: "Deutsch" }).tap();
  await page.getByRole("heading", { name: "Was herauskommt" }).waitFor();
  await page.getByRole("navigation").getByText("Stationen", { exact: true }).tap();
  await isAccessible(page, "stations, dark, in German");
  await keepBothSizes(page, "stations-dark-de");
  await page.context().close();
}, 420_000);
