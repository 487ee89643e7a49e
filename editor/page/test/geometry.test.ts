import { describe, expect, test } from "vitest";
import {
  contains, distance_to_line, fitted, hit, key_of, middle_of, neighbour, to_drawing, to_screen, within, zoomed,
} from "../src/geometry.ts";
import { Model } from "./service.ts";

const drawing = new Model().draw("", []);
const named = (path: string) => drawing.elements.find((e) => e.path === path)!;

describe("the view", () => {
  test("keeps the point under the pointer where it is while one zooms", () => {
    const view = { x: -30, y: 12, scale: 0.7 }, at = { x: 210, y: 95 }, fixed = to_drawing(view, at);
    for (const factor of [0.01, 0.5, 1.3, 1000]) {
      const back = to_screen(zoomed(view, at, factor), fixed);
      expect(back.x).toBeCloseTo(at.x, 9);
      expect(back.y).toBeCloseTo(at.y, 9);
    }
  });
  test("shows all corners of the drawing after fit", () => {
    for (const bounds of [{ x: -500, y: 20, width: 3000, height: 100 }, { x: 10, y: 10, width: 5, height: 900 }]) {
      const size = { width: 640, height: 480 }, view = fitted(bounds, size);
      for (const p of [bounds, { x: bounds.x + bounds.width, y: bounds.y + bounds.height }])
        expect(contains({ x: 0, y: 0, ...size }, to_screen(view, p))).toBe(true);
    }
  });
});

describe("lines", () => {
  const corner = [{ x: 0, y: 0 }, { x: 10, y: 0 }, { x: 10, y: 10 }];
  test("are as far as their nearest point", () => {
    expect(distance_to_line({ x: 5, y: 3 }, corner)).toBe(3);
    expect(distance_to_line({ x: 13, y: 14 }, corner)).toBe(5);
    expect(distance_to_line({ x: 1, y: 1 }, [{ x: 1, y: 1 }, { x: 1, y: 1 }])).toBe(0);
  });
  test("have their middle halfway along", () => {
    expect(middle_of(corner)).toEqual({ x: 10, y: 0 });
    expect(middle_of([{ x: 0, y: 0 }, { x: 4, y: 0 }])).toEqual({ x: 2, y: 0 });
    expect(middle_of([{ x: 3, y: 3 }])).toEqual({ x: 3, y: 3 });
  });
});

describe("a hit", () => {
  test("is the port before its block, and the block before wires", () => {
    expect(hit(drawing, { x: 281, y: 81 }, 6)).toMatchObject({ element: { path: "gain" }, port: { name: "u" } });
    expect(hit(drawing, { x: 300, y: 80 }, 6)).toMatchObject({ element: { path: "gain" } });
    expect(hit(drawing, { x: 300, y: 80 }, 6)!.port).toBeUndefined();
  });
  test("is a wire near the pointer, and nothing elsewhere", () => {
    expect(hit(drawing, { x: 250, y: 84 }, 6)).toMatchObject({ element: { kind: "wire", from: "error", to: "gain" } });
    expect(hit(drawing, { x: 250, y: 140 }, 6)).toBeNull();
  });
  test("tells the name beneath a block", () => {
    expect(hit(drawing, { x: 310, y: 112 }, 6)).toMatchObject({ element: { path: "gain" }, is_name: true });
  });
});

test("a rubber band takes blocks that it touches and wires that lie in it", () => {
  const taken = within(drawing, { x: 225, y: 40, width: 100, height: 80 }).map(key_of);
  expect(taken).toContain("gain");
  expect(taken).not.toContain("error");
  expect(within(drawing, { x: 215, y: 40, width: 130, height: 80 }).map(key_of)).toEqual(
    expect.arrayContaining(["error → gain.u", "error", "gain"]));
});

test("arrow keys go to the block straight ahead", () => {
  expect(neighbour(drawing, named("error"), { x: 1, y: 0 })!.path).toBe("gain");
  expect(neighbour(drawing, named("gain"), { x: -1, y: 0 })!.path).toBe("error");
  expect(neighbour(drawing, named("reference"), { x: -1, y: 0 })).toBeNull();
});
