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

// PageDown and PageUp, which presenters' remote controls send, go from heading to heading.
const turnPage = (forward) => {
  const headings = [...document.querySelectorAll("#rendered_cells :is(h1, h2, h3, h4)")].filter(
    (heading) => heading.checkVisibility(),
  );
  const distance = (heading) => heading.getBoundingClientRect().top - window.innerHeight / 50;
  const next = forward
    ? headings.find((heading) => distance(heading) > 2)
    : headings.findLast((heading) => distance(heading) < -2);
  if (!next) return;
  next.scrollIntoView();
  // Enter now opens an answer.
  next.closest("summary")?.focus({ preventScroll: true });
};

document.addEventListener("keydown", (event) => {
  const key = event.key;
  if (key !== "PageDown" && key !== "PageUp") return;
  if (event.target.closest("input, textarea, select, [contenteditable], .noUi-handle")) return;
  event.preventDefault();
  event.stopPropagation();
  turnPage(key === "PageDown");
}, true);
