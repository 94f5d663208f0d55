"use strict";
// Tables: a click on a heading sorts by it, a second click the other way; rows without a number come last.
(function () {
  function sortKey(row, column) {
    const cell = row.cells[column];
    return cell.dataset.value === undefined ? null : Number(cell.dataset.value);
  }

  function sort(table, column, heading) {
    const falling = heading.getAttribute("aria-sort") === "ascending";
    const rows = Array.from(table.tBodies[0].rows);
    const numeric = rows.some((row) => sortKey(row, column) !== null);
    rows.sort((a, b) => {
      let order;
      if (numeric) {
        const x = sortKey(a, column), y = sortKey(b, column);
        if (x === null || y === null) return (x === null) - (y === null);
        order = x - y;
      } else {
        order = a.cells[column].textContent.localeCompare(b.cells[column].textContent);
      }
      return falling ? -order : order;
    });
    for (const other of heading.parentNode.cells) other.removeAttribute("aria-sort");
    heading.setAttribute("aria-sort", falling ? "descending" : "ascending");
    table.tBodies[0].append(...rows);
  }

  // One listener for all tables, also for those made later.
  document.addEventListener("click", (event) => {
    const button = event.target.closest("th button");
    if (!button) return;
    const heading = button.parentNode;
    sort(heading.closest("table"), heading.cellIndex, heading);
  });
  // Longer tables can be searched: a row stays that has every word of the search.
  const LONG = 8;
  for (const figure of document.querySelectorAll("figure.table")) {
    const rows = Array.from(figure.querySelectorAll("tbody tr")), title = figure.querySelector("figcaption b").textContent;
    if (rows.length <= LONG) continue;
    const bar = document.createElement("p"), field = document.createElement("input"), status = document.createElement("span");
    bar.className = "search";
    field.type = "search";
    field.placeholder = "Search this table";
    field.setAttribute("aria-label", "Search " + title.replace(/\.$/, ""));
    status.setAttribute("role", "status");
    bar.append(field, " ", status);
    figure.querySelector(".scroll").before(bar);
    const texts = rows.map((row) => row.textContent.toLowerCase());
    field.addEventListener("input", () => {
      const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
      rows.forEach((row, k) => { row.hidden = !words.every((word) => texts[k].includes(word)); });
      const left = rows.filter((row) => !row.hidden).length;
      status.textContent = words.length ? `${left} of ${rows.length} rows` : "";
    });
  }
  if (window.innerWidth <= 1000) document.querySelector("nav details").open = false;
})();
