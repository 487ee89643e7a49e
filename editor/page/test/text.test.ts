import { describe, expect, test } from "vitest";
import { clashing, edits_between } from "../src/text.ts";

const base = "a: 1\nb: 2\nc: 3\nd: 4\n";

describe("what two have changed in a text", () => {
  test("is told by its places in it", () => {
    expect(edits_between(base, base)).toEqual([]);
    expect(edits_between(base, base.replace("2", "7").replace("4", "9"))).toEqual([
      { from: 8, to: 9, insert: "7" }, { from: 18, to: 19, insert: "9" }]);
  });
  test("clashes where both have changed a line, and nowhere else", () => {
    const mine = edits_between(base, base.replace("2", "2 + ["));
    expect(clashing(base, edits_between(base, base.replace("1", "8").replace("3", "8")), mine)).toEqual([]);
    expect(clashing(base, edits_between(base, base.replace("2", "8").replace("4", "9")), mine)).toEqual([{ from: 8, to: 9, insert: "8" }]);
    expect(clashing(base, edits_between(base, base.replace("b: 2\n", "")), mine)).toHaveLength(1);
    expect(clashing(base, edits_between(base, ""), mine)).toHaveLength(1);
    expect(clashing(base, edits_between(base, base + "e: 5"), edits_between(base, base + "f: 6"))).toHaveLength(1);
  });
});
