// Python in a worker of the page: the worker loads Pyodide from the folder of this file, and runs cells.
const here = self.location.href.replace(/[^/]*$/, ""), version = FACTS.version, plain = self.fetch.bind(self);

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
let loaded = 0;
async function download(url, packed = /\.asm\.(js|wasm)$/.test(url)) {
  const answer = await plain(packed ? `${url}.packed` : url);
  if (!answer.ok) throw new Error(`${url} could not be loaded: ${answer.status}`);
  const counted = answer.body.pipeThrough(new TransformStream({
    transform(chunk, out) {
      tell("loaded", (loaded += chunk.length));
      out.enqueue(chunk);
    },
  }));
  const type = url.endsWith(".wasm") ? "application/wasm" : "application/octet-stream";
  const content = packed ? counted.pipeThrough(new DecompressionStream("gzip")) : counted;
  return new Response(content, { headers: { "Content-Type": type } });
}

// Pyodide asks for its files one after the other; they are requested earlier, all at the same time.
const requests = {};
self.fetch = (address) => (requests[address.url ?? address] ??= download(String(address.url ?? address)));
const lock = plain(`${here}pyodide-lock.json`).then((answer) => answer.json());
async function request(name) {
  const { file_name: file, depends } = (await lock).packages[name];
  fetch(here + file);
  depends.forEach(request);
}

// The memory of Python just after its start is stored, so that the next visit needs half the time.
// Browsers permit this for addresses with https, and on this machine.
const store = self.caches?.open("rbcourse engine").catch(() => {});

// Pyodide only prints errors, below a heading that ends with a colon.
const options = { messageCallback() {}, errorCallback(line) { if (!line.endsWith(":")) throw new Error(line); } };
async function start() {
  for (const file of ["pyodide.asm.js", "pyodide.asm.wasm", "python_stdlib.zip", "rbcourse.zip"]) fetch(here + file);
  request("numpy");
  importScripts(`${here}pyodide.js`);
  const code = await (await fetch(`${here}pyodide.asm.js`)).blob();
  importScripts(URL.createObjectURL(code)); // otherwise Pyodide would load the file that is not packed
  const kept = await (await store)?.match(version);
  const memory = kept ? { _loadSnapshot: new Uint8Array(await kept.arrayBuffer()) } : { _makeSnapshot: true };
  const env = { HOME: "/home/pyodide", MPLBACKEND: "agg", RBCOURSE_FIGURES: "" };
  const python = await loadPyodide({ indexURL: here, env, ...memory });
  if (!kept) (await store)?.put(version, new Response(python.makeMemorySnapshot())).catch(() => {});
  // NumPy is unpacked and not "loaded", so that only its imported parts are compiled.
  for (const file of [(await lock).packages.numpy.file_name, "rbcourse.zip"])
    python.unpackArchive(await (await fetch(here + file)).arrayBuffer(), "zip", { extractDir: "/lib/python3.12/site-packages" });
  python.loadedPackages.numpy = "unpacked";
  const names = Object.values((await lock).packages).flatMap((each) => each.imports.map((name) => [name, each.name]));
  return { python, imports: new Map(names), run: python.pyimport("rbclassroom.live.cells").run };
}
const ready = start();

self.onmessage = async ({ data: { above, source, files = {} } }) => {
  try {
    if (/\bplt\./.test(source)) request("matplotlib");
    const { python, imports, run } = await ready;
    for (const [name, content] of Object.entries(files)) python.FS.writeFile(name, content);
    for (let missing; (missing = run(python.toPy(above), source, python.toPy([...imports.keys()]), tell)); ) {
      tell("clear");
      await python.loadPackage(imports.get(missing), options);
      imports.delete(missing);
    }
    tell("done");
  } catch (error) {
    await self.caches?.delete("rbcourse engine"); // a damaged memory must not stay in the store
    tell("failed", String(error.message ?? error));
  }
};
