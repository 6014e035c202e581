// Two tabs of one tablet that send the same file: one sends, the other waits, and goes on where that one is closed.
// Without locks, which browsers have on encrypted pages alone, both send, and the server takes each piece once.
export interface Turns {
  // What ends the turn; undefined: another tab has it.
  take(name: string): Promise<(() => void) | undefined>;
}

export const tabs: Turns = {
  take(name) {
    const locks = typeof navigator === "undefined" ? undefined : navigator.locks;
    if (locks === undefined) return Promise.resolve(() => undefined);
    return new Promise((resolve, reject) => {
      locks
        .request(`vantage ${name}`, { ifAvailable: true }, (lock) => {
          if (lock === null) return resolve(undefined);
          return new Promise<void>((end) => resolve(end));
        })
        .catch(reject);
    });
  },
};
