// Show the rows whose name equals the filter. If there are none, show the rows with a cell that contains
// the filter. If there are none either, show the rows that contain all words of the filter.
addEventListener("DOMContentLoaded", () => {
  const filter = document.getElementById("filter"), found = document.getElementById("found");
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
