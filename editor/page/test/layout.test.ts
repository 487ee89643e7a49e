import { expect, test } from "vitest";
import { aligned, bends, bent, distributed, movable, resized, simplified } from "../src/layout.ts";
import type { Element, Point } from "../src/protocol.ts";
import { box } from "./service.ts";

const points = (...list: [number, number][]): Point[] => list.map(([x, y]) => ({ x, y }));
const three = [box("a", 0, 0, [], ["y"], ""), box("b", 100, 30, ["u"], [], ""), box("c", 400, 10, ["u1", "u2", "u3"], [], "")];

test("alignment gives all the same edge and keeps the other coordinate", () => {
  expect(aligned(three, "left").map(({ to }) => to)).toEqual(points([0, 0], [0, 30], [0, 10]));
  expect(aligned(three, "right").map(({ to }) => to.x)).toEqual([400, 400, 400]);
  expect(aligned(three, "bottom").map(({ to }) => to.y)).toEqual([42, 42, 10]); // 40, 40 and 72 high
  expect(aligned(three, "middle").map(({ to }) => to.y)).toEqual([21, 21, 5]);
});
test("distribution makes all gaps equal and moves neither end", () => {
  expect(distributed(three, "x").map(({ to }) => to.x)).toEqual([0, 200, 400]);
  expect(distributed(three.slice(0, 2), "x")).toEqual([]);
});
test("a piece that is moved aside takes its neighbours along", () => {
  const way = points([0, 0], [50, 0], [50, 80], [100, 80]);
  expect(bent(way, 1, 20)).toEqual(points([0, 0], [70, 0], [70, 80], [100, 80]));
});
test("a piece at a port leaves a stub there", () => {
  const way = points([0, 0], [60, 0], [60, 80], [100, 80]);
  expect(bent(way, 0, -20)).toEqual(points([0, 0], [10, 0], [10, -20], [60, -20], [60, 80], [100, 80]));
  expect(bent(way, 2, 20)).toEqual(points([0, 0], [60, 0], [60, 100], [90, 100], [90, 80], [100, 80]));
  expect(bent(points([0, 0], [60, 0]), 0, 30)).toEqual(points([0, 0], [10, 0], [10, 30], [50, 30], [50, 0], [60, 0]));
});
test("a bend by nothing leaves the wire as it is", () => {
  const way = points([0, 0], [50, 0], [50, 80], [100, 80]);
  for (const k of [0, 1, 2]) expect(bent(way, k, 0)).toEqual(way);
  expect(simplified(points([0, 0], [0, 0], [5, 0], [9, 0], [9, 4]))).toEqual(points([0, 0], [9, 0], [9, 4]));
});
test("wires of one source bend together where they run together", () => {
  const wire = (to: string, from: string, corners: Point[]) => ({ kind: "wire", path: to, from, to, corners }) as Element;
  const first = wire("p", "a", points([0, 0], [50, 0], [50, 80], [100, 80]));
  const second = wire("q", "a", points([0, 0], [50, 0], [50, 120], [100, 120]));
  const other = wire("r", "b", points([0, 0], [50, 0], [50, 80], [100, 80]));
  expect(bends([first, second, other], first, 1, 10)).toEqual([
    { path: "p", points: points([60, 0], [60, 80]) }, { path: "q", points: points([60, 0], [60, 120]) }]);
  expect(bends([first, second, other], first, 2, 10).map(({ path }) => path)).toEqual(["p"]);
});
test("arrow keys move the longest inner piece that runs across", () => {
  const way = points([0, 0], [50, 0], [50, 80], [90, 80], [90, 100], [200, 100]);
  expect(movable(way, "x")).toBe(1);
  expect(movable(way, "y")).toBe(2);
  expect(movable(points([0, 0], [60, 0]), "y")).toBe(0);
  expect(movable(points([0, 0], [60, 0]), "x")).toBeNull();
});
test("a handle moves its sides and no other, and never turns a block over", () => {
  const r = { x: 10, y: 20, width: 60, height: 40 };
  expect(resized(r, { x: 1, y: 0 }, { x: 15, y: 99 })).toEqual({ x: 10, y: 20, width: 75, height: 40 });
  expect(resized(r, { x: -1, y: -1 }, { x: 10, y: -5 })).toEqual({ x: 20, y: 15, width: 50, height: 45 });
  expect(resized(r, { x: -1, y: 0 }, { x: 500, y: 0 })).toEqual({ x: 50, y: 20, width: 20, height: 40 });
});
