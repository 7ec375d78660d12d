// Return a list of faults in the layout of the page.
() => {
  const faults = [], content = document.querySelector(".content"), page = document.documentElement;
  const shown = (element) => element.checkVisibility({ visibilityProperty: true }) && element.getClientRects().length;
  const name = (element) => `${element.tagName} ${element.className?.baseVal ?? element.className}: ${element.textContent.trim().slice(0, 40)}`;
  const colour = (text) => text.match(/[\d.]+/g).map(Number);
  const light = ([r, g, b]) => [0.2126, 0.7152, 0.0722].reduce((sum, share, i) => {
    const part = [r, g, b][i] / 255;
    return sum + share * (part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4);
  }, 0);

  if (page.scrollWidth > page.clientWidth) faults.push(`the page is ${page.scrollWidth} wide`);
  if (!content) return faults; // a page of code
  if (content.scrollWidth > content.clientWidth + 1) faults.push(`the text is ${content.scrollWidth} wide`);
  for (const fault of content.querySelectorAll("[data-mjx-error]")) faults.push(`formula: ${fault.dataset.mjxError}`);
  for (const element of content.querySelectorAll("*")) {
    if (!shown(element) || element.scrollWidth <= element.clientWidth + 2 || !element.clientWidth) continue;
    const { overflowX, backgroundImage, display } = getComputedStyle(element);
    if (overflowX === "visible" || display === "inline" || element.closest("[role=status], mjx-assistive-mml")) continue;
    if (!backgroundImage.includes("gradient") || overflowX !== "auto") faults.push(`cut: ${name(element)}`);
    else if (element.tabIndex < 0) faults.push(`scrolls by mouse only: ${name(element)}`);
  }

  // Check that a finger can use the controls.
  for (const element of innerWidth < 500 ? content.querySelectorAll("figure :is(button, input), summary, .buttons > *") : []) {
    const { width, height } = element.getBoundingClientRect();
    const least = element.type === "range" ? 220 : 44;
    if (shown(element) && (height < 43.5 || width < least - 0.5)) faults.push(`small for a finger, ${width} × ${height}: ${name(element)}`);
  }

  // Check that texts do not overlap, have enough contrast, and have lines of moderate length.
  const walker = document.createTreeWalker(content, NodeFilter.SHOW_TEXT), boxes = [];
  for (let node; (node = walker.nextNode()); ) {
    const element = node.parentElement;
    if (!node.data.trim() || !shown(element) || element.closest("mjx-container, script, style, svg, pre, .headerlink, figure [role=status]")) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    for (const { left, top, right, bottom } of range.getClientRects()) {
      if (right - left > 2 && getComputedStyle(element).clipPath === "none" && !element.closest('[style*="clip-path"]')) boxes.push({ left, top, right, bottom, element });
    }
    let ground = [0, 0, 0, 0];
    for (let each = element; each && (ground[3] ?? 1) < 1; each = each.parentElement) ground = colour(getComputedStyle(each).backgroundColor);
    const { color, opacity } = getComputedStyle(element), [one, two] = [light(colour(color)), light(ground)].sort((a, b) => b - a);
    const contrast = (one + 0.05) / (two + 0.05);
    if (contrast < 4.5 || opacity < 1) faults.push(`contrast ${contrast.toFixed(1)}: ${name(element)}`);
  }
  boxes.sort((a, b) => a.top - b.top);
  boxes.forEach((one, i) => {
    for (let j = i + 1; j < boxes.length && boxes[j].top < one.bottom - 4; j++) {
      const two = boxes[j], wide = Math.min(one.right, two.right) - Math.max(one.left, two.left);
      const high = Math.min(one.bottom, two.bottom) - Math.max(one.top, two.top);
      if (wide > 3 && high > 6 && one.element !== two.element) faults.push(`over one another: ${name(one.element)} | ${name(two.element)}`);
    }
  });
  for (const paragraph of innerWidth > 1000 ? content.querySelectorAll("section > p") : []) {
    if (!shown(paragraph) || paragraph.querySelector("mjx-container, img, code, button")) continue;
    const own = boxes.filter(({ element }) => paragraph.contains(element));
    const letters = (paragraph.innerText.length * paragraph.clientWidth) / own.reduce((sum, { left, right }) => sum + right - left, 0);
    if (own.length > 3 && paragraph.clientWidth > 500 && (letters > 80 || letters < 60)) faults.push(`${letters.toFixed(0)} letters in a line: ${name(paragraph)}`);
  }
  return faults;
}
