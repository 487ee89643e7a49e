import { expect, test } from "vitest";
import { duration_text, field_text, number_text, tick_texts, time_text } from "../src/numbers.ts";

test("fields show numbers with their digits, and with an exponent where zeros would be counted", () => {
  expect([0, 0.5, 300, 2000, -150000, 2e6, 123456789, 0.00025, 1.78e-5, 3.3e-6, -0.02, 1 / 3].map(field_text))
    .toEqual(["0", "0.5", "300", "2000", "-150000", "2e6", "1.23457e8", "0.00025", "1.78e-5", "3.3e-6", "-0.02", "0.333333"]);
});

test("numbers have four digits that matter", () => {
  expect([0, 1 / 3, -1234.56, 1e7, 1.5e-6, Infinity, NaN, 100].map(number_text))
    .toEqual(["0", "0.3333", "−1235", "1.00e7", "1.50e−6", "∞", "NaN", "100"]);
});

test("durations have the unit of their size", () => {
  expect([-20, 0, 1000, 2.5e6].map(duration_text)).toEqual(["−20 µs", "0 µs", "1 ms", "2.5 s"]);
});

test("an instant has the digits that its step has", () => {
  expect([time_text(19.26, 0.01), time_text(1234.5, 0.0005), time_text(3, 1), time_text(0.1 + 0.2, 0.05), time_text(7200, 60), time_text(0.02 * 3, 1 / 50)])
    .toEqual(["19.26", "1234.5000", "3", "0.30", "7200", "0.06"]);
  expect(time_text(1 / 3, 1 / 3)).toBe("0.333333");
});

test("the numbers of an axis are told from each other, however small they or their differences are", () => {
  const ticks = (step: number, from = 0) => tick_texts([0, 1, 2, 3].map((i) => from + i * step), step);
  expect(ticks(0.0004)).toEqual(["0", "0.0004", "0.0008", "0.0012"]);
  expect(ticks(2e-7, -4e-7)).toEqual(["−4e−7", "−2e−7", "0", "2e−7"]);
  expect(ticks(25000, 50000)).toEqual(["0.50e5", "0.75e5", "1.00e5", "1.25e5"]);
  expect(ticks(1e-5, 0.3128)).toEqual(["0.31280", "0.31281", "0.31282", "0.31283"]);
  expect(ticks(0.25)).toEqual(["0", "0.25", "0.50", "0.75"]);
  expect(ticks(5)).toEqual(["0", "5", "10", "15"]);
});
