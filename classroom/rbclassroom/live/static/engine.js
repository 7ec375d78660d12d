// The interface between the pages and Python: start, run and stop. Nothing is loaded before the first start.
window.rbcourseEngine = (() => {
  const folder = document.currentScript.src.replace(/[^/]*$/, "");
  const facts = FACTS;
  let draws = false, worker, started, hear, finish, leave, turn = Promise.resolve();

  // Return the reason why Python cannot run here, or an empty text.
  function missing() {
    if (location.protocol === "file:") return "This page was opened from a file. Python runs only in a page from a web server. Open the book on the web, or serve it by: python3 course.py book --live --serve";
    const old = ["Worker", "WebAssembly", "DecompressionStream", "indexedDB"].find((name) => !window[name]);
    return old ? `This browser is too old to run Python: it has no ${old}.` : "";
  }

  // Load Python once; show("loaded", bytes) reports the number of bytes loaded so far.
  function start(show) {
    if (!started) hear = show;
    started ??= new Promise((resolve, reject) => {
      const fail = (text) => { reject(new Error(text)); finish?.("failed", text); stop(); };
      leave = () => resolve("stopped");
      worker = new Worker(`${folder}worker.js`);
      worker.onerror = (event) => fail(event.message || "The files of Python could not be loaded.");
      worker.onmessage = ({ data: [kind, content] }) => {
        if (kind === "ready") resolve("ready");
        else if (kind === "failed") fail(content);
        else if (kind === "done") finish?.("done");
        else hear(kind, content);
        // The files for drawing are loaded while Python starts; the worker finds them in the cache.
        if (draws && kind === "loaded" && content > 0.95e6 * facts.start) {
          draws = false;
          for (const file of facts.drawing) fetch(folder + file).then((answer) => answer.arrayBuffer()).catch(() => {});
        }
      };
    });
    return started;
  }

  // Run a cell, { above, source, files }, when earlier runs are done. Return "done" or "stopped".
  // show(kind, content) shows the outputs; the kinds are text, html, hint, error and clear.
  function run(cell, show) {
    draws ||= /\bplt\./.test(cell.source);
    const next = turn.then(() => start(show)).then((how) => how === "stopped" ? how : new Promise((resolve, reject) => {
      finish = (end, text) => { finish = null; end === "failed" ? reject(new Error(text)) : resolve(end); };
      hear = show;
      worker.postMessage(cell);
    }));
    turn = next.catch(() => {});
    return next;
  }

  // Stop the running cell and end Python; the next run starts Python again.
  function stop() {
    worker?.terminate();
    worker = started = null;
    leave?.();
    finish?.("stopped");
  }

  return { facts, folder, missing, start, run, stop };
})();
