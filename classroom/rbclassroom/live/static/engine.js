// The interface between the pages and Python: run and stop. Nothing is loaded before the first run.
window.rbcourseEngine = (() => {
  const folder = document.currentScript.src.replace(/[^/]*$/, "");
  const facts = FACTS;
  let worker, finish, turn = Promise.resolve();

  // The reason why Python cannot run here, or an empty text.
  const missing = location.protocol !== "file:" ? ""
    : "This page was opened from a file. Python runs only in a page from a web server. Open the book on the web, or serve it by: python3 course.py book --live --serve";

  // Run a cell, { above, source, files } or a promise of it, when earlier runs are done. Return "done" or "stopped".
  // show(kind, content) shows the outputs; the kinds are text, html, hint, error, clear, and loaded (a number of bytes).
  function run(cell, show) {
    const next = turn.then(() => new Promise((resolve, reject) => {
      const fail = (why) => {
        reject(new Error(`Python has ended: ${why}. Run the cell again to restart Python.`));
        stop();
      };
      finish = resolve;
      if (missing) return reject(new Error(missing));
      const own = (worker ??= new Worker(`${folder}worker.js`));
      own.onerror = (event) => fail(event.message || "The files of Python could not be loaded.");
      own.onmessage = ({ data: [kind, content] }) => {
        if (kind === "failed") fail(content);
        else if (kind === "done") resolve("done");
        else show(kind, content);
      };
      Promise.resolve(cell).then((given) => own.postMessage(given), (error) => fail(error.message));
    }));
    turn = next.catch(() => {});
    return next;
  }

  // Stop the running cell and end Python; the next run starts Python again.
  function stop() {
    worker?.terminate();
    worker = null;
    finish?.("stopped");
  }

  return { facts, folder, missing, run, stop };
})();
