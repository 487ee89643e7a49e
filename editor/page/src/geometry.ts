import type { Side } from "./operations.ts";
import type { Drawing, Element, Point, Port, Rectangle, Shape, TextPlace } from "./protocol.ts";

/** The point of the drawing in the upper left corner of the canvas, and pixels of the screen per unit. */
export interface View { x: number; y: number; scale: number }
export interface Size { width: number; height: number }

export const smallest_scale = 0.05, largest_scale = 8;

export const to_screen = (view: View, p: Point): Point => ({ x: (p.x - view.x) * view.scale, y: (p.y - view.y) * view.scale });
export const to_drawing = (view: View, p: Point): Point => ({ x: p.x / view.scale + view.x, y: p.y / view.scale + view.y });

/** Scales such that what lies under `at` (on the screen) stays there. */
export function zoomed(view: View, at: Point, factor: number): View {
  const scale = Math.min(Math.max(view.scale * factor, smallest_scale), largest_scale);
  const fixed = to_drawing(view, at);
  return { x: fixed.x - at.x / scale, y: fixed.y - at.y / scale, scale };
}

export const panned = (view: View, dx: number, dy: number): View =>
  ({ ...view, x: view.x - dx / view.scale, y: view.y - dy / view.scale });

/** All of `bounds` in the middle of the canvas, at most somewhat enlarged. */
export function fitted(bounds: Rectangle, size: Size, margin = 48): View {
  const width = Math.max(size.width - 2 * margin, 1), height = Math.max(size.height - 2 * margin, 1);
  const wanted = Math.min(width / Math.max(bounds.width, 1), height / Math.max(bounds.height, 1));
  const scale = Math.min(Math.max(wanted, smallest_scale), 1.25);
  return {
    x: bounds.x + bounds.width / 2 - size.width / 2 / scale,
    y: bounds.y + bounds.height / 2 - size.height / 2 / scale,
    scale,
  };
}

export const rectangle = (a: Point, b: Point): Rectangle =>
  ({ x: Math.min(a.x, b.x), y: Math.min(a.y, b.y), width: Math.abs(a.x - b.x), height: Math.abs(a.y - b.y) });
export const contains = (r: Rectangle, p: Point, by = 0): boolean =>
  p.x >= r.x - by && p.x <= r.x + r.width + by && p.y >= r.y - by && p.y <= r.y + r.height + by;
export const meets = (a: Rectangle, b: Rectangle): boolean =>
  a.x <= b.x + b.width && b.x <= a.x + a.width && a.y <= b.y + b.height && b.y <= a.y + a.height;
export const centre = (r: Rectangle): Point => ({ x: r.x + r.width / 2, y: r.y + r.height / 2 });

export function distance_to_line(p: Point, points: Point[]): number {
  let least = Infinity;
  for (let i = 1; i < points.length; ++i) {
    const a = points[i - 1]!, b = points[i]!;
    const dx = b.x - a.x, dy = b.y - a.y, squared = dx * dx + dy * dy;
    const t = squared === 0 ? 0 : Math.min(Math.max(((p.x - a.x) * dx + (p.y - a.y) * dy) / squared, 0), 1);
    least = Math.min(least, Math.hypot(p.x - a.x - t * dx, p.y - a.y - t * dy));
  }
  return least;
}

/** The point halfway along a line. */
export function middle_of(points: Point[]): Point {
  let left = points.slice(1).reduce((sum, p, i) => sum + Math.hypot(p.x - points[i]!.x, p.y - points[i]!.y), 0) / 2;
  for (let i = 1; i < points.length; ++i) {
    const a = points[i - 1]!, b = points[i]!, length = Math.hypot(b.x - a.x, b.y - a.y);
    if (left <= length && length > 0) return { x: a.x + ((b.x - a.x) * left) / length, y: a.y + ((b.y - a.y) * left) / length };
    left -= length;
  }
  return points[0] ?? { x: 0, y: 0 };
}

/** The longest level piece of a line, else its longest one. */
export function longest_piece(points: Point[]): [Point, Point] {
  const pieces = points.slice(1).map((p, i): [Point, Point] => [points[i]!, p]);
  const length = ([a, b]: [Point, Point]) => Math.abs(b.x - a.x) || Math.abs(b.y - a.y) / 1e3;
  return pieces.sort((a, b) => length(b) - length(a))[0] ?? [points[0]!, points[0]!];
}

/** Where a text stands, by what letters usually measure. */
export function text_bounds(shape: Shape): Rectangle {
  const at = shape.points[0] ?? { x: 0, y: 0 }, width = 0.58 * shape.size * shape.text.length;
  const x = at.x - (shape.align === "middle" ? width / 2 : shape.align === "end" ? width : 0);
  return { x, y: at.y - shape.size, width, height: 1.3 * shape.size };
}

const lines_of = (element: Element): Point[][] =>
  element.shapes.filter((shape) => shape.kind === "line").map(({ points }) => points); // also where a mistake colours it
export const wire_line = (element: Element): Point[] => lines_of(element)[0] ?? [];

