// Draw the moving parts, as recorded by display.py, on top of a picture of the fixed parts.
const rbcourseDisplay = {
  explorers: {}, // scripts add functions that return explorers, which compute their states; see revive

  // Return the states in the bytes, each as an array of numbers.
  split(bytes) {
    const { buffer } = bytes.slice(), [count] = new Uint32Array(buffer, 0, 1);
    const sizes = new Uint32Array(buffer, 4, count), numbers = new Int16Array(buffer, 4 * (count + 1));
    let end = 0;
    return [...sizes].map((size) => numbers.subarray(end, (end += size)));
  },

  // Return the bytes that were deflated and encoded as base64.
  async inflate(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  },

  // Return the drawings of a state: styles, and runs of positions in pixels, [x, y], or [x, y, z] in space.
  decode(state, styles) {
    const found = [];
    for (let i = 0; i < state.length; ) {
      const style = styles[state[i]], size = style.length > 8 ? 3 : 2, runs = [];
      do {
        const run = [], end = i + 2 + size * Math.abs(state[i + 1]);
        let place = [0, 0, 0].slice(0, size);
        for (i += 2; i < end; i += size) run.push((place = place.map((x, k) => x + state[i + k] / 8)));
        runs.push(run);
      } while (state[i + 1] < 0);
      found.push({ style, runs });
    }
    return found;
  },

  // Draw a state, or its drawings, at the resolution of the screen; `still` is a loaded image. Scenes are drawn first.
  draw(canvas, still, { size: [width, height], rooms }, styles, state) {
    const zoom = (devicePixelRatio * (canvas.getBoundingClientRect().width || width)) / width; // slides are scaled
    canvas.width = Math.round(width * zoom);
    canvas.height = Math.round(height * zoom);
    const ink = canvas.getContext("2d");
    ink.scale(zoom, zoom);
    ink.drawImage(still, 0, 0, width, height);
    const all = Array.isArray(state) ? state : rbcourseDisplay.decode(state, styles);
    const drawn = rooms.flatMap((room, number) => {
      const pieces = all.filter(({ style }) => style[8] === number).map(({ style, runs }) => (
        { kind: style[9], zorder: style[10], style, places: runs[0] }));
      return rbcourseScene.seen(pieces, room, (canvas.views ?? rooms.map(({ view }) => view))[number]);
    });
    for (const { style, runs, along } of [...drawn, ...all.filter(({ style }) => style.length === 8)]) {
      const [fill, stroke, line, dashes, lineCap, lineJoin, clip, marker] = style;
      const path = new Path2D();
      const add = (run) => run.forEach(([x, y], k) => (k ? path.lineTo(x, y) : path.moveTo(x, y)));
      for (const steps of marker) {
        let [x, y] = [0, 0];
        add(Array.from({ length: steps.length / 2 }, (_, k) => [(x += steps[2 * k] / 8), (y += steps[2 * k + 1] / 8)]));
      }
      if (!marker.length) runs.forEach(add);
      ink.save();
      if (clip.length) {
        ink.beginPath();
        ink.rect(...clip);
        ink.clip();
      }
      Object.assign(ink, { fillStyle: fill, strokeStyle: stroke, lineWidth: line, lineCap, lineJoin });
      ink.setLineDash(dashes);
      ink.lineDashOffset = along ?? 0;
      let [left, top] = [0, 0];
      for (const [x, y] of marker.length ? runs[0] : [[0, 0]]) {
        ink.translate(x - left, y - top);
        [left, top] = [x, y];
        if (fill) ink.fill(path);
        if (stroke) ink.stroke(path);
      }
      ink.restore();
    }
    canvas.dispatchEvent(new CustomEvent("drawn", { bubbles: true }));
  },

  // Return the texts of a state, [[name, text], ...], and its notice, as HTML.
  table(said, notice) {
    const part = document.createElement("div"), table = document.createElement("table");
    table.style = "line-height: 1.35";
    for (const [name, text] of said) {
      const row = Object.assign(table.insertRow(), { style: "vertical-align: top" });
      Object.assign(row.insertCell(), { textContent: name, style: "padding-right: 0.8em" });
      const style = "white-space: pre; font-variant-numeric: tabular-nums";
      Object.assign(row.insertCell(), { textContent: text, style });
    }
    const bold = Object.assign(document.createElement("b"), { role: "alert", textContent: notice });
    part.append(table, ...(notice ? [bold] : []));
    return part.innerHTML;
  },

  // Describe the drawing to screen readers, when they ask for it and when nothing has moved for a while.
  tell(canvas, said) {
    const text = canvas.seen ? `${said} ${canvas.seen}` : said, news = canvas.said === said ? canvas.seen : text;
    const style = "position: absolute; top: 0; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%)";
    canvas.live ??= Object.assign(document.createElement("span"), { role: "status", style });
    if (canvas.ariaLabel && canvas.ariaLabel !== text) {
      canvas.after(canvas.live);
      clearTimeout(canvas.timer);
      canvas.timer = setTimeout(() => { canvas.live.textContent = news; }, 500);
    }
    Object.assign(canvas, { role: "img", ariaLabel: text, said });
  },

  // Replace a still picture by a canvas with its own controls. One control, usually the last, plays. The states are
  // recorded, or the explorer `computed` gets the drawings of its artists, and returns { state, moved, point }:
  // state(values) returns new drawings and texts; moved(values, k) returns the values after a move of control k, and point(place, values) those
  // after a click at a place, in pixels, or null.
  async revive(image, { size, rooms, background, states, known, controls, milliseconds, computed, parts }) {
    if (image.dataset.read) return;
    image.dataset.read = true;
    const back = Object.assign(new Image(), { src: background });
    await back.decode();
    const drawn = rbcourseDisplay.split(await rbcourseDisplay.inflate(states));
    const [styles, said] = JSON.parse(new TextDecoder().decode(await rbcourseDisplay.inflate(known)));
    const make = (tag, settings) => Object.assign(document.createElement(tag), settings);
    const width = `width: ${size[0]}px; max-width: 100%`;
    // before the first drawing, too, the canvas has the shape of the picture
    const canvas = make("canvas", { width: size[0], height: size[1], style: `display: block; ${width}`, role: "img", ariaLabel: image.alt });
    const panel = make("div", { style: width }), table = make("div", { className: "rbcourse-numbers" });
    const rows = controls.map(({ label, values, first, plays }, number) => {
      const max = values.length - 1, exact = values.map((text) => parseFloat(text.replace("−", "-")));
      const row = make("div", { style: "display: flex; gap: 0.6em; margin: 0.3em 0" });
      const slider = make("input", { type: "range", max, value: first, ariaLabel: label, oninput: () => move(number) });
      const output = make("output", { style: "min-width: 4em; text-align: right" });
      slider.style = "flex: 1; min-width: 0";
      const words = isNaN(exact[first]) ? values : []; // words are chosen by buttons
      const buttons = words.map((text, k) => make("button", { textContent: text, onclick: () => move(number, k) }));
      if (words.length) Object.assign(row, { className: "rbcourse-choice", role: "group", ariaLabel: label });
      row.append(label, ...(words.length ? buttons : [slider, output]));
      if (max) panel.append(row); // a control with one value is fixed
      return { slider, values, output, buttons, plays, exact, first, now: exact[first] };
    });
    const explorer = rbcourseDisplay.explorers[computed]?.(parts, drawn.map((each) => rbcourseDisplay.decode(each, styles)));
    const put = (values) => rows.forEach((row, k) => {
      const { exact, slider } = row, places = exact.map((x) => Math.abs(x - values[k]));
      [row.now, slider.value] = [values[k], places.indexOf(Math.min(...places))];
    });
    const player = rows.find(({ plays }) => plays) ?? rows.at(-1), last = player?.slider;
    const button = make("button", { textContent: "▶", ariaLabel: "play or pause" });
    last?.parentNode?.prepend(button);
    const set = (row, k) => {
      row.slider.value = k; // not above its largest value
      row.now = row.exact[row.slider.value];
    };
    const start = () => {
      pause();
      rows.forEach((row) => set(row, row.first));
      show();
    };
    panel.append(table, ...(rows.length ? [make("button", { className: "rbcourse-reset", textContent: "Reset", onclick: start })] : []));
    const show = () => {
      let k = 0;
      for (const { slider, values, output, buttons } of rows) {
        k = k * values.length + +slider.value;
        buttons.forEach((button, i) => { button.ariaPressed = i === +slider.value; });
        slider.ariaValueText = output.textContent = values[slider.value];
      }
      const [state, texts] = explorer ? explorer.state(rows.map(({ now }) => now)) : [drawn[k], said[k]];
      rbcourseDisplay.draw(canvas, back, { size, rooms }, styles, state);
      if (texts) table.innerHTML = rbcourseDisplay.table(...texts);
      rbcourseDisplay.tell(canvas, texts?.[2] ?? image.alt);
    };
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const step = calm ? Math.ceil(+last?.max / 5) : 1;
    let timer = null;
    const pause = () => { clearInterval(timer); timer = null; button.textContent = "▶"; };
    button.onclick = () => {
      if (timer) return pause();
      timer = setInterval(() => {
        set(player, last.value === last.max ? 0 : +last.value + step);
        show();
      }, step * milliseconds);
      button.textContent = "❚❚";
    };
    const move = (k, to = rows[k].slider.value) => {
      pause();
      set(rows[k], to);
      if (explorer?.moved) put(explorer.moved(rows.map(({ now }) => now), k));
      show();
    };
    if (explorer?.point) { // a click or a drag in the picture sets the controls
      Object.assign(canvas.style, { cursor: "crosshair", touchAction: "pan-y" }); // a finger can still scroll the page
      let from = null; // where a finger began, until it moves sideways by 10 pixels; otherwise it taps or scrolls the page
      canvas.onpointerdown = canvas.onpointermove = canvas.onclick = ({ type, buttons, pointerId, pointerType, clientX, clientY }) => {
        if (type !== "click" && !(buttons & 1)) return;
        if (type === "pointerdown") canvas.setPointerCapture(pointerId);
        if (type === "pointerdown" && pointerType === "touch") from = clientX;
        if (type === "pointermove" && Math.abs(clientX - from) > 10) from = null;
        if (type !== "click" && from !== null) return;
        from = null;
        const { left, top, width: wide } = canvas.getBoundingClientRect(), scale = size[0] / wide;
        const values = explorer.point([(clientX - left) * scale, (clientY - top) * scale], rows.map(({ now }) => now));
        if (values) [pause(), put(values), show()];
      };
    }
    panel.onkeydown = (event) => event.stopPropagation(); // otherwise JupyterLab handles the keys
    if (rooms.length) panel.prepend(rbcourseScene.turn(canvas, rooms, show));
    image.replaceWith(canvas);
    canvas.after(panel);
    new ResizeObserver(show).observe(canvas);
  },
};
