// Links that break, servers that die, tablets that meet, scans that do not fit.
import { afterAll, beforeAll, expect, test } from "vitest";
import { create } from "@bufbuild/protobuf";
import { SessionSchema } from "../../src/gen/vantage/v1/session_pb";
import { ScanState } from "../../src/gen/vantage/v1/scan_pb";
import { presets } from "../../src/words/presets";
import { goTo, isAccessible, keepPicture, sendFile, Site } from "./harness";
import { Surveyor } from "./simulated_site";

const site = new Site();
beforeAll(() => site.start());
afterAll(async () => {
  await site.stop();
  expect(site.errors).toEqual([]);
});

test("the server dies in the middle of an upload and comes back: the scan arrives once; what was done meanwhile is sent once", async () => {
  const session = await site.newJob("power-cut");
  const page = await site.tablet({}, "#/power-cut/stations");
  const surveyor = new Surveyor();
  await sendFile(page, "first.vrim", surveyor.first());
  await expect.poll(() => site.mergedIn(session), { timeout: 30_000 }).toBe(1);
  await goTo(page, "Next");
  await page.getByText(/aligns to/).waitFor();
  await page.getByText("Still improving").waitFor({ state: "detached" });
  await page.getByRole("button", { name: "Scanning here" }).tap();
  await expect.poll(async () => (await site.api.fleet.listStations({ parent: session })).stations.length).toBe(1);
  const station = (await site.api.fleet.listStations({ parent: session })).stations[0]!;

  // Killed after the second piece.
  let pieces = 0;
  await page.route("**/vantage.v1.ScanService/UploadPiece", async (route) => {
    pieces += 1;
    if (pieces === 3) await site.killServer();
    await route.continue();
  });
  await goTo(page, "Stations");
  await sendFile(page, "second.vrim", surveyor.at(station.position!));
  await page.getByText(/No connection\. It goes on by itself/).waitFor();
  await page.getByText(/No connection,/).waitFor();
  await page.getByText(/\d+ sec old/).waitFor();

  // What somebody does meanwhile waits, and says so.
  await goTo(page, "Next");
  const place = () => page.locator(".find").first().textContent();
  const refused = await place();
  await page.getByRole("button", { name: "Can't stand here" }).tap();
  await page.getByRole("button", { name: "Not safe" }).tap();
  await page.getByText("1 entry waits to be sent").waitFor();
  // The place is not shown any more, although no server has heard of it.
  expect(await place()).not.toBe(refused);
  await isAccessible(page, "without a connection");
  // The tab is opened anew: what waits is still there.
  await site.startServer();
  await page.getByText("Live").waitFor({ timeout: 60_000 });
  await expect.poll(() => site.mergedIn(session), { timeout: 60_000 }).toBe(2);
  const rejections = async () => (await site.api.plans.listRejections({ parent: session })).rejections;
  await expect.poll(async () => (await rejections()).length, { timeout: 30_000 }).toBe(1);
  expect((await rejections())[0]!.reason).toBe("Not safe");
  expect((await site.scansOf(session)).length).toBe(2);
  await page.context().close();
}, 240_000);

test("a second tablet claims first: the other is told; what is free again can be kept", async () => {
  const session = await site.newJob("two-crews");
  for (const scannerId of ["red", "blue"]) {
    await site.api.fleet.createScanner({ parent: session, scannerId, scanner: { displayName: scannerId } });
  }
  const page = await site.tablet({}, "#/two-crews/job");
  await page.getByRole("radio", { name: "red" }).tap();
  await goTo(page, "Stations");
  await sendFile(page, "first.vrim", new Surveyor().first());
  await expect.poll(() => site.mergedIn(session), { timeout: 30_000 }).toBe(1);
  await goTo(page, "Next");
  await page.getByText(/aligns to/).waitFor();
  await page.getByText("Still improving").waitFor({ state: "detached" });
  // Blue takes the very place between the plan and red's tap: red has not heard of it yet.
  let place: { x: number; y: number; z: number } | undefined;
  await page.route("**/vantage.v1.FleetService/ClaimView", async (route) => {
    if (place === undefined) {
      const plan = (await site.api.plans.listPlans({ parent: session })).plans.at(-1)!;
      const full = (await site.api.plans.getPlan({ name: plan.name })).plan!;
      const { x, y, z } = full.result!.views[0]!.position!;
      place = { x, y, z };
      await site.api.fleet.claimView({ parent: session, scanner: `${session}/scanners/blue`, position: place });
    }
    await route.continue();
  });
  await page.getByRole("button", { name: "Keep this place for me" }).tap();
  await page.getByText(/blue has this place until/).waitFor();
  const before = (await site.api.plans.listPlans({ parent: session })).plans.length;
  const blues = (await site.api.fleet.listClaims({ parent: session })).claims;
  expect(blues.map((claim) => claim.scanner)).toEqual([`${session}/scanners/blue`]);
  // Blue gives it back, and the page hears of it; then red keeps a place, and it stays red's.
  await site.api.fleet.releaseClaim({ name: blues[0]!.name });
  const knows = async () => {
    const { plans } = await site.api.plans.listPlans({ parent: session });
    const last = plans.at(-1);
    return last?.endTime !== undefined && plans.length > before;
  };
  await expect.poll(knows, { timeout: 30_000 }).toBe(true);
  await page.getByText("Still improving").waitFor({ state: "detached" });
  await page
    .getByText(/aligns to/)
    .first()
    .waitFor();
  await page.getByRole("button", { name: "Keep this place for me" }).tap();
  await page.getByText("Kept for you").waitFor();
  const claims = (await site.api.fleet.listClaims({ parent: session })).claims;
  expect(claims.map((claim) => claim.scanner)).toEqual([`${session}/scanners/red`]);
  await page.getByText("Still improving").waitFor({ state: "detached" });
  await page.getByRole("button", { name: "Give this place back" }).tap();
  await expect.poll(async () => (await site.api.fleet.listClaims({ parent: session })).claims.length).toBe(0);
  await page.context().close();
}, 120_000);

