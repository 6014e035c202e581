// How long a job still takes, roughly: as many scans as there would be if each of them brought the same share of what
// is missing as the next one does, at the pace at which scans were made so far.

export interface Remaining {
  scans: number;
  // Of all of them, s.
  seconds: number;
}

// A job is as good as done when so little of its surface is missing, or when the next scan would bring less than
// what the job calls worth a scan.
const doneShare = 0.95;
// Nobody plans farther ahead than this by such a rule.
const mostScans = 200;

// `atDensity`: surface that is done, m2, which is the share `done` of all; `best`: what the next scan brings, m2;
// `worth`: the least that a scan has to bring, m2; `pace`: seconds a scan. Undefined where nothing can be said.
export function remaining(
  site: { atDensity: number; done: number; best: number; worth: number },
  pace: number,
): Remaining | undefined {
  const { atDensity, done, best, worth } = site;
  if (done <= 0 || done >= 1 || best <= 0) return undefined;
  const all = atDensity / done;
  const missing = all - atDensity;
  // Of what is missing, what a scan brings. One that brings nearly all of it is followed by another all the same.
  const share = Math.min(0.8, best / missing);
  const enough = Math.max((1 - doneShare) * all, Math.min(missing, worth / share));
  const scans = missing <= enough ? 1 : Math.ceil(Math.log(enough / missing) / Math.log(1 - share));
  return scans > mostScans ? undefined : { scans, seconds: scans * pace };
}

// Nobody sets up, scans and carries on in less than this, s: scans that came sooner after one another were sent
// together. After longer pauses somebody was at lunch.
const [soonest, longest] = [60, 3600];
// As the contract has it for a scanner of which nothing is known, s.
const usualPace = 180;
const lastGaps = 8;

// Seconds a scan: the median of the last gaps between scans, by when they came, s; else what the instrument needs
// and a minute to set up.
export function paceOf(times: readonly number[], scanSeconds: number | undefined): number {
  const sorted = [...times].sort((a, b) => a - b);
  const gaps = sorted
    .slice(1)
    .map((time, i) => time - sorted[i]!)
    .filter((gap) => gap >= soonest && gap <= longest)
    .slice(-lastGaps)
    .sort((a, b) => a - b);
  if (gaps.length >= 2) return gaps[Math.floor((gaps.length - 1) / 2)]!;
  return scanSeconds === undefined ? usualPace : scanSeconds + 60;
}
