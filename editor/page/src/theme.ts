import { keep, kept } from "./kept.ts";
import type { Shape } from "./protocol.ts";

export type Choice = "system" | "light" | "dark";
const names = [
  "canvas", "floor", "floor-line", "dots", "accent", "accent-soft", "body", "body-line", "symbol", "value", "name", "port", "open", "wire", "branch", "label", "note",
  "highlight", "added", "removed", "changed", "pill", "pill-text",
] as const;
export type Colours = Record<(typeof names)[number], string>;
/** Letters as wide as editor/view takes them to be, on every computer. */
export const font = "Arimo, sans-serif";

/** What the style sheet says now; a probe resolves light-dark() as the browser does. */
export function colours(): Colours {
  const probe = document.body.appendChild(document.createElement("span"));
  const found = {} as Colours;
  for (const name of names) {
    probe.style.color = `var(--${name})`;
    found[name] = getComputedStyle(probe).color;
  }
  probe.remove();
  return found;
}

export function choose(choice: Choice): void {
  document.documentElement.style.colorScheme = choice === "system" ? "light dark" : choice;
  keep("localStorage", "theme", choice);
}
export function chosen(): Choice {
  const stored = kept<Choice>("localStorage", "theme");
  return stored === "light" || stored === "dark" ? stored : "system";
}

/** Of a sample rate, light and dark: the golden angle keeps neighbours apart. */
export const rate_colour = (rate: number): string => (rate === 0 ? "hsl(220 8% 55%)" : `hsl(${(73 + rate * 137.5) % 360} 65% 45%)`); // 0: constant

export const text_colour = (c: Colours, style: Shape["style"]): string =>
  style === "body" || style === "wire" || style === "branch" ? c.value : c[style];