/** Where a person reads what an element is about. */
export const anchor_of = (element: Element): Point =>
  element.kind === "wire" ? middle_of(wire_line(element)) : centre(element.bounds);

/** Where the badge of a mistake is. */
export const badge_of = (element: Element): Point => {
  const line = wire_line(element);
  return element.kind === "wire" && line.length > 1 ? middle_of(line) : { x: element.bounds.x + element.bounds.width, y: element.bounds.y };
};

/** The side of its element on which a port stands. */
export function side_of({ bounds: { x, y, width, height } }: Element, { at }: Port): Side {
  const far = { left: at.x - x, right: x + width - at.x, top: at.y - y, bottom: y + height - at.y };
  return (Object.keys(far) as Side[]).reduce((a, b) => (far[b] < far[a] ? b : a));
}

/** What tells elements apart: an input of variants has several wires. */
export const key_of = (element: Element): string =>
  element.kind === "wire" ? `${element.from} → ${element.path}` : element.kind === "note" ? `note ${element.path}` : element.path;

/** The key of what stands at a place of the text. */
export const key_of_place = ({ path, from }: TextPlace): string => (from ? `${from} → ${path}` : path);

/** `border`: the point on the border of a state, from all of which transitions are drawn. */
export interface Hit { element: Element; port?: Port; is_name?: boolean; border?: Point }

/** The point of the border that is near; from inside that is less near where little is left by which to move it. */
export function on_border(r: Rectangle, p: Point, tolerance: number): Point | null {
  if (!contains(r, p, tolerance) || contains(r, p, -Math.min(tolerance, r.width / 4, r.height / 4))) return null;
  const at = { x: Math.min(Math.max(p.x, r.x), r.x + r.width), y: Math.min(Math.max(p.y, r.y), r.y + r.height) };
  const sides: Point[] = [{ ...at, x: r.x }, { ...at, x: r.x + r.width }, { ...at, y: r.y }, { ...at, y: r.y + r.height }];
  const far = (q: Point) => Math.hypot(q.x - p.x, q.y - p.y);
  return sides.reduce((a, b) => (far(b) < far(a) ? b : a));
}

/** What lies at a point: a port before its block, a block before wires, what is in front before what is behind. */
export function hit(drawing: Drawing, p: Point, tolerance: number): Hit | null {
  const solid = drawing.elements.filter((element) => element.kind !== "wire").reverse();
  const bordered = (element: Element): Hit | null => {
    const border = element.kind === "state" && on_border(element.bounds, p, tolerance);
    return border ? { element, border } : null;
  };
  let best: Hit | null = null, least = tolerance + 3;
  for (const element of solid)
    for (const port of element.kind === "state" ? [] : element.ports) {
      const distance = Math.hypot(port.at.x - p.x, port.at.y - p.y);
      if (distance < least) [best, least] = [{ element, port }, distance];
    }
  if (best) return best;
  for (const element of solid) {
    const name = element.shapes.find((shape) => shape.kind === "text" && shape.style === "name");
    if (name && contains(text_bounds(name), p)) return { element, is_name: true };
    if (contains(element.bounds, p)) return bordered(element) ?? { element };
  }
  for (const element of solid) {
    const found = bordered(element); // from outside
    if (found) return found;
  }
  const wire = wire_at(drawing, p, tolerance);
  return wire && { element: wire };
}

/** The piece of a line that lies nearest to a point: the index of its first point. */
export function nearest_piece(p: Point, points: Point[]): number {
  const distances = points.slice(1).map((q, i) => distance_to_line(p, [points[i]!, q]));
  return distances.indexOf(Math.min(...distances));
}

/** The wire that runs through a point, or nearly. */
export function wire_at(drawing: Drawing, p: Point, tolerance: number): Element | null {
  const wires = drawing.elements.filter((e) => e.kind === "wire" && contains(e.bounds, p, tolerance));
  const [best] = wires.map((wire) => ({ wire, distance: Math.min(...lines_of(wire).map((line) => distance_to_line(p, line))) }))
    .sort((a, b) => a.distance - b.distance);
  return best && best.distance < tolerance ? best.wire : null;
}

/** What a rubber band holds: blocks that it touches, wires that lie in it. */
export function within(drawing: Drawing, band: Rectangle): Element[] {
  return drawing.elements.filter((element) =>
    element.kind === "wire"
      ? wire_line(element).every((p) => contains(band, p)) && wire_line(element).length > 0
      : meets(band, element.bounds));
}

/** The element whose centre lies nearest in a direction (an arrow key), those straight ahead first. */
export function neighbour(drawing: Drawing, from: Element, direction: Point): Element | null {
  const start = centre(from.bounds);
  let best: Element | null = null, least = Infinity;
  for (const element of drawing.elements) {
    if (element.kind === "wire" || element === from) continue;
    const to = centre(element.bounds), dx = to.x - start.x, dy = to.y - start.y;
    const along = dx * direction.x + dy * direction.y, across = Math.abs(dx * direction.y - dy * direction.x);
    if (along > 1 && along + 2 * across < least) [best, least] = [element, along + 2 * across];
  }
  return best;
}
