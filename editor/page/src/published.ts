import "uplot/dist/uPlot.min.css";
import "./fonts.css";
import "./style.css";
import { mount } from "svelte";
import { Engine, type Published } from "./engine.ts";
import App from "./parts/App.svelte";
import { Session } from "./session.svelte.ts";
import { choose, chosen } from "./theme.ts";

declare global {
  var blockfactory: Published; // of the scripts before this one
}

choose(chosen());
const { file, files, recording } = blockfactory.model, folder = file.slice(0, file.lastIndexOf("/") + 1);
const recordings = Object.keys(files).filter((name) => name.startsWith(folder) && name.endsWith(".mcap") && name !== recording).map((name) => name.slice(folder.length));
const session: Session = new Session(new Engine(blockfactory, (text) => (session.message = { text, part: "model" })), recordings);
mount(App, { target: document.getElementById("page")!, props: { session } });
