"use strict";

// An error must not go unseen: not far down the page, and not in a folded answer.
const error = document.querySelector(".lecture-error");
if (error) {
  const stopped = document.createElement("p");
  stopped.className = "lecture-stopped";
  stopped.textContent = "A cell failed: the lesson ends at the red line.";
  document.querySelector("#rendered_cells > div").prepend(stopped);
  for (let part = error; part; part = part.parentElement) {
    if (part.matches(".lecture-answer")) part.open = true;
  }
}

// PageDown and PageUp, which presenters' remote controls send, go from heading to heading, and
// through what is longer than a screen.
const turnPage = (forward) => {
  const screen = window.innerHeight;
  const distance = (heading) => heading.getBoundingClientRect().top - screen / 100;
  const stops = [...document.querySelectorAll("#rendered_cells :is(h1, h2, h3, h4)")].filter(
    (heading, i, all) =>
      heading.checkVisibility() &&
      // a poll that follows the title of its section at once is on the screen with it
      !(all[i - 1]?.matches("h2") && heading.matches("h3:not(summary *)") &&
        distance(heading) - distance(all[i - 1]) < screen / 7),
  );
  const next = forward
    ? stops.find((heading) => distance(heading) > screen / 50)
    : stops.findLast((heading) => distance(heading) < -screen / 50);
  if (!next || Math.abs(distance(next)) > 0.95 * screen) {
    window.scrollBy(0, (forward ? 0.85 : -0.85) * screen);
    return;
  }
  next.scrollIntoView();
  // Enter now opens an answer, and Tab goes on from here.
  const focused = next.closest("summary") ?? next;
  if (focused === next) next.tabIndex = -1;
  focused.focus({ preventScroll: true });
};

document.addEventListener("keydown", (event) => {
  const key = event.key;
  if (key !== "PageDown" && key !== "PageUp") return;
  if (event.target.closest("input:not([type=range]), textarea, select")) return;
  event.preventDefault();
  event.stopPropagation();
  turnPage(key === "PageDown");
}, true);
