// A large site: an office of 1,000 m2 by the simulated scanner, coarse, so that it is made in seconds.
import { execFile } from "node:child_process";
import { existsSync } from "node:fs";
import { promisify } from "node:util";
import { afterAll, beforeAll, expect, test } from "vitest";
import { goTo, isAccessible, lying, Site } from "./harness";

const client = process.env.VANTAGE_CLIENT_BINARY ?? "../../build/release/client/cli/vantage";
const hasClient = existsSync(client);
if (!hasClient) console.log(`skipped on a large site: no ${client} (./dev build vantage)`);

const site = new Site();
beforeAll(async () => {
  if (hasClient) await site.start();
});
afterAll(async () => {
  await site.stop();
  expect(site.errors).toEqual([]);
});

test.skipIf(!hasClient)(
  "an office of 1,000 m2: next place, plan and 3D, which stays within its points while a thumb turns it",
  async () => {
    const options = "simulate --scene office --area 1000 --scans 6 --step 0.7 --density 100 --work 2000000 --no-hints";
    await promisify(execFile)(client, ["--server", site.address, ...options.split(" "), "--session", "office"]);
    const page = await site.tablet({}, "#/office/next");
    await page.getByText("Scan here next").waitFor();
    await page
      .getByText(/from station/)
      .first()
      .waitFor();
    await page.getByText(/Drawing the plan/).waitFor({ state: "detached" });
    await isAccessible(page, "the next place of a large site");
    await page.setViewportSize(lying);
    await goTo(page, "Plan");
    await page.getByRole("heading", { name: "Places to scan from" }).waitFor();
    await isAccessible(page, "the plan of a large site");
    await goTo(page, "3D");
    const canvas = page.getByRole("img", { name: "The model in 3D" });
    const points = async () => Number(await canvas.getAttribute("data-points"));
    await expect.poll(points, { timeout: 60_000 }).toBeGreaterThan(50_000);
    const pictures = async () => Number(await canvas.getAttribute("data-pictures"));
    const before = await pictures();
    const box = (await canvas.boundingBox())!;
    await page.mouse.move(box.x + 100, box.y + 100);
    await page.mouse.down();
    for (let k = 0; k < 30; ++k) {
      await page.mouse.move(box.x + 100 + 10 * k, box.y + 100 + 3 * k);
      expect(await points()).toBeLessThanOrEqual(500_000);
    }
    await page.mouse.up();
    expect(await pictures()).toBeGreaterThan(before);
    // By keys, too, and by the slider that cuts.
    for (const change of [
      () => canvas.press("ArrowLeft"),
      () => canvas.press("0"),
      () => page.getByRole("slider").fill("0.3"),
    ]) {
      const last = await pictures();
      await change();
      await expect.poll(pictures).toBeGreaterThan(last);
    }
    await isAccessible(page, "3D of a large site");
    await page.context().close();
  },
  180_000,
);