test("the next morning the page offers to begin where a scan fits the earlier ones best", async () => {
  const session = await site.newJob("morning");
  const page = await site.tablet({}, "#/morning/stations");
  await sendFile(page, "first.vrim", new Surveyor().first());
  await expect.poll(() => site.mergedIn(session), { timeout: 30_000 }).toBe(1);
  await goTo(page, "Next");
  const decided = async () => {
    await page.getByText(/aligns to/).waitFor();
    await page.getByText("Still improving").waitFor({ state: "detached" });
  };
  await decided();
  const offer = page.getByRole("button", { name: /A new day: begin where/ });
  expect(await offer.count()).toBe(0);

  await page.clock.setFixedTime(Date.now() + 12 * 3600 * 1000);
  await page.reload();
  await decided();
  await offer.waitFor();
  await keepPicture(page, "morning");
  await offer.tap();
  const { plans } = await site.api.plans.listPlans({ parent: session });
  const { views } = (await site.api.plans.getPlan({ name: plans.at(-1)!.name })).plan!.result!;
  const overlaps = views.map((view) => view.verdict?.overlapShare ?? 0);
  const best = overlaps.indexOf(Math.max(...overlaps));
  expect(best).toBeGreaterThan(0);
  await page.getByRole("heading", { name: `Choice ${best + 1} of ${views.length}` }).waitFor();
  expect(await offer.count()).toBe(0);
  await page.context().close();
}, 120_000);

test("a scan in doubt is decided on: shown where it fits, accepted or left out", async () => {
  const session = await site.newJob("doubt");
  const page = await site.tablet({}, "#/doubt/stations");
  const surveyor = new Surveyor();
  await sendFile(page, "first.vrim", surveyor.first());
  await expect.poll(() => site.mergedIn(session), { timeout: 30_000 }).toBe(1);
  // From the depth of the other room, which the first scan hardly saw through the door, and nobody says where.
  for (const name of ["lost-1.vrim", "lost-2.vrim"]) {
    await page.getByRole("button", { name: "Send a scan file" }).tap();
    await page.getByRole("radio", { name: "I don't know" }).tap();
    const bytes = surveyor.inFlat({ x: name === "lost-1.vrim" ? 8.2 : 7.9, y: 3.3, z: 1.5 });
    await page.locator('input[type="file"]').setInputFiles({ name, mimeType: "", buffer: Buffer.from(bytes) });
    await expect
      .poll(
        async () =>
          (await site.scansOf(session)).filter((scan) =>
            [ScanState.DOUBTFUL, ScanState.FAILED, ScanState.MERGED].includes(scan.state),
          ).length,
        { timeout: 30_000 },
      )
      .toBeGreaterThan(name === "lost-1.vrim" ? 1 : 2);
  }
  expect(
    (await site.scansOf(session)).map((scan) => scan.state === ScanState.DOUBTFUL || scan.state === ScanState.FAILED),
  ).toEqual([false, true, true]);
  await page.getByRole("heading", { name: "Does not fit: decide" }).waitFor();
  await page.getByRole("button", { name: /lost-1/ }).tap();
  // Every pose at which it may have been made is shown, with what fits there and what does not.
  await page.getByRole("radio", { name: /where it fits best.* of it lies on what is scanned/ }).waitFor();
  const shown = (await site.api.scans.compareScanPoses({ name: (await site.scansOf(session))[1]!.name })).comparison!;
  const poses = page.getByRole("radiogroup", { name: "Where was it made?" }).getByRole("radio");
  await expect.poll(() => poses.count()).toBe(shown.poses.length);
  for (const [i, pose] of shown.poses.entries()) {
    const words = (await poses.nth(i).textContent())!;
    const [, share] = /(\d+)\s% of it lies/.exec(words) ?? [];
    expect(Math.abs(Number(share) / 100 - pose.overlapShare)).toBeLessThan(0.03);
    expect(/✕/.test(words)).toBe(pose.disagreements.some((other) => other.areaM2 >= 0.05));
  }
  await isAccessible(page, "a scan in doubt");
  await page.getByRole("button", { name: "It was made at A" }).tap();
  await expect.poll(() => site.mergedIn(session), { timeout: 30_000 }).toBe(2);
  await page.getByRole("button", { name: /lost-2/ }).tap();
  await page.getByRole("button", { name: "Show its place" }).tap();
  await page.getByRole("button", { name: "Turn left by 15 degrees" }).tap();
  await isAccessible(page, "a scan that is placed by hand");
  // A tap puts it there, a thumb drags it on; the server gets the place and the turn.
  const second = (await site.scansOf(session))[2]!;
  const plan = (await page.getByRole("img", { name: "Plan with the places" }).boundingBox())!;
  const middle = { x: plan.x + plan.width / 2, y: plan.y + plan.height / 2 };
  await page.touchscreen.tap(middle.x, middle.y);
  await page.mouse.move(middle.x, middle.y);
  await page.mouse.down();
  await page.mouse.move(middle.x + 90, middle.y, { steps: 5 });
  await page.mouse.up();
  await page.getByRole("button", { name: "Align it from here" }).tap();
  const placed = async () => (await site.scansOf(session))[2]!;
  await expect.poll(async () => (await placed()).prior?.pose !== undefined, { timeout: 20_000 }).toBe(true);
  const prior = (await placed()).prior!.pose!;
  const turn = (q: { w: number; z: number }) => 2 * Math.atan2(q.z, q.w);
  const by = turn(prior.rotation!) - turn(second.registration!.pose!.rotation!);
  expect(Math.cos(by - Math.PI / 12)).toBeGreaterThan(0.99);
  const from = second.registration!.pose!.translation!;
  expect(Math.hypot(prior.translation!.x - from.x, prior.translation!.y - from.y)).toBeGreaterThan(0.2);
  // It does not fit there: the decision is still to be made.
  await expect
    .poll(async () => [ScanState.DOUBTFUL, ScanState.FAILED].includes((await placed()).state), { timeout: 30_000 })
    .toBe(true);
  await page.getByRole("button", { name: /lost-2/ }).tap();
  await page.getByRole("button", { name: "Leave it out" }).tap();
  await page.getByRole("alertdialog").getByRole("button", { name: "Leave it out" }).tap();
  await expect
    .poll(async () => (await site.scansOf(session)).filter((scan) => scan.state === ScanState.WITHDRAWN).length)
    .toBe(1);
  await page.context().close();
}, 120_000);

