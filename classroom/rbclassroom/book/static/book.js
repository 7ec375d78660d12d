// Scripts of the book's pages, for folded code, wide formulas, excerpts and the ledger.
addEventListener("DOMContentLoaded", () => {
  const all = (selector, from = document) => [...from.querySelectorAll(selector)];

  const code = document.querySelector("#all-code");
  code?.addEventListener("click", () => {
    const shown = code.ariaPressed !== "true";
    code.ariaPressed = shown;
    for (const each of all("details.hide")) each.open = shown;
  });

  // Keep a formula and the punctuation marks next to it on one line.
  const join = () => {
    for (const formula of all("span.math:has(> mjx-container)")) {
      const { previousSibling: before, nextSibling: after } = formula, part = new Range();
      const start = before?.data?.search(/\S{0,2}[(“‘]$/) ?? -1, end = after?.data?.match(/^[^\s\p{L}]{0,4}/u)[0].length;
      if (start < 0 && !end) continue;
      part.selectNode(formula);
      if (start >= 0) part.setStart(before, start);
      if (end) part.setEnd(after, end);
      part.surroundContents(Object.assign(document.createElement("span"), { className: "whole" }));
    }
  };

  // Shrink formulas that are too wide, but not below 80 %, or 66 % on a phone, where letters then have 11 pixels.
  // Formulas that are still too wide can be scrolled, also with keys.
  const fit = () => {
    const least = matchMedia("(max-width: 46em)").matches ? 66 : 80;
    for (const formula of all('mjx-container[display="true"]')) {
      formula.style.fontSize = "";
      const share = formula.clientWidth / formula.scrollWidth;
      if (share < 1) formula.style.fontSize = `${Math.max(least, Math.floor(99 * share))}%`;
    }
    for (const formula of all('span.math > mjx-container:not([display])')) {
      const room = formula.closest("p, li, td, dd, summary")?.clientWidth;
      formula.classList.toggle("scrolls", Boolean(room) && formula.firstElementChild.clientWidth > room);
    }
    for (const each of all('mjx-container[display="true"], .scrolls, .content pre, .content table')) {
      if (each.scrollWidth > each.clientWidth + 1) each.tabIndex = 0;
    }
  };
  // On a phone, each row of a table that is too wide is a card.
  for (const table of matchMedia("(max-width: 46em)").matches ? all(".content table:not(.ledger, figure *)") : []) {
    const names = all("thead th", table).map((cell) => cell.textContent);
    if (table.scrollWidth <= table.clientWidth + 1 || names.length > 4) continue;
    table.classList.add("narrow");
    for (const row of all("tbody tr", table)) all("td", row).forEach((cell, k) => { if (k && names[k]) cell.dataset.name = names[k]; });
  }
  addEventListener("load", () => Promise.resolve(window.MathJax?.startup?.promise).then(join).then(fit));
  addEventListener("resize", fit);
  addEventListener("toggle", fit, { capture: true }); // a folded element was opened or closed

  // Scroll the list of pages to the current page.
  const current = all(".sidebar-tree .current-page").at(-1), list = document.querySelector(".sidebar-scroll");
  if (current) list.scrollTop = current.offsetTop - list.clientHeight / 2;

  // The hint "drag to turn" disappears when the reader touches the picture.
  addEventListener("pointerdown", ({ target }) => target.closest("figure")?.classList.add("touched"));

  // On a phone, the columns of a figure are shown one below another, at one scale.
  for (const image of matchMedia("(max-width: 46em)").matches ? all("img[data-cuts]") : []) {
    const cuts = [0, ...image.dataset.cuts.split(" ").map(Number), 1], part = document.createElement("span");
    const sizes = cuts.slice(1).map((end, k) => end - cuts[k]), widest = Math.max(...sizes);
    const [width, height] = image.style.aspectRatio.split("/");
    part.append(...sizes.map((size, k) => {
      const column = image.cloneNode();
      column.className = "column"; // it covers its box with the picture, and shows the part from cuts[k]
      column.style = `--share: ${(100 * size) / widest}%; aspect-ratio: ${(size * width) / height}; object-position: ${(100 * cuts[k]) / (1 - size)}%`;
      if (k) column.alt = ""; // the first column has the description
      return column;
    }));
    image.replaceWith(part);
  }

  // The picture of the start page plays once when it becomes visible. All controls except
  // the slider are folded under "More".
  const hero = document.querySelector("figure.hero");
  hero?.addEventListener("drawn", ({ target: canvas }) => {
    const slider = all("input", hero).at(-1), panel = slider.parentNode.parentNode, more = document.createElement("details");
    more.innerHTML = "<summary>More: turn the picture, change it, see its numbers</summary>";
    more.append(...[...panel.children].filter((child) => child !== slider.parentNode), ...all("figcaption", hero));
    panel.append(more);
    if (matchMedia("(prefers-reduced-motion: reduce)").matches) return;
    const button = slider.parentNode.querySelector("button");
    const seen = new IntersectionObserver(([{ isIntersecting }]) => {
      if (!isIntersecting) return;
      seen.disconnect();
      slider.value = 0;
      button.click();
      const end = () => {
        if (button.textContent === "▶") return; // the reader has paused the picture
        if (slider.value !== slider.max) return requestAnimationFrame(end);
        button.click();
        slider.value = slider.max / 2; // the cubes differ at this time
        slider.dispatchEvent(new Event("input", { bubbles: true }));
      };
      end();
    }, { threshold: 0.6 });
    seen.observe(canvas);
  }, { once: true });

  // Show an excerpt of the page below each search result.
  const results = document.querySelector("#search-results");
  if (!results) return;
  const words = (new URLSearchParams(location.search).get("q") ?? "").toLowerCase().split(/\s+/).filter(Boolean);
  const tell = () => {
    for (const link of all("li:not(:has(.excerpt)) > a", results)) {
      const name = link.getAttribute("href").replace(/\.html.*/, ""), text = window.rbcourseTexts?.[name] ?? "";
      const at = Math.max(0, text.toLowerCase().indexOf(words[0])), from = at < 60 ? 0 : text.indexOf(" ", at - 60) + 1;
      const said = `${from ? "… " : ""}${text.slice(from, text.indexOf(" ", from + 180))} …`;
      if (text) link.after(Object.assign(document.createElement("p"), { className: "excerpt", textContent: said }));
    }
  };
  document.head.append(Object.assign(document.createElement("script"), { src: "_static/texts.js", onload: tell }));
  new MutationObserver(tell).observe(results, { childList: true, subtree: true });
});

// The filter of the ledger shows the rows whose name equals the filter. If there are none, it shows the
// rows with a cell that contains the filter. If there are none either, it shows the rows that contain all
// words of the filter.
addEventListener("DOMContentLoaded", () => {
  const filter = document.getElementById("filter"), found = document.getElementById("found");
  if (!filter) return;
  const plain = (text) => text.toLowerCase().replace(/\bfigures?\b/g, "fig.").replace(/\s+/g, " ").trim();
  const sections = [...document.querySelectorAll("section:has(> * table.ledger, > table.ledger)")];
  const rows = [...document.querySelectorAll("table.ledger tbody tr")].map((row) => (
    { row, cells: [...row.cells].map((cell) => plain(cell.innerText || cell.textContent)), text: plain(row.textContent) }));
  const show = () => {
    const phrase = plain(filter.value), words = phrase.split(" ");
    let chosen = rows.filter(({ cells }) => cells[0] === phrase);
    if (!chosen.length) chosen = rows.filter(({ cells }) => cells.some((cell) => cell.includes(phrase)));
    if (!chosen.length) chosen = rows.filter(({ text }) => words.every((word) => text.includes(word)));
    for (const each of rows) each.row.hidden = !chosen.includes(each);
    for (const section of sections) section.hidden = !section.querySelector("tbody tr:not([hidden])");
    found.textContent = phrase ? `${chosen.length} of ${rows.length} rows` : "";
  };
  filter.addEventListener("input", show);
  addEventListener("hashchange", () => { filter.value = ""; show(); });
  show();
});
