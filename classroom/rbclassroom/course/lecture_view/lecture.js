"use strict";

// While cells run the page says how many have run.
voila_process = (cell, cells) => pages.say(`running: ${cell} of ${cells} cells; formulas come last`);

const findAnswer = (poll) =>
  [...document.querySelectorAll(".lecture-answer")].find(
    (each) => each.querySelector("summary").innerText.trim() === `Answer to ${poll.toLowerCase()}`,
  );

// The lecturer's window asks for this, and passes on the keys that are pressed in it.
window.lecture = {
  tell: () => {
    const { headings, at, poll } = pages.where(), name = poll?.innerText.trim();
    return { headings, at, poll, name, answer: poll && findAnswer(name), vote: window.vote?.sentence() };
  },
  press: (key) => (key in turns ? () => pages.turn(turns[key]) : others[key.toLowerCase()])?.(),
};

const openLecturer = () => {
  const lecturer = window.open("", "lecturer", "popup,width=900,height=900");
  if (!lecturer) pages.say("The browser has blocked the lecturer's window.");
  if (!lecturer || lecturer.document.title) return;
  lecturer.document.write(document.querySelector("#lecturer").innerHTML);
  lecturer.document.close();
};

const toggle = (name) => page.classList.toggle(`lecture-${name}`);
const turns = { PageDown: true, ArrowRight: true, " ": true, PageUp: false, ArrowLeft: false };
const others = {
  home: () => pages.goTo(0),
  end: () => pages.goTo(-1),
  b: () => toggle("blank"),
  d: () => toggle("dark"),
  f: () => (document.fullscreenElement ? document.exitFullscreen() : page.requestFullscreen()),
  l: openLecturer,
  v: () => window.vote?.press(),
};

// Presenters' remote controls send PageDown and PageUp, and some of them B.
document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  if (event.target.closest("input:not([type=range]), textarea, select")) return;
  const { key } = event, letter = key.length === 1 && key !== " ", turning = key.startsWith("Page");
  const control = "input, button, summary, a, [role=slider], [tabindex='0']";
  if (!letter && !turning && event.target.closest(control)) return;  // its own keys
  if (!(key in turns || key.toLowerCase() in others)) return;
  event.preventDefault();
  event.stopPropagation();
  if (!event.repeat) window.lecture.press(key);
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

// A renderer looks for its widget for two seconds. On a busy machine that is too short: widgets are
// rendered when all of them have arrived from Python.
const showWidgets = () => {
  const manager = window.jupyterapp?.widgetManager;
  if (!manager?.restoredStatus) return void setTimeout(showWidgets, 50);
  for (const script of document.querySelectorAll(".lecture-widget")) {
    const renderer = manager.rendermime.createRenderer("application/vnd.jupyter.widget-view+json");
    renderer.addClass("jp-OutputArea-output");
    renderer.constructor.attach(renderer, script.parentElement, script);
    renderer.renderModel(JSON.parse(script.text));
  }
};

const askForPython = async (address) => {
  const answer = await fetch(address).catch(() => null);
  page.classList.toggle("lecture-gone", !answer?.ok);
};

window.addEventListener("load", () => {
  const error = document.querySelector(".lecture-error");
  if (error) showError(error);
  pages.begin();
  showWidgets();
  const { baseUrl, kernelId } = JSON.parse(document.querySelector("#jupyter-config-data").text);
  setInterval(askForPython, 5000, `${baseUrl}api/kernels/${kernelId}${location.search}`);
  const end = `${baseUrl}voila/api/shutdown/${kernelId}${location.search}`;
  window.addEventListener("pagehide", () => navigator.sendBeacon(end));
});

if (matchMedia("(prefers-color-scheme: dark)").matches) toggle("dark");
