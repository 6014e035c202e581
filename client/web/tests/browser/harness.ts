// A server of its own, which serves the page, and a browser with tablets.
import { execFileSync, spawn, type ChildProcess } from "node:child_process";
import { once } from "node:events";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createClient, type Client } from "@connectrpc/connect";
import { create } from "@bufbuild/protobuf";
import { createConnectTransport } from "@connectrpc/connect-node";
import axe from "axe-core";
import { chromium, type Browser, type BrowserContextOptions, type Page } from "playwright-core";
import { expect } from "vitest";
import { FleetService } from "../../src/gen/vantage/v1/fleet_service_pb";
import { ModelService } from "../../src/gen/vantage/v1/model_service_pb";
import { PlanService } from "../../src/gen/vantage/v1/plan_service_pb";
import { ScanState, type Scan } from "../../src/gen/vantage/v1/scan_pb";
import { ScanService } from "../../src/gen/vantage/v1/scan_service_pb";
import { SessionSchema } from "../../src/gen/vantage/v1/session_pb";
import { SessionService } from "../../src/gen/vantage/v1/session_service_pb";

const browserPaths = [
  process.env.VANTAGE_BROWSER ?? "",
  "/usr/bin/chromium",
  "/usr/bin/chromium-browser",
  "/usr/bin/google-chrome",
];

export const upright = { width: 800, height: 1280 };
export const lying = { width: 1280, height: 800 };

export class Site {
  readonly folder = mkdtempSync(join(tmpdir(), "vantage-page-"));
  url = "";
  // Of the gRPC listener.
  address = "";
  #server: ChildProcess | undefined;
  #browser: Browser | undefined;
  // Taken at the first start, and kept.
  #port = 0;
  readonly errors: string[] = [];