test("what is no scan, and a job that is deleted while it is shown, are told in plain words", async () => {
  const session = await site.newJob("wrong");
  const page = await site.tablet({}, "#/wrong/stations");
  // Of the right size, and none all the same: the server finds out.
  const noise = new Surveyor().first();
  noise.fill(0x55, 4000, 400_000);
  await sendFile(page, "noise.vrim", noise);
  await page.getByText("The file arrived, but it is no sound scan.").waitFor();
  expect((await site.scansOf(session)).length).toBe(0);
  await site.api.sessions.deleteSession({ name: session });
  await page.getByText("This job is no longer on the server.").first().waitFor();
  await isAccessible(page, "a job that is gone");
  await page.context().close();
}, 120_000);

test("a page that is hidden holds no connection, and goes on where it was when it is shown", async () => {
  const session = await site.newJob("hidden");
  const page = await site.tablet();
  const streams = { open: 0, begun: 0 };
  const isWatch = (url: string) => url.includes("/WatchSession");
  page.on("request", (request) => {
    if (!isWatch(request.url())) return;
    streams.open += 1;
    streams.begun += 1;
  });
  for (const end of ["requestfinished", "requestfailed"] as const) {
    page.on(end as "requestfailed", (request) => {
      if (isWatch(request.url())) streams.open -= 1;
    });
  }
  const setHidden = (hidden: boolean) =>
    page.evaluate((value) => {
      Object.defineProperty(document, "hidden", { configurable: true, get: () => value });
      document.dispatchEvent(new Event("visibilitychange"));
    }, hidden);
  await page.goto(`${site.url}#/hidden/stations`);
  await page.getByText("Live").waitFor();
  await expect.poll(() => streams.open).toBe(1);
  await setHidden(true);
  await expect.poll(() => streams.open).toBe(0);
  // What happens meanwhile is there when the page is shown again.
  await site.api.fleet.createScanner({ parent: session, scannerId: "red", scanner: { displayName: "red" } });
  expect(streams.begun).toBe(1);
  await setHidden(false);
  await expect.poll(() => streams.open).toBe(1);
  await goTo(page, "Job");
  await page.getByRole("radio", { name: "red" }).waitFor();
  await page.context().close();
}, 60_000);

test("the server takes every instrument that the page offers", async () => {
  for (const { id, settings } of presets) {
    for (const setting of ["", ...settings]) {
      const session = create(SessionSchema, {
        scannerModels: [{ preset: id, setting }],
        planningConfig: { requiredDensityPerM2: 400 },
      });
      const made = (await site.api.sessions.createSession({ session })).session!;
      // The usual setting is the first in the list.
      if (setting === "") expect(made.scannerModels[0]!.setting).toBe(settings[0]);
      await site.api.sessions.deleteSession({ name: made.name });
    }
  }
});
