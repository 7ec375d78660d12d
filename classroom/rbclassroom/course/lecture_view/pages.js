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
  const everything = () =>
    [...document.querySelectorAll(
      "#rendered_cells :is(.jp-MarkdownOutput > :not(table), .jp-MarkdownOutput tr, .jp-OutputArea-output)",
    )];
  const findBlocks = () =>
    everything().filter((block) => block.getBoundingClientRect().height && block.checkVisibility());

  // A table is not cut where a page has room for the whole of it.
  const toStayWith = (block) => {
    const table = block.closest("table");
    const whole = table?.rows[0] === block && table.offsetHeight < screen() - 2 * margin();
    return whole ? table : block;
  };

  const isHeading = (block) => /^H[1-4]$/.test(block.tagName);

  // Headings that follow each other at once share a page, an answer begins below its question, and a
  // part of a section below its first lines, where it has room to its end.
  const findPages = () => {
    const found = [], blocks = findBlocks();
    const topOf = (block) => block.getBoundingClientRect().top + window.scrollY;
    const bottomOf = (block) => block.getBoundingClientRect().bottom + window.scrollY;
    for (const [i, block] of blocks.entries()) {
      const top = topOf(block), bottom = bottomOf(block);
      const heading = isHeading(block);
      const answer = block.closest("summary");
      let last = found.at(-1);
      const fits = (end) => last && end - last.top < screen() - margin();
      const part = block.matches("h3, h4") && last?.block.matches("h2");
      const next = blocks.findIndex((other, k) => k > i && isHeading(other));
      const below =
        (answer && block.matches("h3, h4")) ||
        (i && isHeading(blocks[i - 1])) ||
        (part && top - last.top < 0.3 * screen() && fits(bottomOf(blocks.at(next - 1))));
      const begins = heading && !below;
      if (begins || !fits(bottomOf(toStayWith(block)))) {
        last = { block, top, headings: [] };
        found.push(last);
        const step = 0.85 * screen();
        for (let more = top + step; more < bottom - 0.15 * screen(); more += step) {
          found.push({ block, top: more, headings: [] });
        }
      }
      if (heading) last.headings.push(block);
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

  const goTo = (at, all = findPages()) => {
    const one = all.at(at);
    show(one, all);
    const heading = one.headings.at(-1);
    if (!heading) return;
    // Enter now opens an answer, and Tab goes on from here.
    const focused = heading.closest("summary") ?? heading;
    if (focused === heading) heading.tabIndex = -1;
    focused.focus({ preventScroll: true });
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
    keep();
    const all = findPages();
    const next = forward
      ? all.findIndex((one) => distance(one) > screen() / 50)
      : all.findLastIndex((one) => distance(one) < -screen() / 50);
    if (next >= 0) goTo(next, all);
  };

  const begin = () => {
    const all = findPages();
    const before = everything()[sessionStorage.getItem("lecture-place")];
    const known = (one) => before && !(one.block.compareDocumentPosition(before) & 2);
    goTo(Math.max(0, all.findLastIndex(known)), all);
    document.addEventListener("scroll", scrolled);
    new ResizeObserver(keep).observe(document.querySelector("#rendered_cells > div"));
  };

  const say = (words) => (place.textContent = words);

  // The headings of each page, which page is shown, and the poll that was reached last, or is here.
  const where = (here = false) => {
    keep();
    const all = findPages(), at = findPlace(all);
    const reached = all.slice(here ? at : 0, at + 1).flatMap((one) => one.headings);
    const poll = reached.findLast((heading) => /^Poll \d/.test(heading.innerText));
    const named = (heading) => !heading.closest("summary");
    const headings = all.map(
      (one) => one.headings.filter(named).map((heading) => heading.innerText.trim()),
    );
    return { headings, at, poll };
  };

  return { say, begin, goTo, turn, where };
})();
