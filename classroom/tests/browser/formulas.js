// Lay out each slide with formulas again; return formulas that leave their column, or that are small without need.
() => {
  const faults = [], scale = Reveal.getScale();
  const places = (box) => { // of a formula and of its column
    const column = box.parentElement, { left } = column.getBoundingClientRect(), { paddingLeft, paddingRight } = getComputedStyle(column);
    const start = left + scale * (column.clientLeft + parseFloat(paddingLeft));
    const room = scale * (column.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight));
    return [box.querySelector("svg").getBoundingClientRect(), start, room];
  };
  for (const [number, section] of sections.entries()) {
    const boxes = section.querySelectorAll(".words mjx-container[display=true]");
    if (!boxes.length) continue;
    const { h, v } = Reveal.getIndices(section);
    Reveal.slide(h, v, 99);
    settle(section);
    for (const box of boxes) {
      const say = (what) => faults.push(`${number + 1}: ${what}: ${box.textContent}`), size = box.style.fontSize;
      const [{ left, right }, start, room] = places(box), margin = 3 * scale;
      if (left < start - margin || right > start + room + margin) say("a formula leaves its column");
      box.style.fontSize = "";
      const [{ width }, , free] = places(box);
      if (size && width <= free) say(`a formula that fits is shown at ${size}`);
      box.style.fontSize = size;
    }
  }
  return faults;
}
