// Editors and outputs for cells of lessons and for problem sets. The browser stores the answers to problems.
addEventListener("DOMContentLoaded", () => {
  const engine = window.rbcourseEngine, about = engine.facts;
  const all = (selector, from = document) => [...from.querySelectorAll(selector)];
  const name = location.pathname.split("/").at(-1).replace(/\.html$/, "");
  const make = (tag, props = {}, ...inside) => {
    const part = Object.assign(document.createElement(tag), props);
    part.append(...inside);
    return part;
  };
  const button = (text, onclick, className = "", ...more) => make("button", { type: "button", onclick, className }, text, ...more);

  // The present texts of the cells with code, in the order in which they run. The page shows the imports last.
  const cells = [...all(".cell.tag_imports"), ...all(".cell:not(.tag_imports)")].filter((part) => part.querySelector(".cell_input"));
  const texts = new Map(cells.map((part) => [part, part.querySelector(".cell_input pre").textContent.trimEnd()]));

  // Make a text area; for code, it becomes a CodeMirror editor. The function edit replaces the text.
  let script;
  function editor(text, label, changed, go) {
    const area = make("textarea", { value: text, ariaLabel: label, spellcheck: !go, rows: text.split("\n").length });
    const part = make("div", { className: "editor" }, area);
    let view;
    area.oninput = () => changed(area.value);
    async function upgrade() {
      await (script ??= new Promise((onload, onerror) => document.head.append(make("script", { src: `${engine.folder}codemirror.js`, onload, onerror }))));
      if (view) return;
      const { EditorView, Prec, keymap, ...more } = CodeMirror;
      const { selectionStart: anchor, selectionEnd: head } = area, focused = document.activeElement === area;
      view = new EditorView({
        parent: part,
        doc: area.value,
        selection: { anchor, head },
        extensions: [
          Prec.highest(keymap.of(["Shift-Enter", "Mod-Enter"].map((key) => ({ key, run: () => (go(), true) })))),
          keymap.of([...more.defaultKeymap, ...more.historyKeymap, more.indentWithTab]),
          more.history(), more.lineNumbers(), more.bracketMatching(), more.indentOnInput(), more.python(), EditorView.lineWrapping,
          more.indentUnit.of("    "), more.syntaxHighlighting(more.classHighlighter),
          EditorView.contentAttributes.of({ "aria-label": `${label}; to leave it, press Escape, then Tab` }),
          EditorView.updateListener.of((update) => update.docChanged && changed(view.state.doc.toString())),
        ],
      });
      area.remove();
      if (focused) view.focus();
    }
    if (go) area.onfocus = () => upgrade().catch(() => {}); // without CodeMirror the text area is used
    const edit = (now) => {
      if (view) return view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert: now } });
      area.value = now;
      changed(now);
    };
    return { part, edit, upgrade };
  }

  // Make the element that shows outputs.
  function outputs() {
    const part = make("div", { className: "outputs", role: "status" });
    let text;
    const show = (kind, content) => {
      part.querySelector(".loading")?.remove();
      if (kind === "clear") {
        text = null;
        part.replaceChildren();
      } else if (kind === "loaded") {
        const size = (content / 1e6).toFixed(1), whole = about.start;
        show("loading", size < whole ? `Loading Python: ${size} of ${whole} MB` : `Loading packages: ${size} MB`);
      } else if (kind === "text") {
        if (!text) part.append((text = make("pre", { whole: "" })));
        text.whole += content;
        text.textContent = text.whole.replace(/[^\n]*\r(?=[^\n])/g, "").replaceAll("\r", "");
      } else if (kind === "html") {
        text = null;
        part.append(revived(content));
      } else if (content) part.append(make(kind === "error" ? "pre" : "p", { className: kind, textContent: content }));
    };
    return { part, show };
  }

  // Return HTML as an element whose names are unique and whose scripts run.
  let count = 0;
  function revived(html) {
    for (const [, id] of html.matchAll(/<img id="(\w+)"/g)) html = html.replaceAll(id, `${id}_${++count}`);
    const part = make("div", { innerHTML: html });
    setTimeout(() => all("script", part).forEach((each) => each.replaceWith(make("script", { textContent: each.textContent }))));
    return part;
  }

  const isTest = (cell) => cell.matches(".tag_test"), answers = new Map(), file = "my_motion.py";
  let data;
  const page = async () => (data ??= await (await fetch(`${engine.folder}pages/${name}.json`)).json()); // of a problem set
  // Return what Python needs to run a cell: the texts above, and its own text. An answer is followed by its test.
  async function read(cell) {
    const at = cells.indexOf(cell), test = cells.findIndex((each, k) => k > at && isTest(each));
    const above = cells.slice(0, at).filter((each) => !isTest(each)), own = cells.slice(at, Math.max(at, test) + 1);
    const [before, source] = [above, own].map((some) => some.map((each) => texts.get(each)));
    const files = answers.size ? { ...(await page()).files, [file]: functions() } : {};
    return { above: before, source: source.join("\n\n"), files };
  }

  // Make the editor of a cell, its buttons and its outputs. Without a word for the first button, the cell does not run.
  // Call changed(text) after each change, and passed() after a run without an error.
  const size = () => make("small", { textContent: ` loads ${Math.round(about.start)} MB once` });
  function runnable(cell, { label, word, stub, sure = () => true, changed = () => {}, passed = () => {} }) {
    const { part: shown, show } = outputs();
    async function go() {
      const given = texts.get(cell);
      show("clear");
      show("loading", "Running …");
      shown.className = "outputs";
      [act.disabled, halt.hidden] = [true, false]; // the buttons show the state of the run
      try {
        if ((await engine.run(engine.missing() ? {} : read(cell), show)) === "stopped") show("error", "Stopped.");
        document.body.classList.add("python-is-there"); // from now on the buttons show no size
      } catch (error) {
        show("error", error.message);
      }
      show("done");
      if (!shown.firstChild) show("text", "The cell ran without output.");
      [act.disabled, halt.hidden] = [false, true];
      if (texts.get(cell) === given && !shown.querySelector(":scope > :is(.hint, .error)")) passed(shown);
    }
    const put = (text) => {
      texts.set(cell, text);
      shown.className = "outputs stale";
    };
    const { part: edited, edit, upgrade } = editor(texts.get(cell), label, (text) => {
      if (text === texts.get(cell)) return;
      put(text);
      changed(text);
    }, word ? go : null);
    const act = button(word, go, "act", size());
    const halt = Object.assign(button("Stop", engine.stop), { hidden: true });
    const reset = button("Reset", () => sure() && edit(stub));
    const bar = make("div", { className: "bar" }, ...(word ? [act, halt] : ["A person grades this answer. "]), reset);
    return { edited, bar, shown, show, put, edit, upgrade, go };
  }
  function differences(part) {
    if (document.querySelector(".differences")) return;
    part.before(make("details", { className: "differences" },
      make("summary", { textContent: `How Python ${about.python} in your browser differs` }),
      `Integers have 32 bits, so larger ones overflow. Divisions by zero give no warning. Programs cannot start threads or processes. The version of NumPy is ${about.numpy}. `
      + "Before a cell runs, Python runs the statements above that the cell needs, as this page shows them."));
  }

  // Lessons: "Try it" turns a cell into an editor and runs it. The stored output is kept.
  for (const part of all(".cell[class*=tag_try-]")) {
    const code = part.querySelector(".cell_input");
    const start = button("Try it", () => {
      start.remove();
      part.querySelector("details")?.setAttribute("open", ""); // the code may be folded
      const { edited, bar, shown, upgrade, go } = runnable(part, { label: "Code of this cell", word: "Run", stub: texts.get(part) });
      go(); // Python is loaded while the editor is made
      code.querySelector(".highlight").replaceWith(edited);
      code.after(bar, shown);
      differences(code);
      upgrade().catch(() => {});
    }, "try", size());
    part.prepend(start);
  }

  // Problem sets. The browser stores answers by page and cell, unless it forbids this.
  const key = (id) => `${location.pathname} ${id}`;
  const stored = (id) => { try { return localStorage.getItem(key(id)); } catch { return null; } };
  let forbidden = false;
  // The file of all sets with the student's own functions: the browser stores it beside the answers.
  const place = `${location.pathname.replace(/[^/]*$/, "")}${file}`;
  let whole;
  const functions = () => { try { return localStorage.getItem(place) ?? ""; } catch { return whole ?? ""; } };
  async function keep() {
    const passed = [...answers].filter(([, answer]) => !answer.isOpen()).map(([id]) => id.replace(/-answer$/, ""));
    const named = cells.map((part, k) => [k ? /tag_answer-([\w-]+)/.exec(part.className)?.[1] : "setup", texts.get(part)]);
    const given = { name, passed, cells: named.filter(([id]) => id) };
    const files = { ...(await page()).files, [file]: functions(), "answers.json": JSON.stringify(given) };
    let out = "";
    const source = "from rbclassroom.assignments.my_motion import kept\nprint(kept())";
    await engine.run({ above: [], source, files }, (kind, text) => (out += kind === "text" ? text : ""));
    const [text, said] = JSON.parse(out);
    whole = text;
    try { localStorage.setItem(place, text); } catch { forbidden = true; }
    tell();
    if (said) status.textContent += ` ${said}.`;
  }
  const store = (id, text) => { try { localStorage.setItem(key(id), text); } catch { forbidden = true; } };
  const status = make("p", { className: "kept", role: "status" });
  const mine = button(`Download ${file}`, () => give(functions(), file, "text/x-python"));
  const tell = () => {
    const open = [...answers.values()].filter((answer) => answer.isOpen()).length;
    mine.hidden = !functions();
    status.textContent = forbidden
      ? "This browser does not keep your answers, perhaps because the window is private. Download them before you close the window."
      : stored("downloaded")
      ? `Your answers are in the file ${name}.ipynb that you downloaded, and in this browser.` + (open ? ` ${open} of ${answers.size} answers are empty or have not passed the check.` : "")
      : "Your answers are kept in this browser, on this machine only, until you clear its data. Download them to hand them in or to move them to another machine.";
  };
  for (const part of all(".cell[class*=tag_answer-], .answer-in-words")) {
    const words = part.matches(".answer-in-words"), id = words ? part.id : /tag_answer-([\w-]+)/.exec(part.className)[1];
    const heading = part.closest("section").querySelector("h1, h2, h3").firstChild.textContent, stub = texts.get(part) ?? "";
    texts.set(part, stored(id) ?? stub);
    const changed = (text) => {
      store(id, text);
      store("downloaded", "");
      tell();
    };
    const passed = (shown) => {
      shown.classList.add("right");
      store(`${id} right`, texts.get(part));
      keep().catch((error) => (status.textContent = `${file} is not changed: ${error.message}.`));
    };
    const sure = () => confirm("Delete this answer and begin again?");
    const answer = runnable(part, { label: `Answer to ${heading}`, word: words ? "" : "Check", stub, sure, changed, passed });
    if (part.nextElementSibling?.matches(".cell:not([class*=tag_])")) answer.bar.append("The picture appears here, too.");
    answers.set(id, { ...answer, part, stub, isOpen: () => words ? !texts.get(part).trim() : !answer.shown.matches(".right") });
    part.classList.add("live");
    part.replaceChildren(answer.edited, answer.bar, answer.shown);
    if (!words) differences(answer.edited);
    if (stored(`${id} right`) !== texts.get(part)) continue;
    answer.shown.classList.add("right");
    answer.show("text", "This answer passed your last check.");
  }
  if (!answers.size) return;
  for (const part of cells.filter(isTest)) part.hidden = true; // "Check" runs the test
  addEventListener("storage", ({ key: at, newValue: text }) => { // another window has changed an answer
    for (const [id, { put, edit }] of answers) if (at === key(id) && text !== null) put(text), edit(text);
  });

  function give(text, download, type) {
    make("a", { href: URL.createObjectURL(new Blob([text], { type })), download }).click();
  }
  async function download() {
    const { notebook } = structuredClone(await page());
    for (const cell of notebook.cells) {
      const answer = answers.get(cell.metadata.nbgrader?.grade_id), text = texts.get(answer?.part);
      if (answer && text !== answer.stub) cell.source = text;
    }
    give(JSON.stringify(notebook, null, 1) + "\n", `${name}.ipynb`, "application/x-ipynb+json");
    store("downloaded", "yes");
    tell();
  }
  async function open(file) {
    const found = JSON.parse(await file.text()).cells.filter((cell) => answers.has(cell.metadata.nbgrader?.grade_id));
    if (!found.length) throw new Error("it contains no answer to this problem set");
    if (!confirm(`Replace the answers on this page by those in ${file.name}?`)) return;
    for (const cell of found) answers.get(cell.metadata.nbgrader.grade_id).edit([cell.source].flat().join(""));
  }
  const field = make("input", { type: "file", accept: ".ipynb", ariaLabel: "Open a downloaded file", hidden: true });
  field.onchange = () => open(field.files[0]).catch((error) => (status.textContent = `The file was not opened: ${error.message}.`)).finally(() => (field.value = ""));
  const save = button(`Download ${name}.ipynb`, () => download().catch((error) =>
    (status.textContent = engine.missing() || `Nothing was downloaded: ${error.message}. Try again.`)));
  const end = make("div", { className: "hand-in" }, make("div", { className: "bar" }, save, button("Open a downloaded file", () => field.click()), field, mine), status);
  (document.querySelector("#before-you-hand-in") ?? document.querySelector("article")).append(end);
  tell();
});
