"use strict";
const table = document.getElementById("flights");
const body = table.tBodies[0];
const number = (cell) => {
  const value = parseFloat(cell.textContent);
  return Number.isNaN(value) ? Infinity : value;
};
for (const [column, head] of [...table.tHead.rows[0].cells].entries()) {
  head.tabIndex = 0;
  head.setAttribute("role", "button");
  const sort = () => {
    const down = head.getAttribute("aria-sort") === "ascending";
    for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const rows = [...body.rows];
    const isText = rows.every((row) => number(row.cells[column]) === Infinity);
    const compare = (a, b) => isText || column < 3 || column === 6
      ? a.cells[column].textContent.localeCompare(b.cells[column].textContent, "en", { numeric: true })
      : number(a.cells[column]) - number(b.cells[column]) || 0;
    rows.sort((a, b) => (down ? -1 : 1) * compare(a, b));
    body.append(...rows);
  };
  head.addEventListener("click", sort);
  head.addEventListener("keydown", (event) => {
    if (event.key === "Enter" || event.key === " ") {
      event.preventDefault();
      sort();
    }
  });
}
document.getElementById("filter").addEventListener("input", (event) => {
  const wanted = event.target.value.toLowerCase();
  for (const row of body.rows) row.hidden = !row.textContent.toLowerCase().includes(wanted);
  for (const figure of document.querySelectorAll("figure[data-flight]")) {
    figure.hidden = !figure.dataset.flight.toLowerCase().includes(wanted);
  }
});
