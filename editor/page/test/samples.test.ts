import { describe, expect, test } from "vitest";
import { decimated, number_text, Samples, Track } from "../src/samples.ts";
import { frame } from "./service.ts";

function track(f: (t: number) => number, n: number): Track {
  const made = new Track(1);
  for (let i = 0; i < n; ++i) made.push(i / n, () => f(i / n));
  return made;
}

describe("frames", () => {
  test("hold samples of several signals of several elements", () => {
    const samples = new Samples();
    samples.take(frame([{ index: 3, time: 0.5, values: [1, -2, 3] }, { index: 7, time: 0.5, values: [9] }, { index: 3, time: 1, values: [4, 5, 6] }]));
    expect(samples.tracks.get(3)!.at(0.7)).toEqual([1, -2, 3]);
    expect(samples.tracks.get(3)!.at(1)).toEqual([4, 5, 6]);
    expect(samples.tracks.get(7)!.at(0.4)).toBeNull();
  });
  test("that end too early are not read beyond their end", () => {
    const samples = new Samples();
    samples.take(frame([{ index: 3, time: 1, values: [4, 5, 6] }]).slice(0, 32));
    expect(samples.tracks.size).toBe(0);
  });
});

describe("a track", () => {
  test("forgets what a run that went back has not reached again", () => {
    const made = track((t) => t, 5000);
    made.push(0.25, () => 42);
    expect(made.length).toBe(1251);
    expect(made.at(0.9)).toEqual([42]);
    expect(made.at(0.1)).toEqual([0.1]);
  });
});

describe("a plot", () => {
  test("shows the least and the greatest value of each column, so that no peak is lost", () => {
    const made = track((t) => (Math.abs(t - 0.5) < 1e-9 ? 100 : Math.sin(40 * t)), 100_000);
    const [times, values] = decimated([{ track: made, element: 0 }], 0, 1, 300, 1);
    expect(times).toHaveLength(600);
    expect(Math.max(...(values as number[]))).toBe(100);
    for (let c = 0; c < 300; ++c) {
      if (c % 50 !== 0) continue;
      const inside = Array.from({ length: made.length }, (_, i) => i).filter((i) => Math.floor(made.times[i]! * 300 + 1e-9) === c);
      expect(Math.min(...(values!.slice(2 * c, 2 * c + 2) as number[]))).toBeCloseTo(Math.min(...inside.map((i) => made.values[0]![i]!)), 3);
    }
  });
  test("holds values between samples, from the first one to where the run is", () => {
    const made = new Track(1);
    [[0.25, 1], [0.65, 2]].forEach(([t, v]) => made.push(t!, () => v!));
    expect(decimated([{ track: made, element: 0 }], 0, 1, 10, 0.85)[1]!.filter((_, i) => i % 2 === 0))
      .toEqual([null, null, 1, 1, 1, 1, 2, 2, 2, null]);
  });
});

test("numbers have four digits that matter", () => {
  expect([0, 1 / 3, -1234.56, 1e7, 1.5e-6, Infinity, NaN, 100].map(number_text))
    .toEqual(["0", "0.3333", "−1235", "1.00e7", "1.50e−6", "∞", "NaN", "100"]);
});
