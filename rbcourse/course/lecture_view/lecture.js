"use strict";

const page = document.documentElement;
const place = document.createElement("div");
place.className = "lecture-place";
document.body.append(place);
history.scrollRestoration = "manual";

// While cells run the page says how many have run.
voila_process = (cell, cells) => (place.textContent = `running: ${cell} of ${cells} cells`);

const distance = (heading) => heading.getBoundingClientRect().top - window.innerHeight / 100;

// Headings that are to be seen; a poll that follows the title of its section at once is on the
// screen with it.
const findStops = () =>
  [...document.querySelectorAll("#rendered_cells :is(h1, h2, h3, h4)")].filter(
    (heading, i, all) =>
      heading.checkVisibility() &&
      !(all[i - 1]?.matches("h2") && heading.matches("h3:not(summary *)") &&
        distance(heading) - distance(all[i - 1]) < window.innerHeight / 7),
  );

const findPlace = (stops) =>
  stops.findLastIndex((heading) => distance(heading) < window.innerHeight / 50);

// Where the page grows, because formulas are typeset or the window is another, the heading of the
// place stays where it is.
let anchor, anchorTop, pageHeight;

const drop = (heading) => {
  anchor = heading;
  anchorTop = distance(heading) / window.innerHeight;
  pageHeight = page.scrollHeight;
};

const keepPlace = () => {
  if (!anchor || pageHeight === page.scrollHeight) return;
  window.scrollBy(0, distance(anchor) - anchorTop * window.innerHeight);
  drop(anchor);
};

const tellPlace = () => {
  keepPlace();
  const stops = findStops(), at = findPlace(stops);
  place.textContent = `${at + 1} / ${stops.length}`;
  sessionStorage.setItem("lecture-place", at);
  if (stops[at]) drop(stops[at]);
};

const goTo = (stop) => {
  stop.scrollIntoView();
  drop(stop);
  tellPlace();
  // Enter now opens an answer, and Tab goes on from here.
  const focused = stop.closest("summary") ?? stop;
  if (focused === stop) stop.tabIndex = -1;
  focused.focus({ preventScroll: true });
};

const isClosed = (heading) => heading?.closest(".lecture-answer:not([open])");

// From heading to heading, and through what is longer than a screen; below a closed answer there is
// nothing to scroll through.
const turnPage = (forward) => {
  sessionStorage["lecture-start"] ??= Date.now();
  const screen = window.innerHeight, stops = findStops();
  const next = forward
    ? stops.find((heading) => distance(heading) > screen / 50)
    : stops.findLast((heading) => distance(heading) < -screen / 50);
  const above = forward ? stops.findLast((heading) => distance(heading) <= screen / 50) : next;
  if (next && (isClosed(above) || Math.abs(distance(next)) <= 0.95 * screen)) goTo(next);
  else window.scrollBy(0, (forward ? 0.85 : -0.85) * screen);
};

// The last poll that was reached, and its answer.
const findPoll = (stops) => {
  const poll = stops.slice(0, findPlace(stops) + 1).findLast((stop) => /^Poll \d/.test(stop.innerText));
  if (!poll) return {};
  const name = poll.innerText.trim();
  const answer = [...document.querySelectorAll(".lecture-answer")].find(
    (each) => each.querySelector("summary").innerText.trim() === `Answer to ${name.toLowerCase()}`,
  );
  return { poll, name, answer };
};

// The lecturer's window asks for this, and passes on the keys that are pressed in it.
window.lecture = {
  tell: () => {
    const stops = findStops(), at = findPlace(stops);
    return { stops, at, ...findPoll(stops), vote: window.vote?.words() };
  },
  press: (key) => (key in turns ? () => turnPage(turns[key]) : others[key.toLowerCase()])?.(),
};

const openLecturer = () => {
  const lecturer = window.open("", "lecturer", "popup,width=900,height=900");
  if (!lecturer) place.textContent = "The browser has blocked the lecturer's window.";
  if (!lecturer || lecturer.document.title) return;
  lecturer.document.write(document.querySelector("#lecturer").innerHTML);
  lecturer.document.close();
};

const toggle = (name) => page.classList.toggle(`lecture-${name}`);
const turns = { PageDown: true, ArrowRight: true, " ": true, PageUp: false, ArrowLeft: false };
const others = {
  b: () => toggle("blank"),
  d: () => toggle("dark"),
  f: () => (document.fullscreenElement ? document.exitFullscreen() : page.requestFullscreen()),
  l: openLecturer,
  v: () => window.vote?.turn(),
};

// Presenters' remote controls send PageDown and PageUp, and some of them B.
document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  if (event.target.closest("input:not([type=range]), textarea, select")) return;
  const { key } = event, turning = key.startsWith("Page");
  const control = "input, button, summary, a, [role=slider], [tabindex='0']";
  if (!turning && key in turns && event.target.closest(control)) return;
  if (!(key in turns || key.toLowerCase() in others)) return;
  event.preventDefault();
  event.stopPropagation();
  window.lecture.press(key);
}, true);

// An error must not go unseen: not far down the page, and not in a folded answer.
const showError = (error) => {
  const stopped = document.createElement("p");
  stopped.className = "lecture-stopped";
  stopped.textContent = "A cell failed: the lesson ends at the red line.";
  document.querySelector("#rendered_cells > div").prepend(stopped);
  for (let part = error; part; part = part.parentElement) {
    if (part.matches(".lecture-answer")) part.open = true;
  }
};

const askForPython = async (address) => {
  const answer = await fetch(address).catch(() => null);
  page.classList.toggle("lecture-gone", !answer?.ok);
};

window.addEventListener("load", () => {
  const error = document.querySelector(".lecture-error");
  if (error) showError(error);
  const last = findStops()[sessionStorage.getItem("lecture-place")];
  if (last) goTo(last);
  tellPlace();
  document.addEventListener("scroll", tellPlace);
  new ResizeObserver(keepPlace).observe(document.querySelector("#rendered_cells > div"));
  const { baseUrl, kernelId } = JSON.parse(document.querySelector("#jupyter-config-data").text);
  setInterval(askForPython, 5000, `${baseUrl}api/kernels/${kernelId}${location.search}`);
  const end = `${baseUrl}voila/api/shutdown/${kernelId}${location.search}`;
  window.addEventListener("pagehide", () => navigator.sendBeacon(end));
});

if (matchMedia("(prefers-color-scheme: dark)").matches) toggle("dark");
