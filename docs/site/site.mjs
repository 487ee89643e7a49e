// usage: node site.mjs ROOT MODULES OUTPUT [BF]: writes the documentation in ROOT as a folder of HTML pages, which any web
// server or the file system shows: README.md and all that its links lead to, pages as pages, other files as listings,
// folders as lists. MODULES is a folder with node_modules of editor/page. With BF, the command, the examples of standard
// blocks are run and published, and the pages that tell of them lead there. Exits 1 and names each link that leads nowhere.
import { execFileSync } from "node:child_process";
import { copyFileSync, existsSync, globSync, mkdirSync, mkdtempSync, readFileSync, readdirSync, rmSync, statSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { tmpdir } from "node:os";
import { join, posix, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const [root, modules, output, command] = process.argv.slice(2);
const require = createRequire(join(resolve(modules), "package.json"));
const MarkdownIt = require("markdown-it");
const { highlightCode, classHighlighter } = require("@lezer/highlight");
const { cppLanguage: { parser: cpp } } = require("@codemirror/lang-cpp");
const { yamlLanguage: { parser: yaml } } = require("@codemirror/lang-yaml");

const here = fileURLToPath(new URL(".", import.meta.url));
const parsers = { yaml, cpp, c: cpp, h: cpp, hpp: cpp };
const first = "README.md", lists = ["docs/README.md", "examples/README.md"];
const problems = [];
const read = (source) => readFileSync(join(root, source), "utf8");
const is_image = (source) => /\.(png|svg)$/.test(source);
const is_folder = (source) => statSync(join(root, source)).isDirectory();
const folder_of = (source) => (is_folder(source) ? source : posix.dirname(source));

/** Where a file of the repository stands in the site. */
function place_of(source) {
  if (is_image(source)) return source;
  if (is_folder(source)) return `${source}/index.html`;
  return source.endsWith(".md") ? source.replace(/README\.md$/, "index.md").replace(/\.md$/, ".html") : `${source}.html`;
}
const address = (from, to) => encodeURI(posix.relative(posix.dirname(from), to));

// ---- models ----

/** Runs the models of standard blocks, and publishes them with what was recorded. Gives their files. */
function publish() {
  const files = [...globSync("docs/start/*.yaml", { cwd: root }), ...globSync("examples/*/model.yaml", { cwd: root })]
    .filter((file) => !/block: *\w+\//.test(read(file))).sort();
  const scratch = mkdtempSync(join(tmpdir(), "bf-site-"));
  const recordings = files.map((file, i) => {
    mkdirSync(join(scratch, String(i)));
    const recording = join(scratch, String(i), "bf_run.mcap");
    execFileSync(command, ["run", file, "--record", recording, "--quiet"], { cwd: root, stdio: ["ignore", "ignore", "inherit"] });
    return recording;
  });
  execFileSync(command, ["publish", ...files, "-o", resolve(output, "models"), ...recordings.flatMap((file) => ["--recording", file])],
    { cwd: root, stdio: ["ignore", "ignore", "inherit"] });
  rmSync(scratch, { recursive: true });
  return files;
}
const model_page = (file) => `models/${file.replace(/\.yaml$/, "")}/`;

/** Of each published model that lies beside the page, or is the page: its picture, and where it runs. */
function invitations(source, models) {
  const place = place_of(source);
  return models.filter((file) => file === source || (source.endsWith(".md") && posix.dirname(file) === posix.dirname(source)))
    .map((file) => {
      const runs = address(place, `${model_page(file)}index.html`), picture = address(place, `${model_page(file)}model.svg`);
      const text = file === source ? "" : ` <a href="${leads(source, posix.basename(file))}">${posix.basename(file)}</a>`;
      return `<figure class="model"><a href="${runs}"><img src="${picture}" alt="The diagram of ${posix.basename(file)}"></a>`
        + `<figcaption><a class="run" href="${runs}">Run it here</a> in this browser, beside what <code>bf run</code> recorded.${text}</figcaption></figure>\n`;
    }).join("");
}

// ---- pages ----

const wanted = [first], pages = new Map(), anchors = []; // anchors: that links of pages lead to

/** The address of what a link of a page leads to, which becomes part of the site. */
function leads(source, link) {
  if (/^[a-z]+:/.test(link)) return link;
  const [path, anchor] = link.split("#");
  let to = path ? posix.join(folder_of(source), decodeURI(path)).replace(/\/$/, "") : source;
  if (existsSync(join(root, to, "README.md"))) to += "/README.md";
  if (to.startsWith("..") || !existsSync(join(root, to))) {
    problems.push(`${source}: ${link} leads nowhere`);
    return link;
  }
  if (!wanted.includes(to)) wanted.push(to);
  if (anchor) anchors.push({ source, link, to, anchor });
  return address(place_of(source), place_of(to)) + (anchor ? `#${anchor}` : "");
}

const md = new MarkdownIt();
const escaped = md.utils.escapeHtml;
const text_of = (inline) => inline.children.map((token) => (token.type === "softbreak" ? " " : token.content)).join("");

/** As GitHub makes it of a heading, so that links hold there, too. */
function anchor_of(text, taken) {
  const plain = text.toLowerCase().replace(/[^\p{L}\p{M}\p{N}\p{Pc}\- ]/gu, "").replaceAll(" ", "-");
  let anchor = plain;
  for (let i = 1; taken.has(anchor); ++i) anchor = `${plain}-${i}`;
  taken.add(anchor);
  return anchor;
}

md.core.ruler.push("site", ({ tokens, env }) => {
  env.headings = [];
  const taken = new Set();
  tokens.forEach((token, i) => {
    if (token.type === "heading_open") {
      const text = text_of(tokens[i + 1]), anchor = anchor_of(text, taken);
      token.attrSet("id", anchor);
      env.headings.push({ tag: token.tag, text, anchor });
    }
    const align = token.attrGet("style")?.replace("text-align:", ""); // the policy of the page allows no inline style
    if (align) token.attrs = [["class", align]];
    for (const child of token.children ?? []) {
      if (child.type === "link_open") child.attrSet("href", leads(env.source, child.attrGet("href")));
      if (child.type === "image") child.attrSet("src", leads(env.source, child.attrGet("src")));
    }
  });
});

function listing(text, language) {
  if (!parsers[language]) return escaped(text);
  let html = "";
  highlightCode(text, parsers[language].parse(text), classHighlighter,
    (code, classes) => (html += classes ? `<span class="${classes}">${escaped(code)}</span>` : escaped(code)), () => (html += "\n"));
  return html;
}
md.renderer.rules.fence = (tokens, i) => {
  const [language, ...rest] = tokens[i].info.split(" ");
  const file = language === "sh" || language === "text" ? "" : rest[0];
  return (file ? `<p class="file">${escaped(file)}</p>` : "") + `<pre tabindex="0"><code>${listing(tokens[i].content, language)}</code></pre>\n`;
};

/** What stands on a page: its content, headings and title. */
function page_of(source) {
  if (is_folder(source)) {
    const files = readdirSync(join(root, source), { withFileTypes: true }).filter((entry) => entry.isFile()).map(({ name }) => name).sort();
    const items = files.map((name) => `<li><a href="${leads(source, encodeURI(name))}">${escaped(name)}</a></li>\n`);
    return { content: `<h1>${escaped(source)}</h1>\n<ul>${items.join("")}</ul>\n`, headings: [], title: source };
  }
  if (!source.endsWith(".md"))
    return { content: `<h1>${escaped(source)}</h1>\n<pre tabindex="0"><code>${listing(read(source), source.split(".").at(-1))}</code></pre>\n`, headings: [], title: source };
  const env = { source }, content = md.render(read(source), env);
  return { content, headings: env.headings, title: env.headings[0]?.text ?? source };
}

/** The text from a token of a line on to the end of its link. */
const link_text = (children, i) => text_of({ children: children.slice(i, children.findIndex((child, k) => k > i && child.type === "link_close")) });

/** The links of a page that lists others, under its headings in bold or, without those, under its title. */
function listed(source) {
  const sections = [], env = { source };
  let depth = 0;
  for (const token of md.parse(read(source), env)) {
    if (/^(list_item|td)_(open|close)$/.test(token.type)) depth += token.nesting;
    if (token.type !== "inline") continue;
    const links = token.children.flatMap((child, i) => child.type === "link_open" ? [{ to: child.attrGet("href"), text: link_text(token.children, i) }] : []);
    if (depth > 0) {
      if (sections.length === 0) sections.push({ title: env.headings[0].text, links: [] });
      sections.at(-1).links.push(...links);
    } else if (token.children.some((child) => child.type === "strong_open")) {
      sections.push({ title: text_of(token), links: [] });
    }
  }
  const begun = (text) => text[0].toUpperCase() + text.slice(1);
  return sections.map(({ title, links }) => ({ title: begun(title), links: links.map(({ to, text }) => ({ text: begun(text), to: posix.join(posix.dirname(place_of(source)), decodeURI(to)) })) }));
}

function written(source, { content, headings, title }, sections, models) {
  const place = place_of(source), to = (other) => address(place, other);
  const inner = headings.filter(({ tag }) => tag === "h2");
  const after = content.indexOf("</h1>") + "</h1>\n".length;
  return `<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'self'; img-src 'self'; base-uri 'none'; form-action 'none'">
<link rel="icon" href="${to("icon.svg")}">
<link rel="stylesheet" href="${to("site.css")}">
<title>${escaped(title)}${title === "BlockFactory" ? "" : " – BlockFactory"}</title>
</head>
<body>
<header><a href="${to("index.html")}">BlockFactory</a><a href="${to("docs/index.html")}">Documentation</a>${models.length > 0 ? `<a href="${to("models/index.html")}">Models that run here</a>` : ""}</header>
<nav aria-label="Pages">
${sections.map((section) => `<details${section.links.some((link) => link.to === place) || source === first ? " open" : ""}><summary>${escaped(section.title)}</summary>
<ul>${section.links.map((link) => `<li><a href="${to(link.to)}"${link.to === place ? ' aria-current="page"' : ""}>${escaped(link.text)}</a></li>`).join("")}</ul></details>`).join("\n")}
</nav>
<main>
${content.slice(0, after)}${invitations(source, models)}${content.slice(after)}</main>
${inner.length > 1 ? `<nav class="inner" aria-label="On this page"><ul>${inner.map(({ text, anchor }) => `<li><a href="#${anchor}">${escaped(text)}</a></li>`).join("")}</ul></nav>` : ""}
</body>
</html>
`;
}

// ---- the site ----

function put(place, content) {
  mkdirSync(posix.dirname(join(output, place)), { recursive: true });
  writeFileSync(join(output, place), content);
}

if (existsSync(output)) throw new Error(`${output} is there already; name a new folder`);
const models = command ? publish() : [];
const sections = lists.flatMap(listed);
for (const source of wanted) { // which grows
  if (is_image(source)) {
    mkdirSync(posix.dirname(join(output, source)), { recursive: true });
    copyFileSync(join(root, source), join(output, source));
  } else {
    const page = page_of(source);
    pages.set(source, page);
    put(place_of(source), written(source, page, sections, models));
  }
}
for (const { source, link, to, anchor } of anchors)
  if (!pages.get(to)?.headings.some((heading) => heading.anchor === anchor)) problems.push(`${source}: ${link} leads to no heading`);
copyFileSync(join(here, "site.css"), join(output, "site.css"));
copyFileSync(join(root, "editor/page/public/icon.svg"), join(output, "icon.svg"));
for (const problem of new Set(problems)) console.error(problem);
if (problems.length > 0) process.exitCode = 1;
else console.log(`${output}/index.html: ${pages.size} pages, ${models.length} models that run`);
