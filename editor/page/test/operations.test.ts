import { describe, expect, test } from "vitest";
import { commands } from "../src/commands.ts";
import { ranked, score } from "../src/entries.ts";
import { connection, end_of_new, fits, fresh_name, joined, name_for, numbers_of, parent_of, redeclared, removal } from "../src/operations.ts";
import { Model } from "./service.ts";

const drawing = new Model().draw("", []);
const named = (path: string) => drawing.elements.find((e) => e.path === path)!;
const end = (path: string, port: string) => ({ element: named(path), port: named(path).ports.find((p) => p.name === port)! });

test("paths are joined and taken apart", () => {
  expect(joined("", "a")).toBe("a");
  expect(joined("a.b", "c")).toBe("a.b.c");
  expect([parent_of("a.b.c"), parent_of("a"), parent_of("")]).toEqual(["a.b", "", ""]);
});

describe("names of new blocks", () => {
  test("are those of their type, small, and taken by nothing", () => {
    expect(["Gain", "WholeBodyToolbox/MassMatrix", "PID"].map(name_for)).toEqual(["gain", "massMatrix", "pid"]);
    expect(fresh_name(drawing, "gain")).toBe("gain2");
    expect(fresh_name(drawing, "sum")).toBe("sum");
  });
});

describe("a wire", () => {
  test("leads from an output to an input without one", () => {
    expect(fits(end("gain", "y").port, end("scope", "u").port)).toBe(true);
    expect(fits(end("scope", "u").port, end("gain", "y").port)).toBe(true);
    expect(fits(end("gain", "y").port, end("error", "u1").port)).toBe(false);
    expect(fits(end("gain", "y").port, end("error", "y").port)).toBe(false);
  });
  test("names its ends shortly where a block has one port, whichever end was first", () => {
    const wanted = { do: "connect", system: "", from: "gain", to: "error.u1" };
    expect(connection("", end("gain", "y"), end("error", "u1"))).toEqual(wanted);
    expect(connection("", end("error", "u1"), end("gain", "y"))).toEqual(wanted);
  });
  test("takes the first port of a new block, by the block's name alone where there is no other", () => {
    const port = (name: string) => ({ name, doc: "" });
    const sum = { name: "Sum", group: "", doc: "", inputs: [port("u1"), port("u2")], outputs: [port("y")] };
    expect(end_of_new(sum, "sum", end("gain", "y").port)).toBe("sum.u1");
    expect(end_of_new(sum, "sum", end("scope", "u").port)).toBe("sum");
    expect(end_of_new({ ...sum, inputs: [] }, "sum", end("gain", "y").port)).toBeNull();
  });
});

test("what is removed takes its wires along, and they are removed once", () => {
  const chosen = drawing.elements.filter((e) => e.path === "gain" || e.kind === "wire");
  expect(removal("", chosen)).toEqual({ do: "batch", operations: [
    { do: "disconnect", system: "", from: "reference", to: "error.u1" },
    { do: "disconnect", system: "", from: "motor", to: "error.u2" },
    { do: "remove", path: "gain" },
  ] });
});

test("another value leaves the rest of a variable's declaration", () => {
  const field = { system: "", name: "Gain.Kp", text: "1", value: "1", unit: "V", doc: "", limits: "at least 0", minimum: "0", above: null, maximum: null, least: 0, greatest: null, mistake: "", used_by: [] };
  expect(redeclared(field, { value: "2" })).toEqual({ do: "set_variable", system: "", name: "Gain.Kp", variable: { value: "2", unit: "V", minimum: "0" } });
});

describe("the search", () => {
  const entry = (title: string, detail = "") => ({ title, detail, group: "" });
  test("puts the name before what contains it, and both before what is told of others", () => {
    const all = [entry("Sum", "adds, as a gain of 1"), entry("MatrixGain"), entry("Gain"), entry("Step")];
    expect(ranked(all, "gain").map((e) => e.title)).toEqual(["Gain", "MatrixGain", "Sum"]);
  });
  test("knows initials and letters in order", () => {
    expect(score(entry("DiscreteIntegrator"), "di")).toBeGreaterThan(score(entry("Display", ""), "dy"));
    expect(score(entry("DiscreteIntegrator"), "dint")).toBeGreaterThan(0);
    expect(score(entry("DiscreteIntegrator"), "xyz")).toBe(0);
    expect(score(entry("position.y → p"), "position.y p")).toBeGreaterThan(score(entry("position.y → turning.u1"), "position.y p"));
  });
});

test("no key means two things", () => {
  const keys = commands.flatMap((command) => command.keys);
  expect(keys.filter((key, i) => keys.indexOf(key) !== i)).toEqual([]);
});

test("reads numbers column by column, and nothing that is no number", () => {
  expect(numbers_of("0.1")).toEqual([0.1]);
  expect(numbers_of("[1 2; 3, -4e-1]")).toEqual([1, 3, 2, -0.4]);
  for (const text of ["", "2*pi", "[1 2; 3]", "[1 2 …"]) expect(numbers_of(text)).toEqual([]);
});
