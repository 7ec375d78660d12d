// Rows of the ledger that have all words of the filter are shown, the others not.
addEventListener("DOMContentLoaded", () => {
  const filter = document.getElementById("filter"), found = document.getElementById("found");
  const rows = [...document.querySelectorAll("table.ledger tbody tr")].map((row) => (
    { row, text: row.textContent.toLowerCase().replaceAll("\u00ad", "") }));
  const show = () => {
    const words = filter.value.toLowerCase().split(/\s+/).filter(Boolean);
    let count = 0;
    for (const { row, text } of rows) {
      row.hidden = !words.every((word) => text.includes(word));
      count += !row.hidden;
    }
    found.textContent = words.length ? `${count} of ${rows.length} rows` : "";
  };
  filter.addEventListener("input", show);
  addEventListener("hashchange", () => { filter.value = ""; show(); });
  show();
});
