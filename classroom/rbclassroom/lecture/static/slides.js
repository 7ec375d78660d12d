"use strict";
// Slides of a lesson: sizes, interactive pictures, keys, votes. All files that they need are in the folder.
const all = (what, where = document) => [...where.querySelectorAll(what)];
const printing = /[?&](print-pdf|view=print)/.test(location.search);
const hold = /[?&]hold/.test(location.search) && Object.assign(new Image(), { src: "hold" }); // see serve.py
const voting = /[?&]token=/.test(location.search) && window === window.top;
const sections = all(".slides section section");

// Enlarge a picture with its controls as far as its place allows, and cut off white margins.
const fit = (figure) => {
  const sketch = figure.querySelector(":scope > svg");
  if (sketch) { // without the empty parts above and below the drawing
    const { y, height } = sketch.getBBox();
    sketch.setAttribute("viewBox", `0 ${y - 10} 640 ${height + 20}`);
    sketch.style.aspectRatio = `640 / ${height + 20}`;
  }
  const seen = figure.querySelector(":scope > :is(canvas, img)"), body = figure.closest(".body");
  if (!seen || !figure.clientWidth) return;
  const numbers = body.querySelector(".panel > div:not(:has(> input))"); // they stand below the picture if they need the room
  if (numbers && body.querySelector(".words").offsetHeight > body.clientHeight) figure.append(numbers);
  const below = all(":scope > div", figure).reduce((sum, { offsetHeight }) => sum + offsetHeight, 0);
  const crop = figure.dataset.crop ?? seen.dataset.crop ?? "";
  figure.dataset.crop = crop;
  const [left, top, right, bottom] = (crop || "0 0 0 0").split(" ").map(Number);
  const ratio = +figure.dataset.ratio || seen.naturalWidth / seen.naturalHeight;
  const height = figure.clientHeight - (below && !crop ? below + 10 : 0);
  const room = Math.min(figure.clientWidth / (1 - left - right), (height * ratio) / (1 - top - bottom));
  const width = Math.floor(room), high = width / ratio;
  figure.style.setProperty("--w", `${width}px`);
  if (!crop) return;
  const sides = [top * high, right * width, bottom * high, left * width].map((side) => `${side}px`);
  seen.style.margin = sides.map((side) => `-${side}`).join(" ");
  seen.style.clipPath = `inset(${sides.join(" ")} round 14px)`;
  seen.onpointerdown = () => { seen.style.clipPath = "none"; }; // a scene that turns needs its margins
};

// Text has the largest size that fits. The last size is 36 pixels.
// A formula that is wider than its column shrinks, but not below 62 %.
const settle = (section) => {
  const body = section.querySelector(".body"), words = section.querySelector(".words");
  const formulas = all("mjx-container[display=true]", section);
  const shrink = () => formulas.forEach((box) => {
    box.style.fontSize = "";
    const parent = box.parentElement, { paddingLeft, paddingRight } = getComputedStyle(parent);
    const width = box.querySelector("svg").getBoundingClientRect().width;
    const room = parent.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight);
    if (width > room + 1) box.style.fontSize = `${Math.max(62, Math.floor((98 * room) / width))}%`;
  });
  const set = (size) => { section.style.fontSize = `${size}px`; shrink(); };
  const room = body.clientHeight - parseFloat(getComputedStyle(body).paddingTop);
  const wide = () => all("table", words).some((table) => table.offsetWidth > words.clientWidth + 2);
  const over = () => words.offsetHeight > room || wide();
  const sizes = section.matches(".plain") ? [56, 46, 42, 39, 36] : section.matches(".poll, .verdict") ? [48, 44, 40, 36] : [45, 42, 39, 36];
  const trials = sizes.flatMap((size) => [[size, ""], [size, "18px"]]); // gaps shrink before text
  do {
    const [size, gap] = trials.shift();
    words.style.gap = gap;
    set(size);
  } while (over() && trials.length);
  for (const options of all(".options", section)) { // boxes grow into the free room
    options.style.minHeight = `${Math.min(room - words.offsetHeight + options.offsetHeight, 165 * options.children.length)}px`;
  }
  for (const [, option, idea] of section.matches(".poll") ? all(".option", section).map((row) => row.children) : []) {
    option.style.top = `${idea.offsetHeight / 2 + 2}px`; // in the middle of its box, as the idea is hidden
  }
  const gap = parseFloat(getComputedStyle(words).rowGap), free = (room - words.offsetHeight) / (2 * words.children.length);
  if (section.matches(".plain")) words.style.gap = `${gap + Math.max(0, Math.min(36, free))}px`;
};

// Pictures of the current and of the next slide become interactive; on paper, pictures are stills.
const revive = async (section) => {
  for (const script of section ? all("figure > script[type]", section) : []) {
    const figure = script.parentElement, image = figure.querySelector("img"), own = JSON.parse(script.text);
    const data = window.rbcourseStates?.[own] ?? own; // the book keeps the data in files
    for (const each of all("script", figure)) each.remove();
    figure.dataset.ratio = data.size[0] / data.size[1];
    await rbcourseDisplay.revive(image, data);
    if (section.matches(".split")) { // sliders and numbers stand below the text, so that the picture is large
      const panel = Object.assign(document.createElement("div"), { className: "panel" });
      panel.append(...all(":scope > div > div:is(:has(> input), :last-child)", figure));
      section.querySelector(".words").append(panel);
      new ResizeObserver(() => fit(figure)).observe(panel); // the numbers come later
    }
    const asked = section.parentElement.querySelector(".title, .poll") && !section.dataset.told;
    section.classList.toggle("quiet", Boolean(data.controls.length > 1 && asked));
    fit(figure);
  }
};