  async start(): Promise<void> {
    await this.startServer();
    const executablePath = browserPaths.find((path) => path !== "" && existsSync(path));
    // No sandbox: tests run as root in containers. WebGL in software.
    this.#browser = await chromium.launch({
      executablePath,
      args: ["--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader"],
    });
  }

  // A job with the density of the simulated surveyor's scans; its name.
  async newJob(id: string): Promise<string> {
    const session = create(SessionSchema, { displayName: id, planningConfig: { requiredDensityPerM2: 400 } });
    await this.api.sessions.createSession({ sessionId: id, session });
    return `sessions/${id}`;
  }
  async scansOf(session: string): Promise<Scan[]> {
    return (await this.api.scans.listScans({ parent: session })).scans;
  }
  async mergedIn(session: string): Promise<number> {
    return (await this.scansOf(session)).filter((scan) => scan.state === ScanState.MERGED).length;
  }

  // What the server's command line has besides.
  serverOptions: string[] = [];
  #token = "";
  readonly #binary = process.env.VANTAGE_SERVER_BINARY ?? "../../build/release/server/vantaged";

  // A token, and the callers file's line that lets who has it in; the line's last word is when it runs out.
  makeToken(name: string): { token: string; line: string } {
    const made = execFileSync(this.#binary, ["token", name, "crew", "read,submit,plan"], { encoding: "utf8" });
    const line = made.split("\n").find((text) => text.trim().startsWith(`${name} `));
    const token = made.split(/\s+/).find((word) => word.length > 20 && !(line ?? "").includes(word));
    if (line === undefined || token === undefined) throw new Error(`no token in: ${made}`);
    return { token, line: line.trim() };
  }

  // Callers have to show who they are. Returns a tablet's token, by which tests call, too.
  tellCallersApart(): string {
    const { token, line } = this.makeToken("tablet");
    this.writeCallers(line);
    this.serverOptions = ["--callers", join(this.folder, "callers")];
    this.#token = token;
    this.callers = line;
    return token;
  }
  // The line of the token that tests call by.
  callers = "";

  writeCallers(lines: string): void {
    writeFileSync(join(this.folder, "callers"), `${lines}\n`, { mode: 0o600 });
    this.#server?.kill("SIGHUP");
  }

  async startServer(): Promise<void> {
    const binary = this.#binary;
    const portFile = join(this.folder, "port");
    const grpcPortFile = join(this.folder, "grpc-port");
    for (const file of [portFile, grpcPortFile]) rmSync(file, { force: true });
    this.#server = spawn(
      binary,
      [
        "--data",
        join(this.folder, "data"),
        "--listen",
        "127.0.0.1:0",
        "--port-file",
        grpcPortFile,
        "--web",
        `127.0.0.1:${this.#port}`,
        "--web-port-file",
        portFile,
        "--web-root",
        "../../build/web",
        "--calls-per-second",
        "0",
        "--threads",
        "1",
        "--log-level",
        "off",
        ...this.serverOptions,
      ],
      { stdio: ["ignore", "ignore", "inherit"] },
    );
    const written = (file: string) => existsSync(file) && readFileSync(file, "utf8").trim() !== "";
    for (let tries = 0; !written(portFile) || !written(grpcPortFile); ++tries) {
      if (tries > 600) throw new Error("the server did not come up");
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
    this.#port = Number(readFileSync(portFile, "utf8"));
    this.address = `127.0.0.1:${readFileSync(grpcPortFile, "utf8").trim()}`;
    this.url = `http://127.0.0.1:${this.#port}`;
  }

  // As a power cut does.
  async killServer(): Promise<void> {
    const server = this.#server;
    if (server === undefined) return;
    const gone = once(server, "exit");
    server.kill("SIGKILL");
    await gone;
    this.#server = undefined;
  }

  async stop(): Promise<void> {
    await this.#browser?.close();
    await this.killServer();
    rmSync(this.folder, { recursive: true, force: true });
  }

  // A tablet with the page open; what its console complains of is kept.
  async tablet(options: BrowserContextOptions = {}, hash = ""): Promise<Page> {
    const context = await this.#browser!.newContext({ viewport: upright, hasTouch: true, locale: "en-GB", ...options });
    context.setDefaultTimeout(45_000);
    // Short searches: the flat is small, and the machine has other work.
    await context.addInitScript(() => localStorage.setItem("vantage.search", "quick"));
    const page = await context.newPage();
    page.on("pageerror", (error) => this.errors.push(error.message));
    await page.goto(this.url + hash);
    return page;
  }

  get api(): {
    sessions: Client<typeof SessionService>;
    scans: Client<typeof ScanService>;
    plans: Client<typeof PlanService>;
    fleet: Client<typeof FleetService>;
    models: Client<typeof ModelService>;
  } {
    const transport = createConnectTransport({
      baseUrl: this.url,
      httpVersion: "1.1",
      interceptors: [
        (next) => (request) => {
          if (this.#token !== "") request.header.set("authorization", `Bearer ${this.#token}`);
          return next(request);
        },
      ],
    });
    return {
      sessions: createClient(SessionService, transport),
      scans: createClient(ScanService, transport),
      plans: createClient(PlanService, transport),
      fleet: createClient(FleetService, transport),
      models: createClient(ModelService, transport),
    };
  }
}

// Nothing on the screen that a blind person, or one in the sun, cannot use.
export async function isAccessible(page: Page, what: string): Promise<void> {
  // By the tool's protocol rather than by a script element, which the page's security policy forbids.
  await page.evaluate(axe.source);
  const violations = await page.evaluate(async () => {
    const result = await (window as unknown as { axe: typeof axe }).axe.run(document, {
      runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"],
    });
    return result.violations.map(
      (violation) => `${violation.id}: ${violation.nodes.map((node) => node.html.slice(0, 160)).join(" | ")}`,
    );
  });
  expect(violations, what).toEqual([]);
}

export async function sendFile(page: Page, name: string, bytes: Uint8Array): Promise<void> {
  await page.getByRole("button", { name: "Send a scan file" }).tap();
  await page
    .locator('input[type="file"]')
    .setInputFiles({ name, mimeType: "application/octet-stream", buffer: Buffer.from(bytes) });
}

// A tap on one of the screens below (or beside) the page.
export async function goTo(page: Page, screen: "Next" | "Plan" | "Stations" | "3D" | "Job"): Promise<void> {
  await page.getByRole("navigation").getByText(screen, { exact: true }).tap();
}

// VANTAGE_SCREENSHOTS=FOLDER keeps what a screen looks like.
export async function keepPicture(page: Page, name: string): Promise<void> {
  const folder = process.env.VANTAGE_SCREENSHOTS;
  if (folder === undefined) return;
  mkdirSync(folder, { recursive: true });
  await page.waitForTimeout(400);
  await page.screenshot({ path: `${folder}/${name}.png` });
}

// In both sizes.
export async function keepBothSizes(page: Page, name: string): Promise<void> {
  if (process.env.VANTAGE_SCREENSHOTS === undefined) return;
  for (const [size, suffix] of [
    [upright, "800"],
    [lying, "1280"],
  ] as const) {
    await page.setViewportSize(size);
    await keepPicture(page, `${name}-${suffix}`);
  }
  await page.setViewportSize(upright);
  await page.waitForTimeout(200);
}
