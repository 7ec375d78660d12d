"use strict";
// Slides of a lesson: sizes, interactive pictures, keys, votes. All files that they need are in the folder.
const all = (what, where = document) => [...where.querySelectorAll(what)];
const printing = /[?&](print-pdf|view=print)/.test(location.search);
const hold = /[?&]hold/.test(location.search) && Object.assign(new Image(), { src: "hold" }); // see serve.py
const voting = /[?&]token=/.test(location.search) && window === window.top;
const sections = all(".slides section section");

// Enlarge a picture with its controls as far as its place allows, and cut off white margins.
const fit = (figure) => {
  const seen = figure.querySelector(":scope > :is(canvas, img)"), body = figure.closest(".body");
  if (!seen || !figure.clientWidth) return;
  const numbers = body.querySelector(".panel > .rbcourse-numbers"); // they stand below the picture if they need the room
  if (numbers && body.querySelector(".words").offsetHeight + 34 > body.clientHeight) figure.append(numbers);
  const below = all(":scope > div", figure).reduce((sum, { offsetHeight }) => sum + offsetHeight, 0);
  figure.dataset.crop ??= seen.dataset.crop;
  const [left, top, right, bottom] = figure.dataset.crop.split(" ").map(Number);
  const ratio = +figure.dataset.ratio || seen.naturalWidth / seen.naturalHeight;
  const height = figure.clientHeight - (below && below + 10);
  const room = Math.min(figure.clientWidth / (1 - left - right), (height * ratio) / (1 - top - bottom));
  const width = Math.floor(room), high = width / ratio;
  figure.style.setProperty("--w", `${width}px`);
  const sides = [top * high, right * width, bottom * high, left * width].map((side) => `${side}px`);
  seen.style.margin = sides.map((side) => `-${side}`).join(" ");
  seen.style.clipPath = `inset(${sides.join(" ")} round 14px)`;
  seen.onpointerdown = () => { seen.style.clipPath = "none"; }; // a scene that turns needs its margins
};

// Text has the largest size that fits, of 50 to 36 pixels. Gaps shrink before text.
// A formula that is wider than its column shrinks, but not below 62 %.
const settle = (section) => {
  const body = section.querySelector(".body"), words = section.querySelector(".words");
  const room = body.clientHeight - parseFloat(getComputedStyle(body).paddingTop), largest = 50;
  const scale = body.getBoundingClientRect().width / body.offsetWidth; // rectangles are scaled, client widths are not
  const gaps = words.children.length + all("li", words).length, space = (more) => words.style.setProperty("--more", `${more}px`);
  const over = () => words.offsetHeight > room || all("table", words).some((table) => table.offsetWidth > words.clientWidth + 2);
  let trial = 0, more = 0;
  do {
    more = trial % 2 ? -16 : 0;
    space(more);
    section.style.fontSize = `${largest - 2 * Math.floor(trial / 2)}px`;
    for (const box of all("mjx-container[display=true]", section)) {
      box.style.fontSize = "";
      const parent = box.parentElement, column = parent.clientWidth - 2 * parseFloat(getComputedStyle(parent).paddingLeft);
      const width = box.querySelector("svg").getBoundingClientRect().width / scale;
      if (width > column + 1) box.style.fontSize = `${Math.max(62, Math.floor((98 * column) / width))}%`;
    }
  } while (over() && ++trial < largest - 34);
  space(Math.min(14, more + Math.max(0, (room - words.offsetHeight) / (2 * gaps)))); // gaps grow into the free room
};

