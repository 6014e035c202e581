import { Code, ConnectError } from "@connectrpc/connect";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { mostEntries, Outbox, type Entry, type Keeper } from "../../src/job/outbox";

const entry = (id: string): Entry => ({
  id,
  session: "sessions/s",
  kind: "releaseClaim",
  payload: { name: id },
  time: 0,
});

class Memory implements Keeper {
  entries: Entry[] = [];
  read = () => this.entries;
  write = (entries: Entry[]) => void (this.entries = entries);
}

// A server that does each request id once, and whose link breaks before or after it did.
class Server {
  readonly done: string[] = [];
  readonly calls: string[] = [];
  faults: ("before" | "after" | "refuse" | "unknown" | undefined)[] = [];
  send = async (sent: Entry): Promise<void> => {
    this.calls.push(sent.id);
    const fault = this.faults.shift();
    await Promise.resolve();
    if (fault === "before") throw new ConnectError("no link", Code.Unavailable);
    if (fault === "unknown") throw new ConnectError("who?", Code.Unauthenticated);
    if (fault === "refuse") throw new ConnectError("no", Code.FailedPrecondition);
    if (!this.done.includes(sent.id)) this.done.push(sent.id);
    if (fault === "after") throw new ConnectError("lost", Code.Unavailable);
  };
}

const listener = () => ({ changed: vi.fn(), refused: vi.fn(), unknown: vi.fn() });
beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

test("what was done is sent in order, once, and then kept no longer", async () => {
  const [keeper, server] = [new Memory(), new Server()];
  const outbox = new Outbox(keeper, server.send, listener());
  for (const id of ["a", "b", "c"]) outbox.add(entry(id));
  await outbox.flush();
  expect(server.calls).toEqual(["a", "b", "c"]);
  expect(keeper.entries).toEqual([]);
});

test("a link that breaks at any place does nothing twice and leaves nothing out", async () => {
  for (const faults of [
    ["before"],
    ["after"],
    ["before", "after", "before"],
    [undefined, "after", "before"],
  ] as Server["faults"][]) {
    const [keeper, server] = [new Memory(), new Server()];
    server.faults = [...faults];
    const outbox = new Outbox(keeper, server.send, listener());
    for (const id of ["a", "b", "c"]) outbox.add(entry(id));
    await vi.advanceTimersByTimeAsync(60_000);
    expect(server.done).toEqual(["a", "b", "c"]);
    expect(outbox.entries).toEqual([]);
  }
});

test("a tab that was closed before it was sent goes on in the next one", async () => {
  const [keeper, away, server] = [new Memory(), new Server(), new Server()];
  away.faults = ["before"];
  const first = new Outbox(keeper, away.send, listener());
  first.add(entry("a"));
  await first.flush();
  expect(keeper.entries.map((kept) => kept.id)).toEqual(["a"]);
  await new Outbox(keeper, server.send, listener()).flush();
  expect(server.done).toEqual(["a"]);
});

test("what the server refuses is said, and does not hold up the rest", async () => {
  const [keeper, server, told] = [new Memory(), new Server(), listener()];
  server.faults = ["refuse"];
  const outbox = new Outbox(keeper, server.send, told);
  outbox.add(entry("a"));
  outbox.add(entry("b"));
  await outbox.flush();
  expect(told.refused).toHaveBeenCalledTimes(1);
  expect(told.refused.mock.calls[0]?.[0]).toMatchObject({ id: "a" });
  expect(server.done).toEqual(["b"]);
});

test("what was not sent yet can be taken back; what is being sent cannot", async () => {
  const [keeper, server] = [new Memory(), new Server()];
  const outbox = new Outbox(keeper, server.send, listener());
  outbox.add(entry("a"));
  outbox.add(entry("b"));
  expect(outbox.takeBack("a")).toBe(false);
  expect(outbox.takeBack("b")).toBe(true);
  await outbox.flush();
  expect(server.done).toEqual(["a"]);
  expect(outbox.takeBack("a")).toBe(false);
});

test("it does not grow for ever", async () => {
  const [keeper, server] = [new Memory(), new Server()];
  server.faults = Array.from({ length: 3 }, () => "before" as const);
  const outbox = new Outbox(keeper, server.send, listener());
  for (let i = 0; i < mostEntries; ++i) expect(outbox.add(entry(String(i)))).toBe(true);
  expect(outbox.add(entry("more"))).toBe(false);
  await outbox.flush();
});

test("what a tablet did whose token ran out waits until it is paired again, and is sent once then", async () => {
  const [keeper, server, told] = [new Memory(), new Server(), listener()];
  server.faults = ["unknown"];
  const outbox = new Outbox(keeper, server.send, told);
  outbox.add(entry("a"));
  outbox.add(entry("b"));
  await outbox.flush();
  expect(told.unknown).toHaveBeenCalledOnce();
  expect(told.refused).not.toHaveBeenCalled();
  // Nobody asks again by itself.
  await vi.advanceTimersByTimeAsync(120_000);
  expect(server.calls).toEqual(["a"]);
  // The page is opened anew with another token.
  await new Outbox(keeper, server.send, listener()).flush();
  expect(server.done).toEqual(["a", "b"]);
  expect(keeper.entries).toEqual([]);
});
