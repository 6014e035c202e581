// Files that the server reads: an E57 from the tablet into the model, and whatever else somebody picks.
import { writeFileSync } from "node:fs";
import { createHash } from "node:crypto";
import { join } from "node:path";
import { afterAll, beforeAll, expect, test } from "vitest";
import type { Page } from "playwright-core";
import { ExportFormat } from "../../src/gen/vantage/v1/model_service_pb";
import { UploadState } from "../../src/gen/vantage/v1/upload_pb";
import { crc32c } from "../../src/send/crc32c";
import { isAccessible, keepPicture, sendFile, Site } from "./harness";
import { points, Surveyor } from "./simulated_site";

const site = new Site();
// Two stations in one file, as the server itself writes them.
let project: Uint8Array;
const pieceBytes = 256 * 1024;

async function sendRangeImage(session: string, bytes: Uint8Array, prior?: { x: number; y: number }): Promise<void> {
  const { scans } = site.api;
  const total = { encodedSizeBytes: BigInt(bytes.length), sha256: createHash("sha256").update(bytes).digest() };
  // As the page says of a spot: known to some decimetres, turned anyhow.
  const sigmas = [0.05, 0.05, 1.2, 0.3, 0.3, 0.3];
  const covariance = sigmas.flatMap((sigma, row) => sigmas.map((_, column) => (row === column ? sigma ** 2 : 0)));
  const place = prior && { pose: { rotation: { w: 1 }, translation: { ...prior, z: 0 } }, covariance };
  let { upload } = await scans.createUpload({ parent: session, upload: { total, prior: place } });
  while (upload!.state === UploadState.OPEN) {
    const at = Number(upload!.nextOffset);
    const data = bytes.slice(at, at + (1 << 20));
    const piece = { sequence: upload!.nextSequence, offset: upload!.nextOffset, data, crc32c: crc32c(data) };
    ({ upload } = await scans.uploadPiece({ upload: upload!.name, piece }));
  }
}

