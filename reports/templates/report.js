"use strict";
// Figures: drawn with the page's own colours (those written "@ink"), again when light turns dark or for print.
(function () {
  const figures = JSON.parse(document.getElementById("figures").textContent);
  const dark = window.matchMedia("(prefers-color-scheme: dark)");

  function pageColours(onPaper) {
    if (onPaper) return { ink: "#1b1f23", muted: "#5d666f", grid: "#dfe3e6", paper: "#ffffff" };
    const style = getComputedStyle(document.documentElement);
    const colours = {};
    for (const name of ["ink", "muted", "grid", "paper"]) colours[name] = style.getPropertyValue("--" + name).trim();
    return colours;
  }

  // Only colour members are replaced: a text such as "@ink" in a name stays a text.
  function coloured(value, colours, member) {
    if (typeof value === "string") {
      const colour = /color$/i.test(member) && value[0] === "@" ? colours[value.slice(1)] : undefined;
      return colour === undefined ? value : colour;
    }
    if (Array.isArray(value)) return member === "customdata" || value.length > 64 ? value : value.map((item) => coloured(item, colours, member));
    if (value === null || typeof value !== "object") return value;
    return Object.fromEntries(Object.entries(value).map(([key, item]) => [key, coloured(item, colours, key)]));
  }

  function draw(onPaper) {
    const colours = pageColours(onPaper);
    const family = getComputedStyle(document.body).fontFamily;
    for (const figure of figures) {
      const layout = coloured(figure.layout, colours, "");
      layout.font.family = family;
      Plotly.react(figure.id, coloured(figure.data, colours, ""), layout, {
        displaylogo: false, responsive: true, modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"],
        toImageButtonOptions: { format: "svg", filename: figure.id },
      });
    }
  }

  if (figures.length) {
    draw(false);
    dark.addEventListener("change", () => draw(false));
    window.addEventListener("beforeprint", () => draw(true));
    window.addEventListener("afterprint", () => draw(false));
  }
})();

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

  for (const button of document.querySelectorAll("th button")) {
    const heading = button.parentNode;
    button.addEventListener("click", () => sort(heading.closest("table"), heading.cellIndex, heading));
  }
  if (window.innerWidth <= 1000) document.querySelector("nav details").open = false;
})();
