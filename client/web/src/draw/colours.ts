// The page's colours as canvases need them: the custom properties of style.css, in the theme that is on.

export interface Colours {
  ground: string;
  paper: string;
  ink: string;
  soft: string;
  line: string;
  accent: string;
  onAccent: string;
  good: string;
  warn: string;
  // Of the scanners of a tour; the first is the accent.
  zones: string[];
  // Of the plan.
  floor: [number, number, number];
  thin: [number, number, number];
  furniture: [number, number, number];
  wall: [number, number, number];
  missing: [number, number, number];
}

export function readColours(element: Element): Colours {
  const style = getComputedStyle(element);
  const text = (name: string) => style.getPropertyValue(`--${name}`).trim();
  const triple = (name: string): [number, number, number] => {
    const hex = text(name);
    return [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16)) as [number, number, number];
  };
  return {
    ground: text("ground"),
    paper: text("paper"),
    ink: text("ink"),
    soft: text("soft"),
    line: text("line"),
    accent: text("accent"),
    onAccent: text("on-accent"),
    good: text("good"),
    warn: text("warn"),
    zones: ["accent", "zone-2", "zone-3", "zone-4"].map(text),
    floor: triple("plan-floor"),
    thin: triple("plan-thin"),
    furniture: triple("plan-furniture"),
    wall: triple("plan-wall"),
    missing: triple("plan-missing"),
  };
}
