// The picture of an explorer in a notebook, which display.js draws; see explorer.py.
export default {
  async render({ model, el }) {
    const made = model.get("made"), { size, rooms, background, first, clickable, parts } = made;
    const [time, play, said, ...others] = await Promise.all(parts.map((id) => model.widget_manager.get_model(id)));
    const count = time.get("_options_labels").length;
    const canvas = document.createElement("canvas"), back = await createImageBitmap(new Blob([background]));
    canvas.style = `display: block; width: 100%; aspect-ratio: ${size.join(" / ")}`;
    el.append(canvas);

    // The states of one version, by their indices. They become invalid when another control moves.
    let known = new Map(), version, stale = false, shown, noted = "";
    let waiting = false, place = null, near = false, timer, late, panel = null;
    const text = "Python does not answer: wait, or run this cell again.";
    const silent = { state: [], styles: [], texts: [[], text, text] };
    const give = () => {
      [late, waiting, place] = [undefined, false, null];
      paint((shown = silent));
    };
    const expect = () => { late ??= setTimeout(give, 2000); };
    const send = (message) => {
      if (waiting) return;
      waiting = true;
      try { model.send(message); } catch { /* Python has ended: `give` shows the message */ }
    };
    const paint = () => {
      const { state, styles, texts: [rows, notice, line] } = shown;
      rbcourseDisplay.draw(canvas, back, made, styles, state);
      said.set("value", rbcourseDisplay.table(rows, noted || notice));
      rbcourseDisplay.tell(canvas, line);
    };

    // Show the present state, or the nearest known state until the present one arrives.
    const show = () => {
      if (stale) return;
      const index = time.get("index"), off = (i) => Math.abs(i - index);
      const nearest = [...known.keys()].reduce((a, b) => (off(b) < off(a) ? b : a));
      if (nearest !== index) { send({ index }); expect(); }
      const now = known.get(nearest);
      if (now !== shown && shown !== silent) paint((shown = now));
    };

    // Ask for the missing states of the control that plays, after a pause without requests.
    const prepare = (pause) => {
      clearTimeout(timer);
      timer = setTimeout(() => {
        const missing = Array.from({ length: count }, (_, i) => i).filter((i) => !known.has(i));
        const next = missing.find((i) => i > time.get("index")) ?? missing[0];
        if (near && !stale && next !== undefined) send({ index: next });
      }, pause);
    };

    const read = () => {
      const { version: sent, index, states, texts, styles, notice } = model.get("run");
      const bytes = new Uint8Array(states.buffer, states.byteOffset, states.byteLength);
      const other = sent !== version;
      if (other) [known, noted, stale, version] = [new Map(), notice, false, sent];
      rbcourseDisplay.split(bytes).forEach((state, i) => {
        if (!known.has(index + i)) known.set(index + i, { state, texts: texts[i], styles });
      });
      late = clearTimeout(late);
      waiting = false;
      if (shown === silent && !stale) shown = null;
      if (place) send({ place });
      place = null;
      show();
      prepare(other ? 1000 : play.get("playing") ? 0 : 100);
    };
    const move = () => { stale = true; expect(); };

    const point = ({ buttons, clientX, clientY }) => {
      if (!(buttons & 1)) return;
      const { left, top, width, height } = canvas.getBoundingClientRect();
      const there = [(clientX - left) / width, (clientY - top) / height];
      if (waiting) place = there;
      else send({ place: there });
      move();
    };
    if (clickable) {
      Object.assign(canvas.style, { cursor: "crosshair", touchAction: "none" });
      canvas.onpointerdown = canvas.onpointermove = point;
    }

    const view = rooms.length ? rbcourseScene.turn(canvas, rooms, () => paint()) : "";

    // Names for screen readers and the reset of the time belong to the panel beside the picture.
    const label = (panel) => {
      for (const handle of panel.querySelectorAll(".noUi-handle")) {
        const text = (part) => handle.closest(".widget-slider").querySelector(part)?.textContent ?? "";
        handle.ariaLabel = text(".widget-label");
        handle.ariaValueText = text(".widget-readout");
      }
      panel.querySelectorAll(".widget-play button").forEach((button, i) => {
        button.title = ["Play or pause", "Stop"][i] ?? "";
      });
    };
    const reset = ({ target }) => {
      if (!target.closest(".rbcourse-reset")) return;
      move();
      play.set("playing", false);
      time.set("index", first);
      [play, time].forEach((part) => part.save_changes());
    };
    const labels = new MutationObserver(() => label(panel));
    const fit = new ResizeObserver(() => {
      paint();
      if (panel || !(panel = el.closest(".rbcourse-explorer"))) return;
      panel.querySelector(".rbcourse-panel").append(view);
      label(panel);
      labels.observe(panel, { childList: true, subtree: true });
      panel.addEventListener("click", reset);
      panel.addEventListener("keydown", (event) => event.stopPropagation()); // otherwise JupyterLab handles the key
      const enter = () => { near = true; prepare(1000); };
      ["pointerenter", "focusin"].forEach((name) => panel.addEventListener(name, enter));
    });

    model.on("change:run", read);
    others.forEach((other) => other.on("change:value change:index", move, canvas));
    time.on("change:index", () => {
      noted = "";
      play.set("value", time.get("index"));
      show();
    }, canvas);
    // While the explorer plays, Python gets no messages; at the end it gets the present time.
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches, step = calm ? Math.ceil(count / 6) : 1;
    play.on("change:value", () => {
      const value = play.get("value");
      if (value % step === 0 || value === count - 1) time.set("index", value);
    }, canvas);
    play.on("change:playing", () => time.save_changes(), canvas);
    read();
    fit.observe(canvas);
    return () => {
      [time, play, ...others].forEach((part) => part.off(null, null, canvas));
      [fit, labels].forEach((observer) => observer.disconnect());
      view.remove?.();
      [timer, late].forEach(clearTimeout);
    };
  },
};
