// Editors and outputs for cells of lessons and for problem sets. The browser stores the answers to problems.
addEventListener("DOMContentLoaded", () => {
  const engine = window.rbcourseEngine, about = engine.facts, megabytes = (bytes) => (bytes / 1e6).toFixed(1);
  const all = (selector, from = document) => [...from.querySelectorAll(selector)];
  const name = location.pathname.split("/").at(-1).replace(/\.html$/, "");
  const make = (tag, props = {}, ...inside) => {
    const part = Object.assign(document.createElement(tag), props);
    part.append(...inside);
    return part;
  };
  const script = (file) => new Promise((resolve, reject) =>
    document.head.append(make("script", { src: engine.folder + file, onload: resolve, onerror: reject })));
  let data, editors, count = 0;
  const page = () => (data ??= fetch(`${engine.folder}pages/${name}.json`).then((answer) => answer.json())
    .catch((error) => { data = null; throw error; }));

  // Make a text area; for code, it becomes a CodeMirror editor. The function edit replaces the text.
  function editor(text, label, changed, go) {
    const area = make("textarea", { value: text, ariaLabel: label, spellcheck: !go });
    const part = make("div", { className: "editor" }, area);
    let view;
    const grow = () => { area.style.height = "0"; area.style.height = `${area.scrollHeight + 2}px`; };
    requestAnimationFrame(grow);
    area.oninput = () => { grow(); changed(area.value); };
    async function upgrade() {
      await (editors ??= script("codemirror.js"));
      if (view) return view;
      const { EditorView, EditorState, Prec, keymap, python, ...more } = CodeMirror;
      const { selectionStart: anchor, selectionEnd: head } = area, focused = document.activeElement === area;
      view = new EditorView({
        parent: part,
        state: EditorState.create({
          doc: area.value,
          selection: { anchor, head },
          extensions: [
            Prec.highest(keymap.of(["Shift-Enter", "Mod-Enter"].map((key) => ({ key, run: () => (go(), true) })))),
            keymap.of([...more.defaultKeymap, ...more.historyKeymap, more.indentWithTab]),
            more.history(), more.lineNumbers(), more.bracketMatching(), more.indentOnInput(), python(), EditorView.lineWrapping,
            more.indentUnit.of("    "), more.syntaxHighlighting(more.classHighlighter),
            EditorView.contentAttributes.of({ "aria-label": `${label}; to leave it, press Escape, then Tab` }),
            EditorView.updateListener.of((update) => update.docChanged && changed(view.state.doc.toString())),
          ],
        }),
      });
      area.remove();
      if (focused) view.focus();
      return view;
    }
    if (go) area.onfocus = () => upgrade().catch(() => {}); // without CodeMirror the text area is used
    const edit = (now) => {
      if (view) view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert: now } });
      else { area.value = now; grow(); }
      changed(now);
    };
    return { part, upgrade, edit };
  }

  // Make the element that shows outputs.
  function outputs() {
    const part = make("div", { className: "outputs", role: "status" });
    let text;
    const show = (kind, content) => {
      if (kind === "clear") part.replaceChildren(), (text = null);
      else if (kind === "loaded") progress(content);
      else if (kind === "text") {
        if (!text) part.append((text = make("pre", { whole: "" })));
        text.whole += content;
        text.textContent = text.whole.replace(/[^\n]*\r(?=[^\n])/g, "").replaceAll("\r", "");
      } else if (kind === "html") {
        text = null;
        part.append(revived(content));
      } else part.append(make(kind === "error" ? "pre" : "p", { className: kind, textContent: content }));
    };
    const progress = (bytes) => {
      const line = `Loading Python: ${megabytes(bytes)} of ${about.start} MB`;
      part.firstChild?.className === "loading" || part.replaceChildren(make("p", { className: "loading" }));
      part.firstChild.textContent = bytes / 1e6 < about.start ? line : `Loading packages: ${megabytes(bytes)} MB`;
    };
    return { part, show };
  }

  // Return HTML as an element whose names are unique and whose scripts run.
  function revived(html) {
    count += 1;
    for (const [, id] of html.matchAll(/<img id="(\w+)"/g)) html = html.replaceAll(id, `${id}_${count}`);
    const part = make("div", { innerHTML: html });
    setTimeout(() => all("script", part).forEach((each) => each.replaceWith(make("script", { textContent: each.textContent }))));
    return part;
  }

  // Run a cell and show its outputs below its editor. The buttons show the state of the run and can stop it.
  // Return whether the cell ran without an error.
  async function perform(read, bar, shown, show) {
    const wrong = engine.missing(), [go, halt] = all("button", bar);
    show("clear");
    shown.classList.remove("stale");
    if (wrong) return show("error", wrong), false;
    let whole = true;
    engine.start(show).catch(() => {}); // engine.run reports the error
    go.disabled = true;
    halt.hidden = false;
    show("loading", "Running …");
    const first = (kind, content) => {
      if (kind !== "loaded") shown.querySelector(".loading")?.remove();
      if (kind === "hint" || kind === "error") whole = false;
      show(kind, content);
    };
    try {
      if ((await engine.run(await read(), first)) === "stopped") first("error", "Stopped.");
      document.body.classList.add("python-is-there"); // from now on the buttons show no size
    } catch (error) {
      first("error", `Python has ended: ${error.message}. Run the cell again to restart Python.`);
    }
    shown.querySelector(".loading")?.remove();
    if (!shown.firstChild) show("text", "The cell ran without output.");
    go.disabled = false;
    halt.hidden = true;
    return whole;
  }
  const size = () => make("small", { textContent: ` loads ${Math.round(about.start)} MB once` });
  function toolbar(word, go, ...more) {
    const halt = make("button", { type: "button", textContent: "Stop", hidden: true, onclick: engine.stop });
    return make("div", { className: "bar" }, make("button", { type: "button", className: "act", onclick: go }, word, size()), halt, ...more);
  }
  const button = (textContent, onclick) => make("button", { type: "button", textContent, onclick });
  let told = false;
  function differences(part) {
    if (told) return;
    told = true;
    part.before(make("details", { className: "differences" },
      make("summary", { textContent: `How Python ${about.python} in your browser differs` }),
      `Integers have 32 bits, so larger ones overflow. Divisions by zero give no warning. Programs cannot start threads or processes. The version of NumPy is ${about.numpy}. `
      + "Before a cell runs, Python runs the statements above that the cell needs, as this page shows them."));
  }

  // Lessons: "Try it" turns a cell into an editor and runs it. The stored output is kept.
  const texts = new Map(); // the texts of edited cells, by id
  for (const part of all(".cell[class*=tag_try-]")) {
    const id = /tag_try-([\w-]+)/.exec(part.className)[1], folded = part.querySelector("details");
    const start = button("Try it", async () => {
      start.remove();
      if (folded) folded.open = true;
      const { part: shown, show } = outputs();
      const read = async () => {
        const cells = (await page()).cells, at = cells.findIndex((each) => each.id === id);
        const now = (each) => texts.get(each.id) ?? each.source;
        return { above: cells.slice(0, at).map(now), source: now(cells[at]), stored: cells[at].source };
      };
      const go = () => perform(read, bar, shown, show);
      const bar = toolbar("Run", go);
      const code = part.querySelector(".cell_input");
      code.after(bar, shown);
      if (engine.missing()) return go();
      const ran = go(); // Python is loaded while the editor is made
      const { source, stored } = await read();
      const { part: edited, upgrade, edit } = editor(source, "Code of this cell", (text) => {
        texts.set(id, text);
        shown.classList.add("stale");
      }, go);
      bar.append(button("Reset", () => edit(stored)));
      code.querySelector(".highlight").replaceWith(edited);
      differences(code);
      upgrade().catch(() => {});
      await ran;
    });
    start.className = "try";
    start.append(size());
    part.prepend(start);
  }

  // The browser stores answers by page and cell.
  const kept = () => new Promise((resolve, reject) => {
    const ask = indexedDB.open("rbcourse", 1);
    ask.onupgradeneeded = () => ask.result.createObjectStore("answers");
    ask.onsuccess = () => resolve(ask.result.transaction("answers", "readwrite").objectStore("answers"));
    ask.onerror = () => reject(ask.error);
  });
  const done = (ask) => new Promise((resolve, reject) => Object.assign(ask, { onsuccess: () => resolve(ask.result), onerror: () => reject(ask.error) }));
  const key = (id) => `${location.pathname} ${id}`;

  // Problem sets.
  const answers = new Map(), restored = [], fields = all(".cell[class*=tag_answer-], .answer-in-words");
  if (!fields.length) return;
  const status = make("p", { className: "kept", role: "status" });
  const others = window.BroadcastChannel && new BroadcastChannel(`rbcourse ${name}`);
  const tell = (downloaded) => {
    const open = [...answers.values()].filter((answer) => answer.isOpen()).length;
    status.textContent = downloaded
      ? `Your answers are in the file ${name}.ipynb that you downloaded, and in this browser.` + (open ? ` ${open} of ${answers.size} answers are empty or have not passed the check.` : "")
      : "Your answers are kept in this browser, on this machine only, until you clear its data. Download them to hand them in or to move them to another machine.";
  };
  const keep = async (id, text) => {
    try {
      await done((await kept()).put(text, key(id)));
      await done((await kept()).put(false, key("downloaded")));
      tell(false);
    } catch {
      status.textContent = "This browser does not keep your answers, perhaps because the window is private. Download them before you close the window.";
    }
  };
  const changed = (id) => (text) => {
    const answer = answers.get(id);
    if (answer.text === text) return;
    answer.text = text;
    answer.shown.classList.remove("right");
    answer.shown.classList.add("stale");
    keep(id, text);
    others?.postMessage([id, text]);
  };
  const put = (id, text) => { // show an answer that is already stored
    const answer = answers.get(id);
    if (answer.text === text) return;
    answer.text = text;
    answer.shown.classList.replace("right", "stale");
    answer.edit(text);
  };
  if (others) others.onmessage = ({ data: [id, text] }) => put(id, text);
  for (const part of fields) {
    const words = part.classList.contains("answer-in-words");
    const id = words ? part.id : /tag_answer-([\w-]+)/.exec(part.className)[1];
    const stub = words ? "" : part.querySelector("pre").textContent.trimEnd();
    const heading = all("h2").filter((each) => each.compareDocumentPosition(part) & 4).at(-1)?.firstChild.textContent ?? "";
    const { part: shown, show } = outputs();
    const read = async () => {
      const { notebook, files } = await page(), cells = notebook.cells.filter((cell) => cell.cell_type === "code");
      const marks = (cell) => cell.metadata.nbgrader, at = cells.findIndex((cell) => marks(cell).grade_id === id);
      const now = (cell) => answers.get(marks(cell).grade_id)?.text ?? cell.source, isTest = (cell) => marks(cell).grade && !marks(cell).solution;
      const end = cells.findIndex((cell, k) => k > at && isTest(cell)), above = cells.slice(0, at).filter((cell) => !isTest(cell));
      return { above: above.map(now), source: cells.slice(at, end + 1).map(now).join("\n\n"), files };
    };
    const go = async () => {
      const { text } = answers.get(id), right = (await perform(read, bar, shown, show)) && text === answers.get(id).text;
      shown.classList.toggle("right", right);
      if (right) kept().then((store) => done(store.put(text, key(`${id} right`)))).catch(() => {});
    };
    const { part: edited, edit } = editor(stub, `Answer to ${heading}`, changed(id), words ? null : go);
    const reset = button("Reset", () => confirm("Delete this answer and begin again?") && edit(stub));
    const bar = words ? make("div", { className: "bar" }, "A person grades this answer. ", reset) : toolbar("Check", go, reset);
    if (part.nextElementSibling?.matches(".cell:not([class*=tag_])")) bar.append("The picture appears here, too.");
    answers.set(id, { text: stub, stub, edit, shown, isOpen: () => words ? !answers.get(id).text.trim() : !shown.classList.contains("right") });
    part.classList.add("live");
    part.replaceChildren(edited, bar, shown);
    if (!words) differences(edited);
    restored.push(kept().then((store) => Promise.all([id, `${id} right`].map((each) => done(store.get(key(each)))))).then(([text, right]) => {
      if (typeof text === "string") put(id, text);
      if (text === undefined || text !== right || answers.get(id).text !== text) return;
      shown.className = "outputs right";
      show("text", "This answer passed your last check.");
    }, () => {}));
  }
  for (const part of all(".cell[class*=tag_test]")) part.hidden = true; // "Check" runs the test

  async function download() {
    const { notebook } = structuredClone(await page());
    for (const cell of notebook.cells) {
      const answer = answers.get(cell.metadata.nbgrader?.grade_id);
      if (answer && answer.text !== answer.stub) cell.source = answer.text;
    }
    const file = new Blob([JSON.stringify(notebook, null, 1) + "\n"], { type: "application/x-ipynb+json" });
    make("a", { href: URL.createObjectURL(file), download: `${name}.ipynb` }).click();
    kept().then((store) => done(store.put(true, key("downloaded"))), () => {});
    tell(true);
  }
  async function open(file) {
    const cells = JSON.parse(await file.text()).cells.filter((cell) => answers.has(cell.metadata.nbgrader?.grade_id));
    if (!cells.length) throw new Error("it contains no answer to this problem set");
    if (!confirm(`Replace the answers on this page by those in ${file.name}?`)) return;
    for (const cell of cells) answers.get(cell.metadata.nbgrader.grade_id).edit([cell.source].flat().join(""));
  }
  const field = make("input", { type: "file", accept: ".ipynb", ariaLabel: "Open a downloaded file", hidden: true });
  field.onchange = () => open(field.files[0]).catch((error) => (status.textContent = `The file was not opened: ${error.message}.`)).finally(() => (field.value = ""));
  const save = button(`Download ${name}.ipynb`, () => {
    if (engine.missing()) status.textContent = engine.missing();
    else download().catch((error) => (status.textContent = `Nothing was downloaded: ${error.message}. Try again.`));
  });
  const end = make("div", { className: "hand-in" }, make("div", { className: "bar" }, save, button("Open a downloaded file", () => field.click()), field), status);
  (document.querySelector("#before-you-hand-in") ?? document.querySelector("article")).append(end);
  Promise.all(restored).then(kept).then((store) => done(store.get(key("downloaded")))).then(tell, () => tell(false));
});
