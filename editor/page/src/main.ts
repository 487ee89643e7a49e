import "uplot/dist/uPlot.min.css";
import "./fonts.css";
import "./style.css";
import { mount } from "svelte";
import App from "./parts/App.svelte";
import { Server } from "./server.ts";
import { Session } from "./session.svelte.ts";
import { choose, chosen } from "./theme.ts";

choose(chosen());
const token = new URLSearchParams(location.search).get("token") ?? "";
const server = new Server(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket?token=${encodeURIComponent(token)}`);
const session = new Session(server, [], location.hash === "#view");
mount(App, { target: document.getElementById("page")!, props: { session } });
