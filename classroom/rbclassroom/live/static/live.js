// Editors and outputs for cells of lessons and for problem sets. The browser stores the answers to problems.
addEventListener("DOMContentLoaded", async () => {
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

  // Load the editor for code, once.
  let loading;
  const codeMirror = () => (loading ??= new Promise((onload, onerror) => document.head.append(make("script", { src: `${engine.folder}codemirror.js`, onload, onerror }))));

  // Make an editor; code has a function `go` that runs it. The function edit replaces the text.
  function editor(text, label, changed, go) {
    const part = make("div", { className: "editor" });
    if (!go) {
      const area = make("textarea", { value: text, ariaLabel: label, rows: text.split("\n").length });
      area.oninput = () => changed(area.value);
      part.append(area);
      return { part, edit: (now) => changed((area.value = now)) };
    }
    const { EditorView, Prec, keymap, ...more } = CodeMirror;
    const view = new EditorView({
      parent: part,
      doc: text,
      extensions: [
        Prec.highest(keymap.of(["Shift-Enter", "Mod-Enter"].map((key) => ({ key, run: () => (go(), true) })))),
        keymap.of([...more.defaultKeymap, ...more.historyKeymap, more.indentWithTab]),
        more.history(), more.lineNumbers(), more.bracketMatching(), more.indentOnInput(), more.python(), EditorView.lineWrapping,
        more.indentUnit.of("    "), more.syntaxHighlighting(more.classHighlighter),
        EditorView.contentAttributes.of({ "aria-label": `${label}; to leave it, press Escape, then Tab` }),
        EditorView.updateListener.of((update) => update.docChanged && changed(view.state.doc.toString())),
      ],
    });
    return { part, edit: (insert) => view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert } }) };
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
        part.append(document.createRange().createContextualFragment(content)); // its scripts run
      } else if (content) part.append(make(kind === "error" ? "pre" : "p", { className: kind, textContent: content }));
    };
    return { part, show };
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
        if ((await engine.run(engine.missing ? {} : read(cell), show)) === "stopped") show("error", "Stopped.");
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
    const { part: edited, edit } = editor(texts.get(cell), label, (text) => {
      if (text === texts.get(cell)) return;
      put(text);
      changed(text);
    }, word ? go : null);
    const act = button(word, go, "act", size());
    const halt = Object.assign(button("Stop", engine.stop), { hidden: true });
    const reset = button("Reset", () => sure() && edit(stub));
    const bar = make("div", { className: "bar" }, ...(word ? [act, halt] : ["A person grades this answer. "]), reset);
    return { edited, bar, shown, show, put, edit, go };
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
    const start = button("Try it", async () => {
      await codeMirror();
      start.remove();
      part.querySelector("details")?.setAttribute("open", ""); // the code may be folded
      const { edited, bar, shown, go } = runnable(part, { label: "Code of this cell", word: "Run", stub: texts.get(part) });
      go();
      code.querySelector(".highlight").replaceWith(edited);
      code.after(bar, shown);
      differences(code);
    }, "try", size());
    part.prepend(start);
  }

  // Problem sets. The browser stores answers by page and cell. If it forbids this, they last as long as the page.
  let shelf = {}, forbidden = false;
  try { shelf = localStorage; } catch { forbidden = true; }
  const write = (at, text) => { try { shelf[at] = text; } catch { forbidden = true; } };
  const key = (id) => `${location.pathname} ${id}`, store = (id, text) => write(key(id), text);
  // The file of all sets with the student's own functions: the browser stores it beside the answers.
  const place = `${location.pathname.replace(/[^/]*$/, "")}${file}`, functions = () => shelf[place] ?? "";
  async function keep() {
    const passed = [...answers].filter(([, answer]) => !answer.isOpen()).map(([id]) => id.replace(/-answer$/, ""));
    const named = cells.map((part, k) => [k ? /tag_answer-([\w-]+)/.exec(part.className)?.[1] : "setup", texts.get(part)]);
    const given = { name, passed, cells: named.filter(([id]) => id) };
    const files = { ...(await page()).files, [file]: functions(), "answers.json": JSON.stringify(given) };
    let out = "";
    const source = "from rbclassroom.assignments.my_motion import kept\nprint(kept())";
    await engine.run({ above: [], source, files }, (kind, text) => (out += kind === "text" ? text : ""));
    const [text, said] = JSON.parse(out);
    write(place, text);
    tell();
    if (said) status.textContent += ` ${said}.`;
  }
  const status = make("p", { className: "kept", role: "status" });
  const mine = button(`Download ${file}`, () => give(functions(), file, "text/x-python"));
  const tell = () => {
    const open = [...answers.values()].filter((answer) => answer.isOpen()).length;
    mine.hidden = !functions();
    status.textContent = forbidden
      ? "This browser does not keep your answers, perhaps because the window is private. Download them before you close the window."
      : shelf[key("downloaded")]
      ? `Your answers are in the file ${name}.ipynb that you downloaded, and in this browser.` + (open ? ` ${open} of ${answers.size} answers are empty or have not passed the check.` : "")
      : "Your answers are kept in this browser, on this machine only, until you clear its data. Download them to hand them in or to move them to another machine.";
  };
  if (document.querySelector(".cell[class*=tag_answer-]")) await codeMirror();
  for (const part of all(".cell[class*=tag_answer-], .answer-in-words")) {
    const words = part.matches(".answer-in-words"), id = words ? part.id : /tag_answer-([\w-]+)/.exec(part.className)[1];
    const heading = part.closest("section").querySelector("h1, h2, h3").firstChild.textContent, stub = texts.get(part) ?? "";
    texts.set(part, shelf[key(id)] ?? stub);
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
    if (shelf[key(`${id} right`)] !== texts.get(part)) continue;
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
    (status.textContent = engine.missing || `Nothing was downloaded: ${error.message}. Try again.`)));
  const end = make("div", { className: "hand-in" }, make("div", { className: "bar" }, save, button("Open a downloaded file", () => field.click()), field, mine), status);
  (document.querySelector("#before-you-hand-in") ?? document.querySelector("article")).append(end);
  tell();
});
