// Return faults such as cut parts or small text, the page numbers of slides with little text, and the widths of pictures.
async () => {
  const faults = [], thin = [], widths = {}, sections = [...document.querySelectorAll(".slides section section")];
  const frame = () => new Promise(requestAnimationFrame);
  for (const [number, section] of sections.entries()) {
    const { h, v } = Reveal.getIndices(section), scale = Reveal.getScale();
    Reveal.slide(h, v, 99);
    for (let wait = 0; wait < 300 && section.querySelector("figure > :is(script, img[data-read])"); wait++) await frame();
    await frame();
    const say = (what) => faults.push(`${number + 1}: ${what}`);
    const sheet = section.getBoundingClientRect(), body = section.querySelector(".body").getBoundingClientRect();
    const box = (part) => part.getBoundingClientRect(), seen = (part) => part.checkVisibility() && box(part).width;
    for (const part of section.querySelectorAll(".words, .words *, .body mjx-container > svg")) {
      if (!seen(part) || part.closest("aside, mjx-assistive-mml") || part.closest("mjx-container > svg > *")) continue;
      const { left, right, top, bottom } = box(part), room = 3 * scale;
      if (left < body.left - room || right > body.right + room) say(`too wide: ${part.tagName} ${part.textContent}`);
      if (top < body.top - 2 * room || bottom > body.bottom + 2 * room) say(`too high: ${part.tagName} ${part.textContent}`);
    }
    const heading = section.querySelector("h3");
    if (heading && box(heading).height > 160 * scale) say(`heading of more than two lines: ${heading.textContent}`);
    const cut = () => [...section.querySelectorAll("figure > :is(img, canvas), figure > div > div:not(.rbcourse-view)")].filter((part) => {
      const { left, right, bottom } = box(part), margin = /[1-9]/.test(part.parentElement.dataset.crop) ? 1e9 : 3 * scale;
      return seen(part) && (left < sheet.left - margin || right > sheet.right + margin || bottom > sheet.bottom + margin);
    });
    for (let wait = 0; wait < 120 && cut().length; wait++) await frame();  // an interactive picture gets its size late
    for (const part of cut()) say(`picture cut: ${part.tagName}`);
    widths[number + 1] = section.querySelector("figure > :is(img, canvas)")?.offsetWidth;
    const texts = document.createTreeWalker(section, NodeFilter.SHOW_TEXT);
    while (texts.nextNode()) {
      const part = texts.currentNode.parentElement, apart = "aside, script, sup, sub, mjx-container, .rbcourse-view, [role=status]";
      if (!texts.currentNode.textContent.trim() || part.closest(apart) || !part.checkVisibility()) continue;
      const share = parseFloat(getComputedStyle(part).fontSize) / 10.8, least = part.matches(".words > p") ? 3.3 : 3.0;
      if (share < least) say(`text of ${share.toFixed(2)} %: ${texts.currentNode.textContent}`);
    }
    if (section.querySelector("[data-mjx-error], mjx-merror")) say("a formula cannot be set");
    const boxes = [...section.querySelectorAll(".words > *")].map(box).filter(({ height }) => height);
    const height = Math.max(...boxes.map(({ bottom }) => bottom)) - Math.min(...boxes.map(({ top }) => top));
    if (height < sheet.height / 4 && !section.querySelector("figure") && !section.matches(".title, .end")) thin.push(number + 1);
  }
  return [faults, thin, widths];
}
