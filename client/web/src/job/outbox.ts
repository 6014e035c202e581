// What a person did, until the server has it. An entry is kept on the tablet and sent in its turn, with
// growing pauses, until the server says yes or no; it carries the request id that it was made with, so
// that an entry whose answer was lost does nothing when it is sent again. Where the server does not know the tablet,
// entries wait until it is paired again.
import { isPassing, isUnknownTablet } from "../api/errors";

export interface Entry {
  // The request id, too.
  id: string;
  // sessions/{session}.
  session: string;
  // What to do, and with what: plain data, to be kept as JSON.
  kind: string;
  payload: unknown;
  // When the person did it, ms since 1970.
  time: number;
}

export interface Keeper {
  read(): Entry[];
  write(entries: Entry[]): void;
}

export type Send = (entry: Entry) => Promise<void>;

export interface Listener {
  // The entries that wait, after each change.
  changed(entries: readonly Entry[]): void;
  // The server refused an entry for good; it is dropped.
  refused(entry: Entry, error: unknown): void;
  // The server does not know this tablet; what waits is kept.
  unknown(): void;
}

// A tablet that was away for a day still has what was done; who does more than this offline is told.
export const mostEntries = 500;

const firstPause = 1_000;
const longestPause = 15_000;

export class Outbox {
  #entries: Entry[];
  #sending: Promise<void> | undefined;
  #pause = firstPause;
  #timer: ReturnType<typeof setTimeout> | undefined;

  constructor(
    private readonly keeper: Keeper,
    private readonly send: Send,
    private readonly listener: Listener,
  ) {
    this.#entries = keeper.read();
  }

  get entries(): readonly Entry[] {
    return this.#entries;
  }

  // Keeps it, then sends it. False where there is no room.
  add(entry: Entry): boolean {
    if (this.#entries.length >= mostEntries) return false;
    this.#change([...this.#entries, entry]);
    void this.flush();
    return true;
  }

  // Takes back what was not sent yet. False where it is being sent, or was: then its effect has to be
  // undone at the server.
  takeBack(id: string): boolean {
    const first = this.#entries[0];
    if (first?.id === id && this.#sending !== undefined) return false;
    if (!this.#entries.some((entry) => entry.id === id)) return false;
    this.#change(this.#entries.filter((entry) => entry.id !== id));
    return true;
  }

  // Sends what waits, in order. A second call while one is at it changes nothing.
  flush(): Promise<void> {
    clearTimeout(this.#timer);
    this.#sending ??= this.#sendAll().finally(() => {
      this.#sending = undefined;
    });
    return this.#sending;
  }

  async #sendAll(): Promise<void> {
    for (let entry = this.#entries[0]; entry !== undefined; entry = this.#entries[0]) {
      const current = entry;
      try {
        await this.send(current);
      } catch (error) {
        if (isPassing(error)) {
          this.#timer = setTimeout(() => void this.flush(), this.#pause);
          this.#pause = Math.min(longestPause, 2 * this.#pause);
          return;
        }
        if (isUnknownTablet(error)) {
          this.listener.unknown();
          return;
        }
        this.#change(this.#entries.filter((other) => other.id !== current.id));
        this.listener.refused(current, error);
        continue;
      }
      this.#pause = firstPause;
      this.#change(this.#entries.filter((other) => other.id !== current.id));
    }
  }

  #change(entries: Entry[]): void {
    this.#entries = entries;
    this.keeper.write(entries);
    this.listener.changed(entries);
  }
}
