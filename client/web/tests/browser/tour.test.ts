// What is known before the first scan, and the rest of the job as a route: a floor plan as a picture, placed, aligned by
// the scans and taken out again; what is left in half an hour.
import { afterAll, beforeAll, expect, test } from "vitest";
import type { Locator, Page } from "playwright-core";
import { fit, toScreen, type Point } from "../../src/draw/projection";
import { goTo, isAccessible, keepBothSizes, sendFile, Site } from "./harness";
import { drawn, floorPlanPicture, inPicture, Surveyor } from "./simulated_site";

const site = new Site();
beforeAll(() => site.start());
afterAll(async () => {
  await site.stop();
  expect(site.errors).toEqual([]);
});

// Taps a place of the flat in the picture of its plan, which is shown whole.
async function tapInPlan(page: Page, place: Point): Promise<void> {
  const canvas = page.getByRole("img", { name: "In the existing plan" });
  const box = (await canvas.boundingBox())!;
  const pixels = { x: drawn.width / drawn.pixel + 2 * drawn.border, y: drawn.height / drawn.pixel + 2 * drawn.border };
  const shown = 20 / pixels.x;
  const corners = [
    { x: 0, y: 0 },
    { x: pixels.x * shown, y: -pixels.y * shown },
  ];
  const map = fit(corners, 0, box, { top: 44, right: 78, bottom: 34, left: 24 }, 90);
  const at = inPicture(place);
  const screen = toScreen(map, { x: at.x * shown, y: -at.y * shown });
  await page.touchscreen.tap(box.x + screen.x, box.y + screen.y);
}

async function choose(page: Page, name: string, bytes: Uint8Array): Promise<void> {
  await page
    .getByRole("dialog")
    .locator('input[type="file"]')
    .last()
    .setInputFiles({ name, mimeType: "application/octet-stream", buffer: Buffer.from(bytes) });
}

const close = (page: Page) => page.getByRole("dialog").getByRole("button", { name: "Close", exact: true }).tap();
const expectedOn = async (canvas: Locator) => Number(await canvas.getAttribute("data-expected"));
const stopsOn = async (canvas: Locator) => Number(await canvas.getAttribute("data-stops"));
const headline = /^\d+ stations?, (\d+\sh )?\d+\smin, \d+\s% at 5\scm$/;

