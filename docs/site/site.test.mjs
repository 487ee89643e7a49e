// What site.mjs writes of this repository and of small ones. Browsers look at the whole site in
// editor/page/test/browser/site.test.ts.
import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import { existsSync, globSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { after, test } from "node:test";

const { BF_SOURCE: source, BF_MODULES: modules } = process.env;
const scratch = mkdtempSync(join(tmpdir(), "bf-site-test-"));
after(() => rmSync(scratch, { recursive: true }));

function site(root, name) {
  const output = join(scratch, name);
  const { status, stderr } = spawnSync(process.execPath, [join(source, "docs/site/site.mjs"), root, modules, output], { encoding: "utf8" });
  return { output, status, stderr };
}
/** A repository of these files, besides those that each needs. */
function repository(name, files) {
  const root = join(scratch, name);
  const all = { "README.md": "# Small\n", "docs/README.md": "# Docs\n", "examples/README.md": "# Examples\n",
    "editor/page/public/icon.svg": "<svg/>", ...files };
  for (const [file, text] of Object.entries(all)) {
    mkdirSync(dirname(join(root, file)), { recursive: true });
    writeFileSync(join(root, file), text);
  }
  return root;
}

test("every link and image of the site leads to a file of it, and every anchor to a heading", () => {
  const { output, status, stderr } = site(source, "whole");
  assert.equal(stderr, "");
  assert.equal(status, 0);
  const pages = globSync("**/*.html", { cwd: output });
  assert.ok(pages.length > 60);
  let links = 0;
  for (const page of pages) {
    const html = readFileSync(join(output, page), "utf8");
    for (const [, address] of html.matchAll(/ (?:href|src)="([^"]*)"/g)) {
      if (/^https?:/.test(address)) continue;
      const [path, anchor] = address.split("#"), file = path ? join(output, dirname(page), decodeURI(path)) : join(output, page);
      assert.ok(existsSync(file), `${page}: ${address}`);
      if (anchor) assert.ok(readFileSync(file, "utf8").includes(` id="${anchor}"`), `${page}: ${address}`);
      ++links;
    }
  }
  assert.ok(links > 1000);
  for (const file of globSync("docs/{start,concepts,how-to,reference}/*.md", { cwd: source }))
    assert.ok(pages.includes(file.replace(/md$/, "html")), `${file} is reached by no link`);
});

test("links and anchors that lead nowhere are named", () => {
  const root = repository("broken", { "README.md": "# Small\n\n[a](docs/none.md) [b](docs/README.md#nothing) ![c](c.png) [d](../../outside) [e](#small)\n" });
  const { status, stderr } = site(root, "broken-site");
  assert.equal(status, 1);
  assert.deepEqual(stderr.trim().split("\n"), [
    "README.md: docs/none.md leads nowhere", "README.md: c.png leads nowhere", "README.md: ../../outside leads nowhere",
    "README.md: docs/README.md#nothing leads to no heading"]);
});

test("pages run no script and load nothing from elsewhere, whatever stands in the text", () => {
  const root = repository("hostile", {
    "README.md": "# A <b>\n\n<script>alert(1)</script> [x](javascript:alert(1)) [m](m.yaml)\n\n```cpp\nint a = 1; // <i>\n```\n\n| n |\n| ---: |\n| 1 |\n",
    "m.yaml": "model: m # </pre><script>alert(2)</script>\n" });
  const { output, status } = site(root, "hostile-site");
  assert.equal(status, 0);
  const html = readFileSync(join(output, "index.html"), "utf8"), listing = readFileSync(join(output, "m.yaml.html"), "utf8");
  for (const page of [html, listing]) {
    assert.ok(page.includes("default-src 'none'; style-src 'self'; img-src 'self'; base-uri 'none'; form-action 'none'\""));
    assert.ok(!/<script|javascript:[^)]*"| style=| on\w+=/.test(page));
  }
  assert.ok(html.includes("<title>A &lt;b&gt; – BlockFactory</title>"));
  assert.ok(html.includes('<td class="right">1</td>'));
  const text = listing.match(/<pre tabindex="0"><code>(.*)<\/code><\/pre>/s)[1].replace(/<\/?span[^>]*>/g, "");
  assert.equal(text.replaceAll("&lt;", "<").replaceAll("&gt;", ">"), "model: m # </pre><script>alert(2)</script>\n");
});

test("a folder without a README is a list of its files, and one that is there already is not written into", () => {
  const root = repository("folders", { "README.md": "# Small\n\n[f](f)\n", "f/b.txt": "b", "f/a.txt": "a" });
  const { output } = site(root, "folders-site");
  const list = readFileSync(join(output, "f/index.html"), "utf8");
  assert.deepEqual([...list.matchAll(/<li><a href="(\w\.txt\.html)">/g)].map((found) => found[1]), ["a.txt.html", "b.txt.html"]);
  assert.match(site(root, "folders-site").stderr, /is there already; name a new folder/);
});
