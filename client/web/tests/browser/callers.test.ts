// A tablet that is paired by a link, and one whose token is revoked.
import { afterAll, beforeAll, expect, test } from "vitest";
import { goTo, isAccessible, Site } from "./harness";

const site = new Site();
let token = "";
beforeAll(async () => {
  token = site.tellCallersApart();
  await site.start();
});
afterAll(() => site.stop());

test("a token that runs out while the job is shown: what is done then waits until the tablet is paired again", async () => {
  const session = (await site.api.sessions.createSession({ sessionId: "late", session: { displayName: "Late" } }))
    .session!.name;
  const short = site.makeToken("short");
  const expires = new Date(Date.now() + 12_000).toISOString().replace(/\.\d+Z$/, "Z");
  site.writeCallers(`${site.callers}\n${short.line.replace(/\S+$/, expires)}`);
  const page = await site.tablet({}, `#token=${short.token}`);
  await page.getByRole("link", { name: /Late/ }).tap();
  await page.getByText("Live").waitFor();
  await goTo(page, "Plan");
  // The server says it by itself once the time has come; what somebody does now waits.
  const plan = page.getByRole("img", { name: "Plan of the site" });
  await expect
    .poll(async () => (await fetchAs(short.token, site.url)) === 401, { timeout: 40_000, interval: 500 })
    .toBe(true);
  await plan.press("Enter");
  await page.getByRole("button", { name: "Scanning here" }).tap();
  await page.getByText("The server does not know this tablet any more. Pair it again.").first().waitFor();
  await page.getByText("1 entry waits to be sent").waitFor();
  await isAccessible(page, "a token that ran out");
  expect((await site.api.fleet.listStations({ parent: session })).stations).toEqual([]);
  const again = site.makeToken("again");
  site.writeCallers(`${site.callers}\n${again.line}`);
  // The page that is open takes it.
  await page.goto(`${site.url}/#token=${again.token}`);
  await page.getByRole("link", { name: /Late/ }).tap();
  await page.getByText("Live").waitFor();
  await expect
    .poll(async () => (await site.api.fleet.listStations({ parent: session })).stations.length, { timeout: 30_000 })
    .toBe(1);
  await page.context().close();
}, 120_000);

async function fetchAs(token: string, url: string): Promise<number> {
  const answer = await fetch(`${url}/vantage.v1.SessionService/ListSessions`, {
    method: "POST",
    headers: { "content-type": "application/json", authorization: `Bearer ${token}` },
    body: "{}",
  });
  return answer.status;
}

test("a link pairs the tablet; a token that is revoked says so, and nothing is lost", async () => {
  await site.api.sessions.createSession({ sessionId: "paired", session: { displayName: "Paired" } });
  const stranger = await site.tablet();
  await stranger.getByText("The server does not know this tablet any more. Pair it again.").waitFor();
  await isAccessible(stranger, "a tablet that is not known");
  await stranger.context().close();

  const page = await site.tablet({}, `#token=${token}`);
  await page.getByRole("link", { name: /Paired/ }).waitFor();
  // The token does not stay in the address, where somebody could read it off.
  expect(page.url()).not.toContain(token);
  await page.getByRole("link", { name: /Paired/ }).tap();
  await page.getByRole("heading", { name: "Make the first scan" }).waitFor();
  await page.getByText("Live").waitFor();
  site.writeCallers("");
  await page.reload();
  await page.getByText("The server does not know this tablet any more. Pair it again.").first().waitFor();
  // Paired again by a link that is opened in the same tab, where nothing is loaded by itself.
  const next = site.tellCallersApart();
  await page.evaluate((hash) => {
    location.hash = hash;
  }, `token=${next}`);
  await page.getByRole("link", { name: /Paired/ }).waitFor();
  expect(page.url()).not.toContain(next);
  await page.context().close();
}, 90_000);
