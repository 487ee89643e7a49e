import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { describe, expect, test } from "vitest";
import { commands, key_text } from "../src/commands.ts";
import { ranked } from "../src/entries.ts";

const source = process.env.BF_SOURCE;
const marks = ["<!-- keys: written from editor/page/src/commands.ts -->\n", "<!-- keys: end -->"] as const;
/** "?" is also "Shift+?" where it needs that. */
const told = (keys: string[]) => keys.filter((key) => !keys.some((other) => key === `Shift+${other}`)).map((key) => `\`${key_text(key)}\``).join(" or ");

const table = (["Edit", "Look", "Run"] as const).map((group) =>
  `| ${group} | |\n| --- | --- |\n` + commands.filter((command) => command.group === group && command.keys.length > 0)
    .map((command) => `| ${command.title} | ${told(command.keys)} |\n`).join("")).join("\n");

test("no two commands have the same key", () => {
  const keys = commands.flatMap((command) => command.keys);
  expect(keys.filter((key, i) => keys.indexOf(key) !== i)).toEqual([]);
});

test("the search offers first what has the words in the order in which they are typed, and what is meant before what begins so", () => {
  const entry = (title: string, is_meant = false) => ({ title, detail: "", group: "", is_meant });
  const both = [entry("area1.y → balance1.area"), entry("balance1.h → area1.u")];
  expect(ranked(both, "balance1 area").map(({ title }) => title)).toEqual(["balance1.h → area1.u", "area1.y → balance1.area"]);
  expect(ranked(both, "area1 balance").map(({ title }) => title)).toEqual(["area1.y → balance1.area", "balance1.h → area1.u"]);
  expect(ranked([entry("Run or pause"), entry("State run", true)], "run")[0]!.title).toBe("State run");
  expect(ranked([entry("Undo"), entry("State undo", true)], "undo")[0]!.title).toBe("Undo");
});

describe.skipIf(!source)("docs/how-to/edit_in_the_browser.md", () => {
  // With BF_WRITE_KEYS the test writes the table that it asks for.
  test("lists all keys", () => {
    const file = join(source!, "docs/how-to/edit_in_the_browser.md"), text = readFileSync(file, "utf8");
    const [before, rest] = text.split(marks[0]) as [string, string], after = rest.slice(rest.indexOf(marks[1]));
    const wanted = `${before}${marks[0]}${table}${after}`;
    if (process.env.BF_WRITE_KEYS) writeFileSync(file, wanted);
    else expect(text).toBe(wanted);
  });
});
