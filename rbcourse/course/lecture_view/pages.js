"use strict";

const page = document.documentElement;

// The lesson is shown page by page. A page begins with a heading, or with what the page before has no
// room for, and what the next page shows is covered. Who scrolls by hand sees the lesson without pages.
const pages = (() => {
  const [above, below, place] = ["above", "below", "place"].map((name) => {
    const part = document.createElement("div");
    part.className = `lecture-${name}`;
    document.body.append(part);
    return part;
  });
  history.scrollRestoration = "manual";

  const screen = () => window.innerHeight;
  const margin = () => screen() / 100;

  // What stays in one piece: a heading, a paragraph, a row of a table, a figure, an explorer.
  const findBlocks = () =>
    [...document.querySelectorAll(
      `#rendered_cells :is(.jp-MarkdownOutput > :not(table), .jp-MarkdownOutput tr,
        .jp-OutputArea-output, .lecture-vote)`,
    )].filter((block) => block.getBoundingClientRect().height && block.checkVisibility());

  const isHeading = (block) => /^H[1-4]$/.test(block.tagName);

  // Headings that follow each other at once share a page, and an answer begins below its question.
  const findPages = () => {
    const found = [];
    let before = null;
    for (const block of findBlocks()) {
      const box = block.getBoundingClientRect();
      const top = box.top + window.scrollY, bottom = box.bottom + window.scrollY;
      const heading = isHeading(block);
      const answer = block.closest("summary");
      const below = answer && block.matches("h3, h4");
      const begins = heading && !below && !(before && isHeading(before));
      let last = found.at(-1);
      const room = last && bottom - last.top < screen() - margin();
      if (begins || !room) {
        last = { block, top, heading: last?.heading };
        found.push(last);
        for (let part = top + 0.85 * screen(); part < bottom - 0.15 * screen(); part += 0.85 * screen()) {
          found.push({ ...last, top: part });
        }
      }
      if (heading) last.focus = answer ?? block;
      if (heading && last.block === block) last.heading = block;
      before = block;
    }
    return found;
  };

  const distance = (one) => one.top - margin() - window.scrollY;
  const findPlace = (all) => all.findLastIndex((one) => distance(one) < screen() / 50);

  // The place is kept while the page grows: formulas are typeset, a picture comes, the window changes.
  let shown = null, height = 0, target = 0;

  const show = (one, all) => {
    shown = one;
    height = page.scrollHeight;
    window.scrollTo(0, one.top - margin());
    target = window.scrollY;
    const next = all[all.indexOf(one) + 1];
    cover(margin(), next ? Math.max(0, target + screen() - next.top) : 0);
    tell(all);
  };

  const cover = (top, bottom) => {
    above.style.height = `${top}px`;
    below.style.height = `${bottom}px`;
  };

  const tell = (all) => {
    const at = findPlace(all);
    place.textContent = `${at + 1} / ${all.length}`;
    if (all[at]) sessionStorage.setItem("lecture-place", everything().indexOf(all[at].block));
  };

  const everything = () => [...document.querySelectorAll("#rendered_cells *")];

  const goTo = (one, all) => {
    show(one, all);
    if (!one.focus) return;
    // Enter now opens an answer, and Tab goes on from here.
    if (!one.focus.matches("summary")) one.focus.tabIndex = -1;
    one.focus.focus({ preventScroll: true });
  };

  const keep = () => {
    if (height === page.scrollHeight) return;
    const all = findPages();
    const same = shown && all.findLast((one) => one.block === shown.block);
    if (same) show(same, all);
    height = page.scrollHeight;
  };

  const scrolled = () => {
    keep();
    if (Math.abs(window.scrollY - target) > 2) {
      shown = null;
      cover(0, 0);
    }
    tell(findPages());
  };

  const turn = (forward) => {
    sessionStorage["lecture-start"] ??= Date.now();
    const all = findPages();
    const next = forward
      ? all.find((one) => distance(one) > screen() / 50)
      : all.findLast((one) => distance(one) < -screen() / 50);
    if (next) goTo(next, all);
  };

  const begin = () => {
    const all = findPages();
    const before = everything()[sessionStorage.getItem("lecture-place")];
    const last = before && all.findLast((one) => !(one.block.compareDocumentPosition(before) & 2));
    goTo(last ?? all[0], all);
    document.addEventListener("scroll", scrolled);
    new ResizeObserver(keep).observe(document.querySelector("#rendered_cells > div"));
  };

  // Headings of all pages, the one of the place, and the poll that was reached last.
  const where = () => {
    const all = findPages(), at = findPlace(all), end = all[at + 1]?.top ?? Infinity;
    const headings = all.map((one) => one.heading?.innerText.trim() ?? "");
    const poll = findBlocks().findLast(
      (block) =>
        isHeading(block) && /^Poll \d/.test(block.innerText) &&
        block.getBoundingClientRect().top + window.scrollY < end,
    );
    return { headings, at, poll };
  };

  return { place, begin, turn, where };
})();