// Pictures of the current and of the next slide become interactive; on paper, pictures are stills.
const revive = async (section) => {
  const script = section?.querySelector("figure > script[type]"), figure = script?.parentElement;
  if (!script) return;
  const own = JSON.parse(script.text), data = window.rbcourseStates?.[own] ?? own; // the book keeps the data in files
  for (const each of all("script", figure)) each.remove();
  figure.dataset.ratio = data.size[0] / data.size[1];
  await rbcourseDisplay.revive(figure.querySelector("img"), data);
  if (section.matches(".split")) { // sliders and numbers stand below the text, so that the picture is large
    const panel = Object.assign(document.createElement("div"), { className: "panel" });
    panel.append(...all(":scope > div > div:is(:has(> input), .rbcourse-choice, .rbcourse-numbers)", figure));
    section.querySelector(".words").append(panel);
    settle(section);
    new ResizeObserver(() => fit(figure)).observe(panel); // the numbers come later
  }
  const asked = section.parentElement.querySelector(".title, .poll") && !section.dataset.told;
  section.classList.toggle("quiet", Boolean(data.controls.length > 1 && asked));
  fit(figure);
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
    const shown = (parts) => all(parts, section).map(({ innerHTML }) => innerHTML.replace(/<mjx-assistive-mml.*?<\/mjx-assistive-mml>/gs, ""));
    const question = shown(".words > p").join("<br>"), options = shown(".option > div");
    if (voting && (poll || state.open)) ask(state.open ? {} : { poll, question, options });
  }],
};

// The server of this page counts the votes; without its token, voting is not possible.
let state = { open: false };
const ask = async (body) => {
  const answer = await fetch(`votes${location.search}`, body && { method: "POST", body: JSON.stringify(body) }).catch(() => null);
  if (!answer?.ok) return;
  state = await answer.json();
  const panel = document.querySelector("#vote"), votes = `${state.voters} ${state.voters === 1 ? "vote" : "votes"}`;
  panel.hidden = !state.open;
  panel.innerHTML = `${state.code}<div>${state.address.replace("http://", "")}</div><div>${votes}</div>`;
  for (const section of sections.filter(({ dataset }) => dataset.poll && dataset.poll === state.poll)) {
    all(".option", section).forEach((option, i) => {
      const share = `${Math.round((100 * (state.counts[i] ?? 0)) / (state.voters || 1))}%`;
      option.dataset.count = state.counts.length ? `${state.counts[i]} · ${share}` : "";
      option.style.setProperty("--share", state.counts.length ? share : "0");
    });
  }
};

// The slides after the end are not counted. The bar has a part for each section.
const count = 1 + sections.findIndex((section) => section.matches(".end"));
const numbered = (slide) => {
  const at = 1 + sections.indexOf(slide ?? Reveal.getCurrentSlide()), bar = document.querySelector("#bar");
  let before = 0;
  bar.replaceChildren(...(printing ? [] : all(".slides > section")).map(({ children }) => {
    const size = Math.min(children.length, count - before), part = document.createElement("i");
    part.style = `flex: ${size}; --done: ${(100 * (at - before)) / size}%`;
    before += size;
    return part;
  }));
  return [at <= count ? `${at} / ${count}` : `end + ${at - count}`];
};

const show = ({ currentSlide }) => {
  if (printing) return;
  for (const section of currentSlide.matches(".verdict") ? all("section", currentSlide.parentElement) : []) {
    section.dataset.told = "yes"; // show readouts from now on
    section.classList.remove("quiet");
  }
  all("figure", currentSlide).forEach(fit);
  revive(currentSlide).then(() => revive(sections[sections.indexOf(currentSlide) + 1]));
};

const begin = async () => {
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
    progress: false, controls: false, hash: true, slideNumber: numbered, jumpToSlide: false, navigationMode: "linear",
    transition: "none", backgroundTransition: "none", pdfSeparateFragments: false, pdfMaxPagesPerSlide: 1,
    totalTime: 50 * 60, plugins: [RevealNotes],
    keyboardCondition: (event) => !event?.target?.closest?.("figure, .panel"), // a slider uses keys itself
  });
  for (const [key, [description, act]] of Object.entries(keys)) {
    Reveal.addKeyBinding({ keyCode: key.charCodeAt(0), key, description }, act);
  }
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
