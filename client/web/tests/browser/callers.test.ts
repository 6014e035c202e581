// A tablet that is paired by a link, and one whose token is revoked.
import { afterAll, beforeAll, expect, test } from "vitest";
import { isAccessible, Site } from "./harness";

const site = new Site();
let token = "";
beforeAll(async () => {
  token = site.tellCallersApart();
  await site.start();
});
afterAll(() => site.stop());

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
  await page.context().close();
}, 90_000);
