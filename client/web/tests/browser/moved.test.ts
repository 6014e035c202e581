// What was moved between scans, and doors that have to stay open, on the page.
import { create, fromBinary, toBinary } from "@bufbuild/protobuf";
import { afterAll, beforeAll, expect, test } from "vitest";
import { OpenDoorSchema } from "../../src/gen/vantage/v1/plan_pb";
import { GetPlanResponseSchema } from "../../src/gen/vantage/v1/plan_service_pb";
import { SiteChangeKind } from "../../src/gen/vantage/v1/scan_pb";
import { SessionSchema } from "../../src/gen/vantage/v1/session_pb";
import { goTo, isAccessible, keepPicture, sendFile, Site } from "./harness";
import { Surveyor } from "./simulated_site";

const site = new Site();
beforeAll(() => site.start());
afterAll(async () => {
  await site.stop();
  expect(site.errors).toEqual([]);
});

test("a cupboard that came is told where a scan's gain is, listed with its size, and on the plan", async () => {
  const session = "sessions/moved";
  await site.api.sessions.createSession({
    sessionId: "moved",
    session: create(SessionSchema, { displayName: "moved", planningConfig: { requiredDensityPerM2: 400 } }),
  });
  const scans = async () => (await site.api.scans.listScans({ parent: session })).scans;
  const page = await site.tablet({}, "#/moved/stations");
  const surveyor = new Surveyor();
  await sendFile(page, "first.vrim", surveyor.first());
  const mergedCount = async () => (await scans()).filter((scan) => scan.merge !== undefined).length;
  await expect.poll(mergedCount, { timeout: 60_000 }).toBe(1);

  // A cupboard of 0.9 m by 0.5 m, 1.6 m high, where there was free floor.
  surveyor.things = [[3.6, 2.9, 0, 4.5, 3.4, 1.6]];
  // From where somebody stood, so that the page offers it as the scan's place.
  const position = { x: 0.8, y: 0.2, z: 0 };
  await site.api.fleet.createStation({ parent: session, station: { position } });
  await page.getByText("Made, data to come").waitFor();
  await sendFile(page, "second.vrim", surveyor.at(position));
  // By another hand than the page's: what the server says is what the page has to show.
  await expect.poll(mergedCount, { timeout: 60_000 }).toBe(2);
  const changes = (await scans())[1]!.merge!.changes;
  expect(changes.map(({ kind }) => kind)).toContain(SiteChangeKind.CAME);
  const sentence = page.getByText(/Since earlier scans .*\d+ things? came/);
  await sentence.first().waitFor();

  await page.getByRole("button", { name: /second/ }).tap();
  await page.getByRole("heading", { name: "Moved since earlier scans" }).waitFor();
  expect(await page.getByRole("dialog").locator(".changes li").count()).toBe(changes.length);
  await page
    .getByText(/New since station 1 · \d\.\d\sm long, \d\.\d\sm high · \d\.\d\sm from this station/)
    .first()
    .waitFor();
  await isAccessible(page, "what was moved");
  await keepPicture(page, "moved-sheet");
  await page.getByRole("dialog").getByRole("button", { name: "Close", exact: true }).tap();

  // On the plan beside the station, by keys alone.
  await goTo(page, "Plan");
  await page.getByRole("button", { name: "Station 2", exact: true }).press("Enter");
  await sentence.first().waitFor();
  await keepPicture(page, "moved-plan");
  await page.context().close();
}, 120_000);

test("a door that a plan asks to leave open is said on the first screen and marked on the plan", async () => {
  const session = "sessions/doors";
  await site.api.sessions.createSession({
    sessionId: "doors",
    session: create(SessionSchema, { displayName: "doors", planningConfig: { requiredDensityPerM2: 400 } }),
  });
  const surveyor = new Surveyor();
  // The flat's door, where the job's frame has it: whether a plan depends on it is the planner's to say.
  const [dx, dy] = [5.05 - surveyor.start.x, 2 - surveyor.start.y];
  const [c, s] = [Math.cos(surveyor.heading), Math.sin(surveyor.heading)];
  const centre = { x: c * dx + s * dy, y: c * dy - s * dx, z: -1.5 };
  const page = await site.tablet({}, "#/doors/stations");
  await sendFile(page, "first.vrim", surveyor.first());
  await expect
    .poll(async () => (await site.api.scans.listScans({ parent: session })).scans.some((scan) => scan.merge), {
      timeout: 60_000,
    })
    .toBe(true);
  await goTo(page, "Next");
  await page.getByText(/aligns to \d+\smm/).waitFor();
  await page.getByText("Still improving").waitFor({ state: "detached" });
  // The plan as a page has it that is opened now.
  await page.route("**/vantage.v1.PlanService/GetPlan", async (route) => {
    const response = await route.fetch();
    const { plan, ...rest } = fromBinary(GetPlanResponseSchema, await response.body());
    for (const view of plan?.result?.views ?? [])
      view.openDoors = [create(OpenDoorSchema, { centre, widthM: 1, overlapShare: 0.7 })];
    const body = Buffer.from(toBinary(GetPlanResponseSchema, { ...rest, plan }));
    await route.fulfill({ response, body });
  });
  // And no other after it, which would not have been given the door.
  await page.route(/PlanService\/(CreatePlan|WatchPlan)$/, (route) => route.abort());
  await page.reload();
  await page.getByText("Leave the marked door open: most of what aligns this scan is seen through it.").waitFor();
  await isAccessible(page, "a door to leave open");
  await keepPicture(page, "door-next");
  await goTo(page, "Plan");
  await page.getByRole("button", { name: "Leave this door open" }).press("Enter");
  await page.getByText(/It is 1\.0\sm wide\. Until the scan is made, 70\s% of what aligns it/).waitFor();
  await keepPicture(page, "door-plan");
  await page.context().close();
}, 120_000);
