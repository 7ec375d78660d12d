// Draw a scene in space as seen from any side; space.py draws it from one. A piece is a face, a line, a mark
// or a ball: { kind, zorder, style, places }; places are [x, y, z, along the line] in pixels of the room.
const rbcourseScene = {
  // Return unit vectors to the right, upwards and to the eye, for an azimuth and an elevation in degrees.
  sight([azimuth, elevation]) {
    const [a, e] = [azimuth, elevation].map((angle) => (angle * Math.PI) / 180);
    const [ca, sa, ce, se] = [Math.cos(a), Math.sin(a), Math.cos(e), Math.sin(e)];
    return { right: [-sa, ca, 0], up: [-se * ca, -se * sa, ce], eye: [ce * ca, ce * sa, se] };
  },

  dot: (p, q) => p[0] * q[0] + p[1] * q[1] + p[2] * q[2],

  // Return a depth as a whole number, so that rounding errors do not determine the order. The limits are at 0.7.
  pixels: (depth) => Math.floor(depth + 0.3),

  // Return the unit normal of a whole face.
  normal(places) {
    const [o, ...others] = places, n = [0, 0, 0];
    const spokes = others.map((p) => p.map((x, i) => x - o[i]));
    for (let k = 1; k < spokes.length; k++) {
      const [p, q] = [spokes[k - 1], spokes[k]];
      for (let i = 0; i < 3; i++) n[i] += p[(i + 1) % 3] * q[(i + 2) % 3] - p[(i + 2) % 3] * q[(i + 1) % 3];
    }
    const size = Math.hypot(...n) || 1;
    return n.map((x) => x / size);
  },

  // The overlap, in pixels, of the parts of a cut opaque piece; it hides the gap between them.
  overlap: 0.9,

  // Pass to `put` the parts above a plane (1), in it (0), and below it (-1). The parts above the plane are
  // extended below it by the overlap.
  cut(piece, height, put) {
    const { places, kind, style: [fill, stroke, , dashes] } = piece, heights = places.map(height);
    const overlap = (fill ?? stroke ?? "").endsWith("ff") && !dashes.length ? rbcourseScene.overlap : 0;
    const sides = heights.map((h) => (Math.abs(h) < 0.2 ? 0 : Math.sign(h)));
    if (kind === "mark" || kind === "ball") {
      for (const side of new Set(sides)) put(side, { ...piece, places: places.filter((_, i) => sides[i] === side) });
      return;
    }
    const low = Math.min(0, ...sides), high = Math.max(0, ...sides);
    if (!low || !high) return put(low + high, piece);
    for (const t of [-1, 1]) {
      const runs = [[]];
      places.forEach((p, i) => {
        if (t * sides[i] >= 0) runs.at(-1).push(p);
        else if (kind === "line") runs.push([]); // a line may come back to this side
        const j = (i + 1) % places.length;
        if (sides[i] * sides[j] >= 0 || (kind === "line" && !j)) return;
        const share = heights[i] / (heights[i] - heights[j]);
        const q = p.map((x, k) => x + share * (places[j][k] - x));
        const below = (sides[i] < 0 ? p : places[j]).map((x, k) => x - q[k]);
        const more = t > 0 ? Math.min(1, overlap / Math.hypot(...below.slice(0, 3))) : 0;
        runs.at(-1).push(q.map((x, k) => x + more * below[k]));
      });
      for (const run of runs) if (run.length >= (kind === "line" ? 2 : 3)) put(t, { ...piece, places: run });
    }
  },

  // Return the face whose plane cuts the fewest faces and lines.
  wall(pieces, eye) {
    const { dot } = rbcourseScene, whole = pieces.filter(({ kind }) => kind === "face" || kind === "line");
    const walls = pieces.filter(({ kind }) => kind === "face" || kind === "ball");
    const cuts = walls.map(({ normal, places: [place] }) => {
      const n = normal ?? eye, level = dot(place, n);
      return whole.filter(({ places }) => {
        const heights = places.map((p) => dot(p, n) - level);
        return Math.min(...heights) <= -0.2 && Math.max(...heights) >= 0.2;
      }).length;
    });
    return walls[cuts.indexOf(Math.min(...cuts))];
  },

  // Return pieces from the farthest to the nearest, cut where they pass through faces: first the pieces behind the
  // plane of a face, then faces in it, then pieces over them or on the side of the eye. Each side is ordered likewise.
  order(pieces, eye) {
    const { dot, cut, pixels, order } = rbcourseScene, wall = rbcourseScene.wall(pieces, eye);
    if (!wall) {
      const mean = ({ places }) => pixels(places.reduce((sum, p) => sum + dot(p, eye), 0) / places.length);
      const known = pieces.map((piece) => ({ piece, depth: mean(piece) }));
      known.sort((a, b) => a.piece.zorder - b.piece.zorder || a.depth - b.depth);
      return known.map(({ piece }) => piece);
    }
    const ahead = wall.normal ?? eye, n = dot(ahead, eye) < 0 ? ahead.map((x) => -x) : ahead;
    const level = dot(wall.places[0], n), sides = { "-1": [], 0: [wall], 1: [] };
    for (const piece of pieces) {
      if (piece !== wall) cut(piece, (p) => dot(p, n) - level, (side, part) => sides[side].push(part));
    }
    sides[0].sort((a, b) => a.zorder - b.zorder);
    const over = sides[0].splice(sides[0].findLastIndex(({ kind }) => kind === "face" || kind === "ball") + 1);
    return [...order(sides[-1], eye), ...sides[0], ...order([...over, ...sides[1]], eye)];
  },

  // Return the drawings on the screen: styles, positions [x, y], and the distance along the line at the first one.
  seen(pieces, { origin }, view) {
    const { dot, order, sight, normal, pixels } = rbcourseScene, { right, up, eye } = sight(view);
    const flat = (p) => [origin[0] + dot(p, right), origin[1] - dot(p, up)];
    // A face becomes two pieces: its filling, and its edge, which is not drawn where the face is cut.
    const parts = pieces.flatMap((piece) => {
      const { kind, style, places } = piece, [fill, stroke, width, ...rest] = style;
      if (kind !== "face") return [piece];
      const edge = [...places, places[0]];
      return [
        { ...piece, normal: normal(places), style: [fill, null, 0, ...rest] },
        { ...piece, kind: "line", style: [null, stroke, width, ...rest], places: edge },
      ];
    });
    const ready = parts.map((piece) => {
      let before = null, along = 0;
      const places = piece.places.map((p) => {
        const now = flat(p);
        along += before ? Math.hypot(now[0] - before[0], now[1] - before[1]) : 0;
        before = now;
        return [...p, along];
      });
      return { ...piece, places };
    });
    const [over, others] = [true, false].map((is) => ready.filter(({ zorder }) => zorder >= 10 === is));
    over.sort((a, b) => a.zorder - b.zorder);
    return [...order(others, eye), ...over].map(({ kind, style, places }) => {
      const depth = (p) => pixels(dot(p, eye));
      const ends = kind === "mark" ? [...places].sort((p, q) => depth(p) - depth(q)) : places;
      return { style, along: places[0][3], runs: [(kind === "face" ? [...ends, ends[0]] : ends).map(flat)] };
    });
  },

  // Let a pointer, keys and buttons turn the view of a canvas; return the buttons. All scenes turn together.
  turn(canvas, rooms, redraw) {
    const make = (tag, settings) => Object.assign(document.createElement(tag), settings);
    const style = "display: flex; flex-wrap: wrap; gap: 0.3em; align-items: center";
    const row = make("div", { className: "rbcourse-view", style }), said = make("output", { ariaLive: "off" });
    const set = (views) => {
      canvas.views = views.map(([a, e]) => [((a + 540) % 360) - 180, Math.max(-90, Math.min(90, e))]);
      const [a, e] = canvas.views[0].map((x) => `${Math.round(x)}°`.replace("-", "−"));
      canvas.seen = `Seen from azimuth ${a}, elevation ${e}.`;
      said.textContent = canvas.seen;
    };
    const to = (views) => { set(views); redraw(); };
    const by = (right, up) => to(canvas.views.map(([a, e]) => [a - right, e + up]));
    const first = rooms.map(({ view }) => view), all = (view) => rooms.map(() => view);
    const save = () => make("a", { href: canvas.toDataURL(), download: "picture.png" }).click();
    for (const [name, onclick] of [
      ["front", () => to(all([-90, 0]))], ["side", () => to(all([0, 0]))], ["top", () => to(all([-90, 90]))],
      ["↑", () => by(0, 15)], ["↓", () => by(0, -15)], ["first view", () => to(first)], ["save picture", save],
    ]) row.append(make("button", { type: "button", textContent: name, onclick, style: "font: inherit" }));
    row.append(said);
    const steps = { ArrowLeft: [-5, 0], ArrowRight: [5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5] };
    canvas.addEventListener("keydown", (event) => {
      if (event.altKey || event.ctrlKey || event.metaKey) return;
      if (event.key === "Home") to(first);
      else if (event.key in steps) by(...steps[event.key]);
      else return;
      event.preventDefault();
      event.stopPropagation(); // JupyterLab and lectures also use these keys
    });
    let last; // the last position of the first finger
    const drag = ({ type, isPrimary, pointerId, clientX, clientY }) => {
      if (type === "pointerdown") canvas.setPointerCapture(pointerId);
      if (!isPrimary || !canvas.hasPointerCapture(pointerId)) return;
      if (type === "pointermove") by((clientX - last[0]) / 2, (clientY - last[1]) / 2); // half a degree for a pixel
      last = [clientX, clientY];
    };
    for (const type of ["pointerdown", "pointermove"]) canvas.addEventListener(type, drag);
    canvas.tabIndex = 0;
    Object.assign(canvas.style, { cursor: "grab", touchAction: "pan-y pinch-zoom" });
    canvas.title = "Drag, or press the arrow keys, to turn; Home: first view";
    set(first);
    return row;
  },
};