test("a floor plan before the first scan, and what is left in half an hour", async () => {
  const session = await site.newJob("flat");
  const surveyor = new Surveyor();
  const page = await site.tablet({}, "/#/flat/next");
  await page.getByRole("heading", { name: "Make the first scan" }).waitFor();
  expect(await page.getByRole("button", { name: "The whole job" }).isDisabled()).toBe(true);

  // What does not do is said before anything is sent.
  await page.getByRole("button", { name: "Existing plan" }).tap();
  await choose(page, "plan.pdf", Buffer.from("%PDF-1.7 "));
  await page.getByText("This is a PDF. Save the page as a picture").waitFor();
  await choose(page, "large.obj", Buffer.from("v 0 0 0\n".repeat(500_000)));
  await page.getByText(/This file has 4\.0\sMB; up to 3\.1\sMB can be sent/).waitFor();
  await isAccessible(page, "choosing an existing plan");
  await keepBothSizes(page, "existing-choose");

  // Placed by the first scan: where it will be made, and where the scanner's front points to.
  await choose(page, "ground floor.png", floorPlanPicture());
  await page.getByText("A: tap where the first scan will be made.").waitFor();
  await page.waitForTimeout(300);
  await tapInPlan(page, surveyor.start);
  await page.getByText("B: tap what the scanner's front will point to").waitFor();
  const ahead = 2.5;
  await tapInPlan(page, {
    x: surveyor.start.x + ahead * Math.cos(surveyor.heading),
    y: surveyor.start.y + ahead * Math.sin(surveyor.heading),
  });
  await page.getByText("Type how far it is from A to B").waitFor();
  expect(await page.getByRole("button", { name: "Place it" }).isDisabled()).toBe(true);
  await page.getByLabel("From A to B, m").fill(String(ahead));
  await page.getByText(/A and B are 2\.5\sm apart/).waitFor();
  await isAccessible(page, "placing an existing plan");
  await keepBothSizes(page, "existing-place");
  await page.getByRole("button", { name: "Place it" }).tap();
  await page.getByText("where you placed it").waitFor();
  await isAccessible(page, "an existing plan that is placed");
  await close(page);
  const set = (await site.api.models.getSitePrior({ parent: session })).sitePrior!;
  expect(set.displayName).toBe("ground floor.png");
  expect(set.unitM).toBeCloseTo(drawn.pixel, 3);

  // Its walls are dashed on the plan, and the whole job can be told before the first scan.
  await expect.poll(() => expectedOn(page.locator("canvas").first())).toBeGreaterThan(0);
  await keepBothSizes(page, "existing-next");
  await page.getByRole("button", { name: "The whole job" }).tap();
  await page.getByRole("radio", { name: "No limit" }).tap();
  await page.getByText(headline).waitFor();
  await page.getByText(/Looking for something better|Working out/).waitFor({ state: "detached" });
  expect(await stopsOn(page.getByRole("dialog").locator("canvas"))).toBeGreaterThan(0);
  await isAccessible(page, "the whole job before the first scan");
  await keepBothSizes(page, "tour-before");
  await page.getByRole("radio", { name: "30 min" }).tap();
  await page.getByText(headline).waitFor();
  await page.getByText(/^Until \d\d:\d\d\.$/).waitFor();
  const stops = await page.getByRole("list", { name: "In this order" }).getByRole("listitem").count();
  expect(stops).toBeGreaterThan(0);
  await page.getByRole("link", { name: "Show it on the plan" }).tap();
  const plan = page.getByRole("img", { name: "Plan of the site" });
  await expect.poll(() => stopsOn(plan)).toBe(stops);
  expect(await expectedOn(plan)).toBeGreaterThan(0);
  await isAccessible(page, "the route on the plan");
  await keepBothSizes(page, "tour-plan-before");

  // The first scan aligns it: what is measured is no longer dashed.
  const dashed = await expectedOn(plan);
  await goTo(page, "Next");
  await sendFile(page, "kitchen.vrim", surveyor.first());
  await page.getByText("Scan here next").waitFor();
  await goTo(page, "Plan");
  await page.getByRole("button", { name: "Existing plan" }).tap();
  await page.getByText(/aligned to \d+\scm/).waitFor();
  await isAccessible(page, "an existing plan that is aligned");
  await keepBothSizes(page, "existing-aligned");
  await close(page);
  await page.waitForTimeout(500);
  expect(await expectedOn(plan)).not.toBe(dashed);

  // The rest of the half hour, planned anew.
  await page.getByText(headline).waitFor();
  await page.getByText(/Looking for something better|Working out/).waitFor({ state: "detached" });
  await keepBothSizes(page, "tour-plan");

  // Without a limit what is left of it stays as it is once a stop is made.
  await page.getByRole("radio", { name: "No limit" }).tap();
  await page.getByText(headline).waitFor();
  await page.getByText(/Looking for something better|Working out/).waitFor({ state: "detached" });
  // The next place follows it, once somebody wants that.
  const follow = page.getByRole("button", { name: "Follow this route" });
  expect(await follow.getAttribute("aria-pressed")).toBe("false");
  await follow.tap();
  await expect.poll(() => follow.getAttribute("aria-pressed")).toBe("true");
  await isAccessible(page, "a route that is followed");
  await keepBothSizes(page, "tour-follow");
  await goTo(page, "Next");
  await page.getByText(/^(Stop \d+ of your route|No stop of your route pays)/).waitFor();
  await isAccessible(page, "a stop of the route as the next place");
  await keepBothSizes(page, "tour-followed");
  const followed = (await site.api.plans.listPlans({ parent: session, pageSize: 200 })).plans.filter(
    (made) => made.result?.followedTour !== undefined,
  );
  expect(followed.length).toBeGreaterThan(0);
  expect(followed.at(-1)!.tourStations.length).toBeGreaterThan(0);
  // Also once the page is opened again.
  await page.reload();
  await page.getByText(/^(Stop \d+ of your route|No stop of your route pays)/).waitFor();
  await goTo(page, "Plan");
  await page.getByRole("button", { name: "Route", exact: true }).tap();
  await page.getByRole("radio", { name: "No limit" }).tap();
  await page.getByText(headline).waitFor();
  await page.getByText(/Looking for something better|Working out/).waitFor({ state: "detached" });

  await page.getByRole("list", { name: "In this order" }).getByRole("button").first().tap();
  await page.getByRole("heading", { name: "Stop 1" }).waitFor();
  await isAccessible(page, "a stop");
  await keepBothSizes(page, "tour-stop");
  await page.getByRole("button", { name: "Scanning here" }).tap();
  await expect.poll(async () => (await site.api.fleet.listStations({ parent: session })).stations.length).toBe(1);
  await page.getByText(/^\d+ stops? (is|are) as before\.$/).waitFor();

  // Around a scan whose data are to come it is not followed.
  await goTo(page, "Next");
  await page.getByText("Your route is followed again when the data of all scans are there.").waitFor();
  await goTo(page, "Plan");
  await page.getByRole("button", { name: "Follow this route" }).tap();

  // Two more scans, typed; and taken out again.
  await goTo(page, "Next");
  expect(await page.getByText("Your route is followed again").count()).toBe(0);
  await page.getByRole("button", { name: "What's left" }).tap();
  await page.getByRole("radio", { name: "Other" }).tap();
  await page.getByLabel("How many").fill("2");
  await page.getByLabel("Of what").selectOption("scans");
  await page.getByRole("button", { name: "Work it out" }).tap();
  await page.getByText(/^[12] stations?, /).waitFor();
  await isAccessible(page, "what is left in two scans");
  await keepBothSizes(page, "tour-left");
  await close(page);
  await goTo(page, "Plan");
  await page.getByRole("button", { name: "Existing plan" }).tap();
  await page.getByRole("button", { name: "Take it out" }).tap();
  await page.getByText("Take it out? Places are then planned by the scans alone.").waitFor();
  await page.getByRole("button", { name: "Take it out" }).tap();
  await page.getByText("A floor plan or a model of the building").waitFor();
  await close(page);
  await expect.poll(() => expectedOn(plan)).toBe(0);
  await page.context().close();
}, 240_000);

