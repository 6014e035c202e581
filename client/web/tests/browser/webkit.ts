// WebKit as tablets have it, driven by plain W3C WebDriver calls: Debian's webkit2gtk-driver on a display of its own.
import { spawn, type ChildProcess } from "node:child_process";
import { once } from "node:events";
import { existsSync, writeFileSync } from "node:fs";
import { createServer, type AddressInfo } from "node:net";

const driverPath = "/usr/bin/WebKitWebDriver";
const displayPath = "/usr/bin/Xvfb";
export const hasWebKit = existsSync(driverPath) && existsSync(displayPath);

// How WebDriver names an element in JSON.
const elementKey = "element-6066-11e4-a52e-4f735466cecf";
const patience = 60_000;

async function freePort(): Promise<number> {
  const server = createServer().listen(0, "127.0.0.1");
  await once(server, "listening");
  const { port } = server.address() as AddressInfo;
  server.close();
  await once(server, "close");
  return port;
}

function text(words: string): string {
  return `"${words}"`;
}

export class WebKit {
  #display: ChildProcess | undefined;
  #driver: ChildProcess | undefined;
  #address = "";
  #session = "";

  async start(): Promise<void> {
    const display = spawn(displayPath, ["-displayfd", "1", "-screen", "0", "1300x1400x24", "-nolisten", "tcp"], {
      stdio: ["ignore", "pipe", "ignore"],
    });
    this.#display = display;
    const [number] = (await once(display.stdout!, "data")) as [Buffer];
    const port = await freePort();
    this.#driver = spawn(driverPath, [`--port=${port}`], {
      env: { ...process.env, DISPLAY: `:${String(number).trim()}`, LIBGL_ALWAYS_SOFTWARE: "1", LANG: "C.UTF-8" },
      stdio: "ignore",
    });
    this.#address = `http://127.0.0.1:${port}`;
    const until = Date.now() + patience;
    for (;;) {
      const ready = await fetch(`${this.#address}/status`).then(
        (answer) => answer.ok,
        () => false,
      );
      if (ready) break;
      if (Date.now() > until) throw new Error("WebKitWebDriver did not come up");
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
    const made = (await this.#call("POST", "/session", {
      capabilities: { alwaysMatch: { "webkitgtk:browserOptions": { args: ["--automation"] } } },
    })) as { sessionId: string };
    this.#session = `/session/${made.sessionId}`;
    await this.#call("POST", `${this.#session}/window/rect`, { width: 800, height: 1280 });
  }

  async stop(): Promise<void> {
    if (this.#session !== "") await this.#call("DELETE", this.#session).catch(() => undefined);
    for (const child of [this.#driver, this.#display]) {
      if (child === undefined || child.exitCode !== null) continue;
      child.kill();
      await once(child, "exit");
    }
  }

  async open(url: string): Promise<void> {
    await this.#call("POST", `${this.#session}/url`, { url });
  }

  async run<T>(script: string): Promise<T> {
    return (await this.#call("POST", `${this.#session}/execute/sync`, { script, args: [] })) as T;
  }

  // The first such element that is shown, once there is one.
  async find(xpath: string): Promise<string> {
    const until = Date.now() + patience;
    for (;;) {
      const found = (await this.#call("POST", `${this.#session}/elements`, { using: "xpath", value: xpath })) as Record<
        string,
        string
      >[];
      const element = found[0]?.[elementKey];
      if (element !== undefined) return element;
      if (Date.now() > until) throw new Error(`not on the page: ${xpath}`);
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
  }

  async see(words: string): Promise<void> {
    await this.find(`//*[contains(normalize-space(text()), ${text(words)})]`);
  }

  async gone(words: string): Promise<void> {
    const until = Date.now() + patience;
    while (await this.run<boolean>(`return document.body.innerText.includes(${JSON.stringify(words)})`)) {
      if (Date.now() > until) throw new Error(`still on the page: ${words}`);
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
  }

  // A button or link by what stands on it; where a sheet is open, one of the sheet.
  async press(words: string): Promise<void> {
    const within = (await this.run<boolean>(`return document.querySelector("dialog[open]") !== null`))
      ? "//dialog"
      : "";
    const element = await this.find(
      `${within}//*[self::button or self::a][normalize-space(.)=${text(words)} or @aria-label=${text(words)}][not(@disabled)]`,
    );
    await this.#call("POST", `${this.#session}/element/${element}/click`, {});
  }

  async type(label: string, words: string): Promise<void> {
    const element = await this.find(`//label[contains(., ${text(label)})]//input`);
    await this.#call("POST", `${this.#session}/element/${element}/value`, { text: words });
  }

  // The file that a person picks.
  async pick(path: string): Promise<void> {
    const element = await this.find(`//input[@type="file"]`);
    await this.#call("POST", `${this.#session}/element/${element}/value`, { text: path });
  }

  async picture(path: string): Promise<void> {
    const png = (await this.#call("GET", `${this.#session}/screenshot`)) as string;
    writeFileSync(path, Buffer.from(png, "base64"));
  }

  async #call(method: string, path: string, body?: unknown): Promise<unknown> {
    const answer = await fetch(this.#address + path, {
      method,
      headers: { "content-type": "application/json" },
      body: body === undefined ? undefined : JSON.stringify(body),
    });
    const { value } = (await answer.json()) as { value: unknown };
    if (!answer.ok) throw new Error(`${method} ${path}: ${JSON.stringify(value)}`);
    return value;
  }
}
