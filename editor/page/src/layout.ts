// Where blocks and wires go when a person lays them out by hand.
import { nearest_piece } from "./geometry.ts";
import { is_block } from "./operations.ts";
import type { Element, Point, Port, Rectangle } from "./protocol.ts";

export type Edge = "left" | "centre" | "right" | "top" | "middle" | "bottom";
export type Axis = "x" | "y";
export interface Placing { path: string; to: Point }

const length_of = { x: "width", y: "height" } as const;

/** Each element with the same edge, or middle line, as all of them together. */
export function aligned(elements: Element[], edge: Edge): Placing[] {
  const axis: Axis = edge === "left" || edge === "centre" || edge === "right" ? "x" : "y", length = length_of[axis];
  const share = edge === "left" || edge === "top" ? 0 : edge === "centre" || edge === "middle" ? 0.5 : 1;
  const low = Math.min(...elements.map((e) => e.bounds[axis])), high = Math.max(...elements.map((e) => e.bounds[axis] + e.bounds[length]));
  return elements.map(({ path, bounds }) => {
    const to = Math.round(low + share * (high - low) - share * bounds[length]);
    return { path, to: { x: bounds.x, y: bounds.y, [axis]: to } };
  });
}

/** The same gap between neighbours; the first and the last stay. */
export function distributed(elements: Element[], axis: Axis): Placing[] {
  const length = length_of[axis], sorted = [...elements].sort((a, b) => a.bounds[axis] - b.bounds[axis]);
  const last = sorted.at(-1);
  if (!last || sorted.length < 3) return [];
  const room = last.bounds[axis] + last.bounds[length] - sorted[0]!.bounds[axis];
  const gap = (room - sorted.reduce((sum, e) => sum + e.bounds[length], 0)) / (sorted.length - 1);
  let at = sorted[0]!.bounds[axis];
  return sorted.map(({ path, bounds }) => {
    const to = { x: bounds.x, y: bounds.y, [axis]: Math.round(at) };
    at += bounds[length] + gap;
    return { path, to };
  });
}

/** Without points that repeat or lie within a straight piece. */
export function simplified(points: Point[]): Point[] {
  const result: Point[] = [];
  for (const p of points) {
    const b = result.at(-1), a = result.at(-2);
    if (b && b.x === p.x && b.y === p.y) continue;
    if (a && b && ((a.x === b.x && b.x === p.x) || (a.y === b.y && b.y === p.y))) result.pop();
    result.push(p);
  }
  return result;
}

/** The axis along which the piece from point `k` on runs. */
export const axis_of = (points: Point[], k: number): Axis => (points[k]!.y === points[k + 1]!.y ? "x" : "y");
const other = { x: "y", y: "x" } as const;
/** New blocks and those that are dragged stand on multiples of this. */
export const grid = 5;
export const on_grid = (p: Point): Point => ({ x: Math.round(p.x / grid) * grid, y: Math.round(p.y / grid) * grid });
/** Where something stands so that its input lies on the piece of a wire that is nearest to a point. */
export function onto(wire: Element, p: Point, { bounds }: Element, input: Port): Point {
  const k = nearest_piece(p, wire.corners), on = on_grid({ x: p.x - bounds.width / 2, y: p.y - bounds.height / 2 });
  return !wire.as_labels && axis_of(wire.corners, k) === "x" ? { ...on, y: wire.corners[k]!.y - (input.at.y - bounds.y) } : on;
}
const stub = 10; // what stays straight at a port

/** The wire with its piece from point `k` on moved aside by `by`; its ends stay at their ports. */
export function bent(points: Point[], k: number, by: number): Point[] {
  const axis = axis_of(points, k), across = other[axis], a = points[k]!, b = points[k + 1]!;
  const forward = Math.sign(b[axis] - a[axis]) * Math.min(stub, Math.abs(b[axis] - a[axis]) / 3);
  const aside = (p: Point, along = 0): Point => ({ ...p, [axis]: p[axis] + along, [across]: p[across] + by });
  const on = (p: Point, along: number): Point => ({ ...p, [axis]: p[axis] + along });
  const from = k === 0 ? [a, on(a, forward), aside(a, forward)] : [...points.slice(0, k), aside(a)];
  const to = k + 2 === points.length ? [aside(b, -forward), on(b, -forward), b] : [aside(b), ...points.slice(k + 2)];
  return simplified([...from, ...to]);
}

/** Bends of all wires of one source that share the piece, so that they stay one line. */
export function bends(wires: Element[], wire: Element, k: number, by: number): { path: string; points: Point[] }[] {
  const axis = axis_of(wire.corners, k), across = other[axis], a = wire.corners[k]!, b = wire.corners[k + 1]!;
  const [low, high] = a[axis] < b[axis] ? [a[axis], b[axis]] : [b[axis], a[axis]];
  return wires.filter((w) => w.kind === "wire" && w.from === wire.from).flatMap((w) => {
    const shared = w.corners.findIndex((p, i) => {
      const q = w.corners[i + 1];
      return q && axis_of(w.corners, i) === axis && p[across] === a[across] && Math.max(p[axis], q[axis]) > low && Math.min(p[axis], q[axis]) < high;
    });
    return shared < 0 ? [] : [{ path: w.path, points: bent(w.corners, shared, by).slice(1, -1) }];
  });
}

/** The piece of a wire that arrow keys move aside along `axis`: the longest that runs across it. */
export function movable(points: Point[], axis: Axis): number | null {
  const length = (k: number) => Math.abs(points[k + 1]!.x - points[k]!.x) + Math.abs(points[k + 1]!.y - points[k]!.y);
  const pieces = points.slice(1).map((_, k) => k).filter((k) => axis_of(points, k) === other[axis]);
  const inner = pieces.filter((k) => k > 0 && k + 2 < points.length);
  return (inner.length > 0 ? inner : pieces).sort((a, b) => length(b) - length(a))[0] ?? null;
}

/** Sides that a handle moves: -1 left or top, 1 right or bottom. */
export interface Handle { x: -1 | 0 | 1; y: -1 | 0 | 1 }
export const handles: Handle[] = ([-1, 0, 1] as const).flatMap((x) => ([-1, 0, 1] as const).map((y) => ({ x, y }))).filter(({ x, y }) => x !== 0 || y !== 0);
export const handle_at = (r: Rectangle, { x, y }: Handle): Point => ({ x: r.x + ((1 + x) * r.width) / 2, y: r.y + ((1 + y) * r.height) / 2 });

/** What a person takes to resize an element, on a drawing of that scale; all of a state's border is for transitions. */
export function grips(element: Element, scale: number): { handle: Handle; at: Point }[] {
  const { kind, bounds: { x, y, width, height } } = element, is_state = kind === "state", out = is_state ? 8 / scale : 0;
  if (!is_state && !is_block(element)) return [];
  const around = { x: x - out, y: y - out, width: width + 2 * out, height: height + 2 * out };
  return handles.filter((handle) => !is_state || (handle.x !== 0 && handle.y !== 0)).map((handle) => ({ handle, at: handle_at(around, handle) }));
}

/** The rectangle with the sides of a handle moved; the other sides stay, and it does not get smaller than `least`. */
export function resized(r: Rectangle, handle: Handle, by: Point, least = 20): Rectangle {
  const width = Math.max(r.width + handle.x * by.x, least), height = Math.max(r.height + handle.y * by.y, least);
  return { x: handle.x < 0 ? r.x + r.width - width : r.x, y: handle.y < 0 ? r.y + r.height - height : r.y, width, height };
}