test("two scanners in zones of their own, another tablet, and a plan that is placed after the first scan", async () => {
  const session = await site.newJob("fleet");
  const { fleet, models } = site.api;
  for (const name of ["Ada", "Bob"])
    await fleet.createScanner({ parent: session, scannerId: name.toLowerCase(), scanner: { displayName: name } });
  const file = floorPlanPicture();
  const surveyor = new Surveyor();
  // Where a place of the flat is in the job's own frame, which the first scan begins.
  const inJob = ({ x, y }: Point) => {
    const [c, s] = [Math.cos(surveyor.heading), Math.sin(surveyor.heading)];
    const [dx, dy] = [x - surveyor.start.x, y - surveyor.start.y];
    return { x: c * dx + s * dy, y: -s * dx + c * dy };
  };
  const corners = [
    { x: 0, y: 0 },
    { x: 9.1, y: 4 },
  ];
  const set = (move: number) =>
    models.setSitePrior({
      parent: session,
      file,
      sitePrior: {
        displayName: "flat.png",
        unitM: drawn.pixel,
        points: corners.map((corner) => {
          const place = inJob(corner);
          return { prior: { ...inPicture(corner), z: 0 }, site: { x: place.x + move, y: place.y, z: -1.5 } };
        }),
      },
    });
  const page = await site.tablet({}, "/#/fleet/plan");
  const plan = page.getByRole("img", { name: "Plan of the site" });
  await plan.waitFor();
  await set(0);

  // This tablet did not send it: it draws its walls all the same.
  await expect.poll(() => expectedOn(plan)).toBeGreaterThan(0);

  // Each scanner has its own letters, and its own kind of line.
  await page.getByRole("button", { name: "Route", exact: true }).tap();
  await page.getByRole("radio", { name: "1 h", exact: true }).tap();
  await page.getByText(headline).waitFor();
  await page.getByText(/Looking for something better|Working out/).waitFor({ state: "detached" });
  const order = page.getByRole("list", { name: "In this order" });
  await order.getByText("A1", { exact: true }).waitFor();
  await order.getByText("B1", { exact: true }).waitFor();
  await isAccessible(page, "a route of two scanners");
  await keepBothSizes(page, "tour-fleet");
  await page.getByRole("radio", { name: "One scanner" }).tap();
  await order.getByText("1", { exact: true }).waitFor();

  // Leaving ends the search; what was found stays, and where nothing was it begins anew.
  await page.getByRole("radio", { name: "No limit" }).tap();
  await goTo(page, "Next");
  await goTo(page, "Plan");
  await page.getByText(headline).waitFor();
  await page.getByRole("radio", { name: "2 h", exact: true }).tap();
  await page.getByText(headline).waitFor();
  await goTo(page, "Next");
  await goTo(page, "Plan");
  await page.getByText(headline).waitFor();
  expect(await page.getByText(/Looking for something better|Working out/).count()).toBe(0);
  await page.getByRole("radio", { name: "No limit" }).tap();

  // Where it was placed it is not what is scanned: said, with the cure, and it is drawn no more.
  await set(25);
  await goTo(page, "Next");
  await sendFile(page, "kitchen.vrim", surveyor.first());
  await page.getByText("Scan here next").waitFor();
  await goTo(page, "Plan");
  await expect.poll(() => expectedOn(plan)).toBe(0);
  await page.getByRole("button", { name: "Existing plan" }).tap();
  await page.getByText(/not aligned: unused|not used yet/).waitFor();
  await isAccessible(page, "an existing plan that is not used");
  await keepBothSizes(page, "existing-unused");

  // Placed anew: the same two points here and there.
  await choose(page, "flat.png", file);
  await page.getByText("Tap a point A in the existing plan").waitFor();
  await page.waitForTimeout(300);
  await tapInPlan(page, corners[0]!);
  await page.getByText("Now the same point A at the site.").or(page.getByText("Tap a point B")).first().waitFor();
  const there = page.getByRole("img", { name: "At the site, as scanned" });
  await there.press("Enter");
  await page.getByText("Tap a point B in the existing plan").waitFor();
  await tapInPlan(page, corners[1]!);
  await page.getByText("Now the same point B at the site.").waitFor();
  await there.press("Enter");
  await page.getByText("A and B are too near each other.").waitFor();
  await isAccessible(page, "placing an existing plan on what is scanned");
  await keepBothSizes(page, "existing-both");
  await page.getByRole("button", { name: "Type coordinates instead" }).tap();
  for (const [i, name] of ["A", "B"].entries()) {
    const at = inJob(corners[i]!);
    await page.getByLabel(`${name}: X at the site, m`).fill(at.x.toFixed(2));
    await page.getByLabel(`${name}: Y at the site, m`).fill(at.y.toFixed(2));
  }
  await isAccessible(page, "typing where an existing plan lies");
  await keepBothSizes(page, "existing-typed");
  await page.getByRole("button", { name: "Place it" }).tap();
  await page.getByText(/aligned to \d+\scm/).waitFor();
  await close(page);
  await expect.poll(() => expectedOn(plan)).toBeGreaterThan(0);

  // Dark, in German.
  await goTo(page, "Job");
  await page.getByRole("radio", { name: "Dark" }).tap();
  await page.getByRole("radio", { name: "Deutsch" }).tap();
  await page.getByRole("heading", { name: "Was herauskommt" }).waitFor();
  await page.getByRole("navigation").getByText("Plan", { exact: true }).tap();
  await page.getByRole("radio", { name: /^Alle 2 Scanner$/ }).tap();
  await page
    .getByRole("list", { name: "In dieser Reihenfolge" })
    .getByText(/^[AB]1$/)
    .first()
    .waitFor();
  await page.getByText(/Etwas Besseres wird gesucht|Welche Scans/).waitFor({ state: "detached" });
  await isAccessible(page, "a route of two scanners, dark, in German");
  await keepBothSizes(page, "tour-dark-de");
  await page.context().close();
}, 240_000);

