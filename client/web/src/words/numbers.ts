// Figures as a surveyor reads them, with their units, in the reader's language.

function rounded(value: number, decimals: number, language: string): string {
  return new Intl.NumberFormat(language, {
    minimumFractionDigits: decimals,
    maximumFractionDigits: decimals,
  }).format(value);
}

const nbsp = "\u00a0";

// An area, m2: with a decimal below ten, where it matters.
export function area(m2: number, language: string): string {
  return `${rounded(m2, Math.abs(m2) < 9.95 ? 1 : 0, language)}${nbsp}m²`;
}

// A range of areas, m2, with the unit once.
export function areaRange(lower: number, upper: number, language: string): [string, string] {
  const decimals = upper < 9.95 ? 1 : 0;
  return [rounded(lower, decimals, language), `${rounded(upper, decimals, language)}${nbsp}m²`];
}

// A distance on the site, m, to a decimetre: what a tape is read to.
export function metres(m: number, language: string): string {
  return `${rounded(m, 1, language)}${nbsp}m`;
}

// The tripod's height and the like, m, to a centimetre.
export function metresFine(m: number, language: string): string {
  return `${rounded(m, 2, language)}${nbsp}m`;
}

// How well scans fit together, m, in millimetres; from a decimetre on it is nothing to work with,
// and centimetres say so.
export function accuracy(m: number, language: string): string {
  if (m >= 0.1) return `${rounded(m * 100, 0, language)}${nbsp}cm`;
  return `${rounded(Math.max(1, Math.ceil(m * 1000 - 0.05)), 0, language)}${nbsp}mm`;
}

// A share, [0, 1].
export function percent(share: number, language: string): string {
  return `${rounded(Math.floor(share * 100 + 1e-9), 0, language)}${nbsp}%`;
}

// How much of something was sent, bytes.
export function megabytes(bytes: number, language: string): string {
  const mb = bytes / 1e6;
  return `${rounded(mb, mb < 10 ? 1 : 0, language)}${nbsp}MB`;
}

// A time span, s, in the unit that a person would use: seconds, minutes, hours.
export function timeSpan(seconds: number, language: string): string {
  const unit = (value: number, name: string) =>
    new Intl.NumberFormat(language, { style: "unit", unit: name, unitDisplay: "short" }).format(value);
  const s = Math.max(0, Math.round(seconds));
  if (s < 60) return unit(s, "second");
  if (s < 3600) return unit(Math.round(s / 60), "minute");
  return unit(Math.round(s / 3600), "hour");
}

// A time span that is only roughly known, s: in steps of five minutes, from an hour and a half on of half an hour.
export function roughTime(seconds: number, language: string): string {
  const unit = (value: number, name: string) =>
    new Intl.NumberFormat(language, { style: "unit", unit: name, unitDisplay: "long" }).format(value);
  const minutes = Math.max(5, 5 * Math.round(seconds / 300));
  return minutes < 90 ? unit(minutes, "minute") : unit(Math.round(minutes / 30) / 2, "hour");
}

// A time span that somebody works for, s: '3 h 10 min'.
export function hoursAndMinutes(seconds: number, language: string): string {
  const minutes = Math.max(0, Math.round(seconds / 60));
  const whole = (value: number, digits: number) =>
    new Intl.NumberFormat(language, { minimumIntegerDigits: digits }).format(value);
  if (minutes < 60) return `${whole(minutes, 1)}${nbsp}min`;
  return `${whole(Math.floor(minutes / 60), 1)}${nbsp}h ${whole(minutes % 60, 2)}${nbsp}min`;
}

// A share that may be small, [0, 1]: with a decimal below a tenth.
export function percentFine(share: number, language: string): string {
  return `${rounded(share * 100, share < 0.0995 ? 1 : 0, language)}${nbsp}%`;
}

// How far apart points are at a density, samples / m2.
export function spacing(density: number, language: string): string {
  const cm = 100 / Math.sqrt(density);
  return `${rounded(cm, cm < 9.95 && Math.abs(cm - Math.round(cm)) > 0.05 ? 1 : 0, language)}${nbsp}cm`;
}

// How far off something is, m, in centimetres.
export function centimetres(m: number, language: string): string {
  return `${rounded(Math.max(1, Math.round(100 * m)), 0, language)}${nbsp}cm`;
}

// A time of day.
export function clock(time: Date, language: string): string {
  return new Intl.DateTimeFormat(language, { hour: "2-digit", minute: "2-digit" }).format(time);
}

export function day(time: Date, language: string): string {
  return new Intl.DateTimeFormat(language, { dateStyle: "medium", timeStyle: "short" }).format(time);
}
