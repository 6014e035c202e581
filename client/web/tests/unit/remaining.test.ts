import { expect, test } from "vitest";
import { paceOf, remaining } from "../../src/words/remaining";

test("as many scans are left as a job needs whose scans bring the same share of what is missing", () => {
  for (const [done, share] of [
    [0.2, 0.5],
    [0.5, 0.2],
    [0.7, 0.3],
    [0.9, 0.1],
  ] as const) {
    const all = 300;
    let missing = all * (1 - done);
    const left = remaining({ atDensity: all * done, done, best: share * missing, worth: 0.5 }, 240)!;
    // Counted out, scan by scan.
    let scans = 0;
    while (missing > 0.05 * all) {
      missing -= share * missing;
      ++scans;
    }
    expect(left.scans).toBe(scans);
    expect(left.seconds).toBe(240 * scans);
  }
});

test("nothing is said where nothing can be", () => {
  expect(remaining({ atDensity: 0, done: 0, best: 3, worth: 0.5 }, 240)).toBeUndefined();
  expect(remaining({ atDensity: 100, done: 1, best: 0, worth: 0.5 }, 240)).toBeUndefined();
  expect(remaining({ atDensity: 100, done: 0.5, best: 0.001, worth: 0 }, 240)).toBeUndefined();
});

test("the pace is that of the scans, without lunch and without files that came together", () => {
  const minutes = [0, 6, 6.1, 12, 17, 100, 107];
  const times = minutes.map((minute) => 60 * minute);
  expect(paceOf(times, 100)).toBeCloseTo(5.9 * 60);
  expect(paceOf([0, 3, 6, 9], 100)).toBe(160);
  expect(paceOf([], undefined)).toBe(180);
});
