// In a worker of the page: its messages to the service, and what the service says. Follows what emscripten writes, which
// has make().
{
  let module, timer, opened;
  const soon = new MessageChannel(); // a timer would wait for some milliseconds
  const originals = new Map();

  /** Does what is due, and comes back when more will be. */
  function work() {
    clearTimeout(timer);
    const wait = module._bf_work();
    if (wait === 0) soon.port2.postMessage(null);
    else if (wait > 0) timer = setTimeout(work, wait);
  }
  soon.port1.onmessage = work;

  async function open({ wasm, file, files, recording, plugins }) {
    module = await make({ wasmBinary: wasm, say: (text) => postMessage(text), send: (bytes) => postMessage(bytes, [bytes]) });
    const write = (path, bytes) => {
      module.FS.mkdirTree(path.slice(0, path.lastIndexOf("/")));
      module.FS.writeFile(path, bytes);
      if (path.endsWith(".yaml")) originals.set(path, module.FS.readFile(path, { encoding: "utf8" }));
    };
    for (const [name, bytes] of files) write(`/model/${name}`, bytes);
    for (const [name, bytes] of plugins) write(`/plugins/${name}`, bytes);
    opened = `/model/${file}`;
    const wrong = module.ccall("bf_open", "string", ["string", "string"], [opened, recording ? `/model/${recording}` : ""]);
    if (wrong) throw new Error(wrong);
    postMessage({ is_open: true });
  }

  /** The opened model, and its files that are not as they were published. */
  function edited(folder = "/model") {
    return module.FS.readdir(folder).filter((name) => !name.startsWith(".")).flatMap((name) => {
      const path = `${folder}/${name}`;
      if (module.FS.isDir(module.FS.stat(path).mode)) return edited(path);
      if (!name.endsWith(".yaml")) return [];
      const text = module.FS.readFile(path, { encoding: "utf8" });
      return path === opened || text !== originals.get(path) ? [{ name, text }] : [];
    });
  }

  /** What the service has under that name. */
  function data(what) {
    let found = null;
    const { send } = module;
    module.send = (bytes) => (found = bytes);
    module.ccall("bf_data", "boolean", ["string"], [what]);
    module.send = send;
    return found;
  }

  onmessage = ({ data: asked }) => {
    if (asked.wasm) return void open(asked).then(work, (error) => postMessage({ wrong: error.message }));
    if (typeof asked === "string") module.ccall("bf_answer", null, ["string"], [asked]);
    else postMessage({ id: asked.id, value: asked.data ? data(asked.data) : edited() });
    work();
  };
}
