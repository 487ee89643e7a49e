import { describe, expect, test } from "vitest";
import { decimated, most_samples, paired, Samples, Track } from "../src/samples.ts";
import { frame } from "./service.ts";

function track(f: (t: number) => number, n: number): Track {
  const made = new Track(1);
  for (let i = 0; i < n; ++i) made.add([{ time: i / n, at: () => f(i / n) }]);
  return made;
}

describe("frames", () => {
  test("hold samples of several signals of several elements", () => {
    const samples = new Samples();
    samples.take(frame([{ index: 3, time: 0.5, values: [1, -2, 3] }, { index: 7, time: 0.5, values: [9] }, { index: 3, time: 1, values: [4, 5, 6] }]));
    expect(samples.along(0, 3)!.at(0.7)).toEqual([1, -2, 3]);
    expect(samples.along(0, 3)!.at(1)).toEqual([4, 5, 6]);
    expect(samples.along(0, 7)!.at(0.4)).toBeNull();
  });
  test("that end too early are not read beyond their end", () => {
    const samples = new Samples();
    samples.take(frame([{ index: 3, time: 1, values: [4, 5, 6] }]).slice(0, 36));
    expect(samples.along(0, 3)).toBeUndefined();
  });
});

describe("a track", () => {
  test("has its samples in the order of time, whatever the order in which they come", () => {
    const ordered = track((t) => t, 3000), made = new Track(1);
    for (let i = 0; i < 3000; ++i) made.add([{ time: ((i * 7) % 3000) / 3000, at: () => ((i * 7) % 3000) / 3000 }]);
    for (let i = 0; i < 3000; i += 5) made.add([{ time: i / 3000, at: () => i / 3000 }]); // and again
    expect(made.length).toBe(3000);
    expect(made.times.subarray(0, 3000)).toEqual(ordered.times.subarray(0, 3000));
    expect(made.values[0]!.subarray(0, 3000)).toEqual(ordered.values[0]!.subarray(0, 3000));
  });
});

describe("a track without an end", () => {
  test("keeps the newest samples", () => {
    const made = track((t) => t, most_samples + 10);
    expect(made.length).toBe(most_samples / 2 + 10);
    expect(made.at(1)).toEqual([(most_samples + 9) / (most_samples + 10)]);
    expect(made.at(0.4)).toBeNull();
  });
});

describe("a branch", () => {
  const info = (index: number, parent: number, from: number) => ({ index, parent, from, reached: 3, cause: "" });
  test("is what it comes from until it begins, and forgotten with it", () => {
    const samples = new Samples();
    samples.keep([info(0, -1, 0), info(1, 0, 1), info(2, 1, 2)]);
    for (const branch of [0, 1, 2]) for (const time of [0, 1, 2]) if (time >= branch)
      samples.take(frame([{ index: 5, branch, time, values: [10 * branch + time] }]));
    const seen = (branch: number) => [0, 1, 2].map((time) => samples.along(branch, 5)!.at(time)![0]);
    expect([seen(0), seen(1), seen(2)]).toEqual([[0, 1, 2], [0, 11, 12], [0, 11, 22]]);
    samples.take(frame([{ index: 5, branch: 0, time: 0.5, values: [0.5] }]));
    expect(samples.along(2, 5)!.at(0.7)).toEqual([0.5]);
    samples.keep([info(0, -1, 0)]);
    expect(samples.along(1, 5)).toBeUndefined();
    samples.keep([]); // as of a run of another program
    expect(samples.along(0, 5)!.at(2)).toEqual([2]);
  });
});

const course = (track: Track, until: number, is_continuous = false) => ({ track, element: 0, until, is_continuous });

describe("a plot", () => {
  test("ends each line where that was known last, whatever the others reach", () => {
    const short = track((t) => t, 10), long = track((t) => t, 10); // the last samples at 0.9
    const [, a, b] = decimated([course(short, 1), course(long, 3)], 0, 4, 40);
    const last = (line: (number | null)[]) => line.findLastIndex((value) => value !== null);
    expect([last(a!), last(b!)].map((i) => Math.round(i / 2))).toEqual([11, 31]);
  });
  test("runs straight between samples of a continuous signal, and keeps its extent where they are many", () => {
    const made = new Track(1);
    for (let t = 0; t <= 10; ++t) made.add([{ time: t, at: () => 3 * t }]);
    const [times, values] = decimated([course(made, 10, true)], 0, 10, 100);
    times!.forEach((t, i) => { if (t! <= 9.9) expect(values![i]! - 3 * t!).toBeCloseTo(0, 0.5); });
    for (let i = 1; i < 195; ++i) expect(values![i]! - values![i - 1]!).toBeLessThan(0.31); // no stairs
    const many = track((t) => (Math.abs(t - 0.5) < 1e-9 ? 100 : Math.sin(40 * t)), 100_000);
    expect(decimated([course(many, 1, true)], 0, 1, 300)).toEqual(decimated([course(many, 1)], 0, 1, 300));
  });
  test("shows the least and the greatest value of each column, so that no peak is lost", () => {
    const made = track((t) => (Math.abs(t - 0.5) < 1e-9 ? 100 : Math.sin(40 * t)), 100_000);
    const [times, values] = decimated([course(made, 1)], 0, 1, 300);
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
    [[0.25, 1], [0.65, 2]].forEach(([t, v]) => made.add([{ time: t!, at: () => v! }]));
    expect(decimated([course(made, 0.85)], 0, 1, 10)[1]!.filter((_, i) => i % 2 === 0))
      .toEqual([null, null, 1, 1, 1, 1, 2, 2, 2, null]);
  });
});

test("pairs what one signal is with what the other was last", () => {
  const x = new Track(1), y = new Track(1);
  for (let i = 0; i < 10; ++i) x.add([{ time: i, at: () => 10 * i }]);
  for (let i = 0; i < 10; i += 3) y.add([{ time: i, at: () => i }]);
  expect(paired({ track: x, element: 0 }, { track: y, element: 0 }, 5, 100)).toEqual([[0, 10, 20, 30, 40, 50], [0, 0, 0, 3, 3, 3]]);
  expect(paired({ track: x, element: 0 }, { track: y, element: 0 }, 9, 4)[0]).toEqual([0, 30, 60, 90]);
});
test("remembers the least and the greatest that a signal has been", () => {
  const track = new Track(1);
  for (const [i, value] of [3, -2, 5, 1].entries()) track.add([{ time: i, at: () => value }]);
  expect([track.least(0), track.greatest(0)]).toEqual([-2, 5]);
});