const keys = {
  D: ["Dark or light", () => document.documentElement.classList.toggle("dark")],
  E: ["After the end: exercises, references", () => {
    const end = all(".slides > section").length - 1, { h, v } = Reveal.getIndices();
    Reveal.slide(end, h === end && v === 0 ? 1 : 0);
  }],
  M: ["Move: play or pause a picture", () => Reveal.getCurrentSlide().querySelector("[aria-label='play or pause']")?.click()],
  R: ["Readouts of a picture: show or hide", () => {
    Reveal.getCurrentSlide().classList.toggle("quiet");
    all("figure", Reveal.getCurrentSlide()).forEach(fit);
  }],
  T: ["Open or close a vote", () => {
    if (window !== window.top) return window.top.opener?.Reveal.triggerKey(84); // in the speaker view
    const section = Reveal.getCurrentSlide(), poll = section.dataset.poll;
    const options = all(".option > div", section).map((option) => {
      const copy = option.cloneNode(true);
      all("mjx-assistive-mml", copy).forEach((part) => part.remove());
      return copy.innerHTML;
    });
    if (voting && (poll || state.open)) ask(state.open ? {} : { poll, options });
  }],
};

// The server of this page counts the votes; without its token, voting is not possible.
let state = { open: false };
const ask = async (body) => {
  const answer = await fetch(`votes${location.search}`, body && { method: "POST", body: JSON.stringify(body) }).catch(() => null);
  if (!answer?.ok) return;
  state = await answer.json();
  const panel = document.querySelector("#vote");
  panel.hidden = !state.open;
  document.documentElement.classList.toggle("voting", state.open);
  const votes = `${state.voters} ${state.voters === 1 ? "vote" : "votes"}`;
  if (state.open) panel.innerHTML = `${state.code}<div>${state.address.replace("http://", "")}</div><div>${votes}</div>`;
  for (const section of sections.filter(({ dataset }) => dataset.poll && dataset.poll === state.poll)) {
    all(".option", section).forEach((option, i) => {
      const share = `${Math.round((100 * (state.counts[i] ?? 0)) / (state.voters || 1))}%`;
      option.dataset.count = state.counts.length ? `${state.counts[i]} · ${share}` : "";
      option.style.setProperty("--share", state.counts.length ? share : "0");
    });
  }
};

// The slides after the end are not counted.
const numbered = (slide) => {
  const [count, at] = [document.querySelector(".end"), slide ?? Reveal.getCurrentSlide()].map((each) => 1 + sections.indexOf(each));
  if (!printing) document.querySelector("#bar").style.width = `${(100 * Math.min(at, count)) / count}%`;
  return [at <= count ? `${at} / ${count}` : `end + ${at - count}`];
};

const show = ({ currentSlide }) => {
  if (printing) return;
  if (currentSlide.matches(".verdict")) { // show readouts from now on
    const before = all("section", currentSlide.parentElement);
    for (const section of before) {
      section.dataset.told = "yes";
      section.classList.remove("quiet");
    }
  }
  all("figure", currentSlide).forEach(fit);
  revive(currentSlide).then(() => revive(sections[sections.indexOf(currentSlide) + 1]));
};

const begin = async () => {
  document.documentElement.classList.toggle("dark", /[?&]dark/.test(location.search));
  await MathJax.startup.promise;
  await Promise.all([...document.fonts].map((font) => font.load()));
  await Promise.all(all("figure > img").map((image) => image.decode()));
  document.body.classList.add("settling"); // lay out all slides; later Reveal hides all except one
  await MathJax.typesetPromise(sections);
  sections.forEach(settle);
  all("figure").forEach(fit);
  all("aside mjx-assistive-mml").forEach((part) => part.remove()); // the speaker view has no style for these
  document.body.classList.remove("settling");
  if (hold) { // reveal.js lays out the paper after the load event, which waits for this image
    Object.defineProperty(document, "readyState", { value: "complete" });
    addEventListener("pdf-ready", () => { hold.src = "data:,"; });
  }
  await Reveal.initialize({
    width: 1920, height: 1080, margin: 0, minScale: 0.1, maxScale: 4, center: false, display: "flex",
    progress: false, controls: false, hash: true, slideNumber: numbered, navigationMode: "linear",
    transition: "none", backgroundTransition: "none", pdfSeparateFragments: false, pdfMaxPagesPerSlide: 1,
    totalTime: 50 * 60, plugins: [RevealNotes],
    keyboardCondition: (event) => !event?.target?.closest?.("figure, .panel"), // a slider uses keys itself
  });
  for (const [key, [description, act]] of Object.entries(keys)) {
    Reveal.addKeyBinding({ keyCode: key.charCodeAt(0), key, description }, act);
  }
  const sharpen = () => { window.pixels = window.devicePixelRatio * Reveal.getScale(); };
  sharpen();
  Reveal.on("resize", sharpen);
  Reveal.on("slidechanged", show);
  show({ currentSlide: Reveal.getCurrentSlide() });
  // A remote control changes slides even after a slider was moved. Some keyboards have "?" on another key.
  addEventListener("keydown", (event) => {
    const act = { PageDown: "next", PageUp: "prev", "?": "toggleHelp" }[event.key];
    if (!act || (event.key !== "?" && !event.target.closest?.("figure, .panel"))) return;
    event.preventDefault();
    event.stopPropagation();
    Reveal[act]();
  }, true);
  if (voting) await ask();
  if (voting) setInterval(() => state.open && ask(), 1000);
  document.documentElement.dataset.ready = Math.round(performance.now());
};
begin();