test("a drawing in millimetres and a model whose y points up, placed by keys alone", async () => {
  const session = await site.newJob("drawn");
  const page = await site.tablet({}, "/#/drawn/next");
  const rooms = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n";
  const outline =
    "0\nLWPOLYLINE\n8\nWALL\n90\n4\n70\n1\n10\n0\n20\n0\n10\n9100\n20\n0\n10\n9100\n20\n4000\n10\n0\n20\n4000\n";
  const corners = [
    [0, 0],
    [9.1, 0],
    [9.1, 4],
    [0, 4],
  ];
  const vertices = [0, 2.5].flatMap((z) => corners.map(([x, y]) => `v ${x} ${z} ${-y!}`));
  const faces = ["1 2 3 4", "5 6 7 8", "1 2 6 5", "2 3 7 6", "3 4 8 7", "4 1 5 8"].map((face) => `f ${face}`);
  for (const [name, text, unit, yUp] of [
    ["rooms.dxf", `${rooms}${outline}0\nENDSEC\n0\nEOF\n`, 0.001, false],
    ["rooms.obj", [...vertices, ...faces].join("\n"), 1, true],
  ] as const) {
    await page.getByRole("button", { name: "Existing plan" }).press("Enter");
    await choose(page, name, Buffer.from(text));
    await page.getByText("A: tap where the first scan will be made.").waitFor();
    await page.waitForTimeout(300);
    const map = page.getByRole("img", { name: "In the existing plan" });
    await map.press("Enter");
    await page.getByText("B: tap what the scanner's front will point to").waitFor();
    for (let i = 0; i < 3; ++i) await map.press("ArrowRight");
    await map.press("Enter");
    await page.getByText("Both points are set.").waitFor();
    await isAccessible(page, `placing ${name}`);
    if (yUp) await keepBothSizes(page, "existing-model");
    await page.getByRole("button", { name: "Place it" }).press("Enter");
    await page.getByText("where you placed it").waitFor();
    await page.keyboard.press("Escape");
    const { sitePrior, standing } = await site.api.models.getSitePrior({ parent: session });
    expect(sitePrior!.unitM).toBe(unit);
    expect(sitePrior!.yUp).toBe(yUp);
    // About the middle of the rooms; there the site's own frame begins.
    const a = sitePrior!.points[0]!.prior!;
    const middle = { x: a.x * unit, y: (yUp ? -a.z : a.y) * unit };
    expect(Math.hypot(middle.x - 4.55, middle.y - 2)).toBeLessThan(0.6);
    expect(standing!.pose!.translation!.x).toBeCloseTo(-middle.x, 3);
    expect(standing!.pose!.translation!.y).toBeCloseTo(-middle.y, 3);
    expect(standing!.pose!.translation!.z).toBeCloseTo(-1.5, 3);
    await expect.poll(() => expectedOn(page.locator("canvas").first())).toBeGreaterThan(0);
  }
  await page.context().close();
}, 120_000);
