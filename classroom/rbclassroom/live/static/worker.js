// Python in a worker of the page: the worker loads Pyodide from the folder of this file, and runs cells.
const here = self.location.href.replace(/[^/]*$/, ""), facts = FACTS, plain = self.fetch.bind(self);

// Text is sent at most ten times a second, since a loop may print without end.
let text = "", sent = 0;
function tell(kind, content = "") {
  if (kind === "text") {
    text += content;
    if (performance.now() - sent < 100) return;
  }
  if (text) self.postMessage(["text", text]);
  [text, sent] = ["", performance.now()];
  if (kind !== "text") self.postMessage([kind, content]);
}

// Count the downloaded bytes, and unpack compressed files.
let loaded = 0, told = 0;
const counter = () => new TransformStream({
  transform(chunk, out) {
    loaded += chunk.length;
    if (performance.now() > told + 100) {
      told = performance.now();
      tell("loaded", loaded);
    }
    out.enqueue(chunk);
  },
});
self.fetch = async (address, options) => {
  const url = String(address.url ?? address), packed = /\.asm\.(js|wasm)$/.test(url);
  const answer = await plain(packed ? `${url}.packed` : url, options);
  if (!answer.ok) throw new Error(`${url} could not be loaded: ${answer.status}`);
  const body = answer.body.pipeThrough(counter());
  const type = url.endsWith(".wasm") ? "application/wasm" : "application/octet-stream";
  const content = packed ? body.pipeThrough(new DecompressionStream("gzip")) : body;
  return new Response(content, { headers: { "Content-Type": type } });
};

// Packages are unpacked and not "loaded", so that only imported libraries are compiled.
const lock = fetch(`${here}pyodide-lock.json`).then((answer) => answer.json()), files = {};
const buffer = (file) => (files[file] ??= fetch(here + file).then((answer) => answer.arrayBuffer()));
const site = { extractDir: "/lib/python3.12/site-packages" };
async function parts(name) {
  const { depends, file_name: file, package_type: type } = (await lock).packages[name];
  const below = await Promise.all(depends.map(parts));
  return [...below.flat(), { name, file, type }];
}
async function load(python, name) {
  for (const { name: part, file, type } of await parts(name)) {
    if (type !== "package") await python.loadPackage(part, { messageCallback() {} });
    else if (!(file in python.had)) python.unpackArchive(await (python.had[file] = buffer(file)), "zip", site);
  }
}

// Store the memory of Python just after its start, so that the next visit needs half the time.
const memory = (mode, act) => new Promise((resolve) => {
  const ask = indexedDB.open("rbcourse engine", 1);
  ask.onupgradeneeded = () => ask.result.createObjectStore("memory");
  ask.onerror = () => resolve();
  ask.onsuccess = () => {
    const wish = act(ask.result.transaction("memory", mode).objectStore("memory"));
    wish.onsuccess = () => resolve(wish.result);
    wish.onerror = () => resolve();
  };
});

async function start() {
  parts("numpy").then(([{ file }]) => buffer(file));
  buffer("rbcourse.zip");
  const code = fetch(`${here}pyodide.asm.js`), kept = memory("readonly", (store) => store.get(facts.pyodide));
  importScripts(`${here}pyodide.js`);
  importScripts(URL.createObjectURL(await (await code).blob())); // otherwise Pyodide would load the file that is not packed
  const env = { HOME: "/home/pyodide", MPLBACKEND: "agg", RBCOURSE_FIGURES: "" }, image = await kept;
  const python = await loadPyodide({ indexURL: here, env, ...(image ? { _loadSnapshot: image } : { _makeSnapshot: true }) });
  if (!image) { const made = python.makeMemorySnapshot(); memory("readwrite", (store) => store.put(made, facts.pyodide)); }
  python.had = {};
  await load(python, "numpy");
  python.unpackArchive(await buffer("rbcourse.zip"), "zip", site);
  const names = Object.values((await lock).packages).flatMap((each) => each.imports.map((name) => [name, each.name]));
  return { python, imports: new Map(names), run: python.pyimport("rbclassroom.live.cells").run };
}
const ready = start();
ready.then(() => tell("ready"), async (error) => {
  await memory("readwrite", (store) => store.clear()); // a damaged memory must not stay in the store
  tell("failed", String(error.message ?? error));
});

self.onmessage = async ({ data: { above, source, files = {} } }) => {
  try {
    const { python, imports, run } = await ready;
    for (const [name, text] of Object.entries(files)) python.FS.writeFile(name, text);
    for (let missing; (missing = run(python.toPy(above), source, python.toPy([...imports.keys()]), tell)); ) {
      tell("clear");
      await load(python, imports.get(missing));
      imports.delete(missing);
    }
    tell("done");
  } catch (error) {
    tell("failed", String(error.message ?? error));
  }
};
