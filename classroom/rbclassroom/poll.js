// The buttons of a poll. In JupyterLab a choice opens the answer below, and Shift+Enter passes a closed answer.
function pass(notebook) {
  const open = notebook.widgets.findIndex((cell, at) => at >= notebook.activeCellIndex && !cell.isHidden);
  if (open > notebook.activeCellIndex) notebook.activeCellIndex = open;
}

// Open the answer below; return what was found: the answer, or null.
function open(from) {
  let cell = from.closest(".jp-Cell");
  do cell = cell?.nextElementSibling; while (cell && !cell.querySelector(":is(h1, h2, h3)"));
  const answer = cell?.querySelector("h3")?.textContent.startsWith("Answer to") ? cell : null;
  answer?.querySelector(".jp-showHiddenCellsButton")?.click();
  return answer;
}

// Return the letter of the right option: the answer's text begins with it.
function right(cell) {
  for (; cell; cell = cell.nextElementSibling) {
    const letter = cell.querySelector(".jp-RenderedMarkdown > p > strong:first-child")?.textContent;
    if (/^[A-F]$/.test(letter)) return letter;
    if (cell.querySelector("h2")) return null;
  }
}

export default {
  render({ model, el }) {
    window.jupyterapp?.shell.currentWidget?.content?.activeCellChanged?.connect(pass); // a second time has no effect
    const make = (tag, settings) => Object.assign(document.createElement(tag), settings);
    const said = make("span", { role: "status" }), className = "jupyter-widgets jupyter-button widget-button";
    const buttons = model.get("letters").map((letter) => {
      const button = make("button", { className, style: "width: 4em", textContent: letter });
      button.onclick = () => {
        buttons.forEach((each) => {
          each.classList.toggle("mod-active", each === button);
          each.ariaPressed = each === button;
        });
        const answer = open(el);
        setTimeout(() => { // JupyterLab draws the opened cells first
          const best = right(answer);
          const verdict = best === letter ? `${letter} is right.` : `You chose ${letter}; the answer is ${best}.`;
          said.textContent = best ? ` ${verdict}` : " The answer is below.";
        }, 300);
      };
      return button;
    });
    Object.assign(el, { role: "group", ariaLabel: "Your vote" });
    el.append(...buttons, said);
  },
};