// As expect.poll, outside a test.
async function until(is: () => Promise<boolean>): Promise<void> {
  for (let tries = 0; !(await is()); ++tries) {
    if (tries > 600) throw new Error("it never came to that");
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
}

beforeAll(async () => {
  await site.start();
  const source = await site.newJob("source");
  const surveyor = new Surveyor();
  await sendRangeImage(source, surveyor.first());
  await until(async () => (await site.mergedIn(source)) === 1);
  await sendRangeImage(source, surveyor.at({ x: 1.5, y: 0.5, z: 0 }), { x: 1.5, y: 0.5 });
  const parts: Uint8Array[] = [];
  await until(async () => (await site.mergedIn(source)) === 2);
  const format = ExportFormat.SCANS_E57;
  for await (const part of site.api.models.exportModel({ name: source, format })) parts.push(part.data);
  project = new Uint8Array(Buffer.concat(parts));
}, 120_000);
afterAll(async () => {
  await site.stop();
  expect(site.errors).toEqual([]);
});

// How many pieces the page has sent; `hold`: after so many, the link is slow enough to close the tab meanwhile.
function countPieces(page: Page, hold = Infinity): { pieces: () => number; letGo: () => Promise<void> } {
  let pieces = 0;
  const path = "**/vantage.v1.ScanService/UploadPiece";
  void page.route(path, async (route) => {
    pieces += 1;
    if (pieces <= hold) await route.continue();
  });
  return { pieces: () => pieces, letGo: () => page.unroute(path) };
}

test("an E57 that is sent, broken off by closing the tab, and picked again, ends in the model", async () => {
  const session = await site.newJob("from-a-file");
  const page = await site.tablet({}, "#/from-a-file/stations");
  const first = countPieces(page, 4);
  await sendFile(page, "project.e57", project);
  await expect.poll(first.pieces, { timeout: 30_000 }).toBe(5);
  await first.letGo();
  await page.reload();
  await page.getByText(/have arrived\. If it was sent from here/).waitFor();
  const there = Number((await site.api.scans.listUploads({ parent: session })).uploads[0]!.nextOffset);
  const second = countPieces(page);
  await sendFile(page, "project.e57", project);
  await page.getByText(/Sent\. /).waitFor();
  await expect.poll(() => site.mergedIn(session), { timeout: 60_000 }).toBeGreaterThan(0);
  // Of what was there nothing was sent again.
  expect(there).toBeGreaterThanOrEqual(4 * pieceBytes);
  expect(second.pieces()).toBe(Math.ceil((project.length - there) / pieceBytes));
  const { uploads } = await site.api.scans.listUploads({ parent: session });
  expect(uploads.length).toBe(1);
  expect(uploads[0]!.state).toBe(UploadState.COMMITTED);
  const scans = await site.scansOf(session);
  expect(scans.map((scan) => scan.fileSetup)).toEqual(scans.map((_, i) => i + 1));
  expect(scans.length).toBe(uploads[0]!.setupCount);
  await page.context().close();
}, 120_000);

test("what is no scan is said before a byte is sent, what the server finds is said after", async () => {
  const session = await site.newJob("no-scans");
  const page = await site.tablet({}, "#/no-scans/stations");
  const sent = countPieces(page);
  const text = (words: string) => Uint8Array.from(words, (c) => c.charCodeAt(0));
  for (const [name, bytes, words] of [
    ["IMG_0042.e57", text("\xff\xd8\xff\xe0\0\x10JFIF"), "This is a photo or picture, not a scan."],
    ["plan.pdf", text("%PDF-1.7"), "This is a document or drawing, not a scan."],
    ["scan.zip", text("PK\x03\x04\x14\0\0\0"), "This is a packed file."],
    ["half.e57", project.slice(0, project.length / 2), "A part of this file is missing."],
    ["nothing.e57", new Uint8Array(0), "This file is empty."],
  ] as const) {
    await sendFile(page, name, bytes);
    await page.getByText(words).waitFor();
  }
  expect(sent.pieces()).toBe(0);
  expect((await site.api.scans.listUploads({ parent: session })).uploads).toEqual([]);
  await isAccessible(page, "files that are no scans");
  // Nothing but its content is wrong: the server has to read it.
  const damaged = project.slice();
  damaged.fill(0x5a, 100);
  await sendFile(page, "damaged.e57", damaged);
  await page.getByText("The file arrived, but it is no sound scan.").waitFor();
  // A tablet that was away meanwhile is told, too, until somebody has read it.
  await page.reload();
  await page.getByText("The file arrived, but it is no sound scan.").waitFor();
  await page.getByRole("button", { name: "Clear" }).tap();
  await page.reload();
  await page.getByRole("button", { name: "Send a scan file" }).waitFor();
  expect(await page.getByText("The file arrived, but it is no sound scan.").count()).toBe(0);
  await page.context().close();
}, 120_000);

test("a file of ten gigabytes is refused with both figures before anything of it is read", async () => {
  const session = await site.newJob("ten-gigabytes");
  const page = await site.tablet({}, "#/ten-gigabytes/stations");
  const sent = countPieces(page);
  const large = join(site.folder, "large.e57");
  writeFileSync(large, project.slice(0, 64));
  // What the browser says of its size; the file itself need not be there.
  await page.evaluate(() => {
    Object.defineProperty(File.prototype, "size", { get: () => 10_737_418_240 });
  });
  await page.getByRole("button", { name: "Send a scan file" }).tap();
  await page.locator('input[type="file"]').setInputFiles(large);
  await page.getByText(/This file has 10[.,]?\d* ?\d*.*; this server reads files of up to/).waitFor();
  await page.getByText("Nothing was sent.").waitFor();
  expect(sent.pieces()).toBe(0);
  expect((await site.api.scans.listUploads({ parent: session })).uploads).toEqual([]);
  await page.context().close();
});

test("two tabs on one file: one sends, and the other goes on when that is closed", async () => {
  const session = await site.newJob("two-tabs");
  const page = await site.tablet({}, "#/two-tabs/stations");
  const other = await page.context().newPage();
  await other.goto(`${site.url}#/two-tabs/stations`);
  const first = countPieces(page, 2);
  await sendFile(page, "project.e57", project);
  await expect.poll(first.pieces, { timeout: 30_000 }).toBe(3);
  const second = countPieces(other);
  await sendFile(other, "project.e57", project);
  await other.getByText("Another tab of this tablet sends this file.").waitFor();
  expect(second.pieces()).toBe(0);
  await page.close();
  await other.getByText(/Sent\. /).waitFor();
  // What the first had sent was not sent again; a piece that was on its way may have arrived.
  expect(second.pieces()).toBeGreaterThan(0);
  expect(second.pieces()).toBeLessThanOrEqual(Math.ceil(project.length / pieceBytes) - 2);
  expect((await site.api.scans.listUploads({ parent: session })).uploads.length).toBe(1);
  await other.context().close();
}, 120_000);

test("a job that is deleted while its file is sent says so", async () => {
  const session = await site.newJob("deleted");
  const page = await site.tablet({}, "#/deleted/stations");
  let pieces = 0;
  await page.route("**/vantage.v1.ScanService/UploadPiece", async (route) => {
    if (++pieces === 3) await site.api.sessions.deleteSession({ name: session });
    await route.continue();
  });
  await sendFile(page, "project.e57", project);
  await page
    .getByText(/This job was deleted|It is not there any more|no longer|gone/)
    .first()
    .waitFor();
  await page.context().close();
});

test("points that do not say where the scanner stood are asked for it, in the file's own unit", async () => {
  const session = await site.newJob("points");
  const page = await site.tablet({}, "#/points/stations");
  const surveyor = new Surveyor();
  await sendFile(page, "kitchen.ply", points(surveyor.start, 1, 0.001));
  await page.getByText("kitchen.ply has points, and does not say it.").waitFor();
  await isAccessible(page, "where the scanner stood in a file");
  await keepPicture(page, "station-in-file");
  await page.getByRole("button", { name: "Send", exact: true }).tap();
  await page.getByText("Type a number for each of X, Y and Z.").waitFor();
  expect((await site.api.scans.listUploads({ parent: session })).uploads).toEqual([]);
  // With a comma, as half of Europe types it.
  for (const axis of ["x", "y", "z"] as const) {
    const millimetres = (1000 * surveyor.start[axis]).toFixed(1).replace(".", ",");
    await page.getByLabel(axis.toUpperCase(), { exact: true }).fill(millimetres);
  }
  await page.getByRole("radio", { name: "Millimetres" }).tap();
  await page.getByRole("button", { name: "Send", exact: true }).tap();
  await page.getByText(/Sent\. /).waitFor();
  await expect.poll(() => site.mergedIn(session), { timeout: 60_000 }).toBe(1);
  const [upload] = (await site.api.scans.listUploads({ parent: session })).uploads;
  expect(upload!.file?.station).toMatchObject(
    Object.fromEntries(Object.entries(surveyor.start).map(([axis, m]) => [axis, 1000 * m])),
  );
  // The far room is 9.1 m away by its wall: a file in millimetres that was read in metres would have nothing there.
  const { coverage } = await site.api.models.getCoverage({ name: session });
  expect(coverage!.areaByKindM2!.trueSurface).toBeGreaterThan(30);
  await page.context().close();
}, 120_000);
