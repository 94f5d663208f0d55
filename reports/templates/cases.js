"use strict";
// Chosen cases: a box or lasso in one figure lists them, with their inputs, and lifts them out in all figures.
const reportCases = (function () {
  const data = JSON.parse(document.getElementById("case-data").textContent);
  if (!data) return null;
  const MOST_ROWS = 300;
  const place = new Map(data.ids.map((id, row) => [id, row]));
  const clouds = reportFigures.figures.filter((figure) => figure.data.some((trace) => trace.meta === "cases"));
  const selection = document.getElementById("selection");
  const explorer = document.getElementById("explorer");
  let choices = 0;
  let chosen = null;

  const caseOf = (item) => (Array.isArray(item) ? item[0] : item);
  const isNumber = (value) => typeof value === "number";
  const grouped = (value) => String(value).replace(/\B(?=(\d{3})+$)/g, "\u202f");

  function shown(value) {
    if (value === null) return "–";
    if (!isNumber(value)) return value;
    return String(Number(value.toPrecision(5))).replace("-", "−");
  }

  function element(tag, text, classes) {
    const made = document.createElement(tag);
    if (text !== undefined) made.textContent = text;
    if (classes) made.className = classes;
    return made;
  }

  function caseLabel(id) {
    if (!(id in data.histories)) return element("span", grouped(id));
    const link = element("a", grouped(id));
    link.href = "#case-" + id;
    link.title = "Its time history";
    return link;
  }

  function valueCell(value) {
    const cell = element("td", shown(value), isNumber(value) || value === null ? "number" : "text");
    if (isNumber(value)) cell.dataset.value = value;
    return cell;
  }

  function row(id) {
    const at = place.get(id), line = element("tr"), first = element("td", undefined, "number");
    first.dataset.value = id;
    first.append(caseLabel(id));
    line.append(first, element("td", data.outcomes[data.outcome[at]], "text"));
    for (const column of data.columns) line.append(valueCell(column.values[at]));
    return line;
  }

  function median(values) {
    const sorted = values.filter(isNumber).sort((a, b) => a - b), half = sorted.length >> 1;
    if (!sorted.length) return null;
    return sorted.length % 2 ? sorted[half] : (sorted[half - 1] + sorted[half]) / 2;
  }

  function medians(label, rows) {
    const line = element("tr"), heading = element("th", label);
    heading.colSpan = 2;
    heading.scope = "row";
    line.append(heading);
    for (const column of data.columns) {
      const value = median(rows.map((at) => column.values[at]));
      line.append(element("td", value === null ? "" : shown(value), "number"));
    }
    return line;
  }

  function heading() {
    const line = element("tr");
    for (const label of ["Case", "Outcome", ...data.columns.map((column) => column.label)]) {
      const cell = element("th"), button = element("button", label);
      cell.scope = "col";
      button.type = "button";
      cell.append(button);
      line.append(cell);
    }
    return line;
  }

  function list(ids) {
    const known = ids.filter((id) => place.has(id));
    const head = element("thead"), body = element("tbody"), foot = element("tfoot");
    head.append(heading());
    body.append(...known.slice(0, MOST_ROWS).map(row));
    foot.append(medians("median of these", known.map((id) => place.get(id))));
    foot.append(medians("median of all in this page", data.ids.map((_, at) => at)));
    document.getElementById("selection-table").replaceChildren(head, body, foot);
    let text = `${grouped(ids.length)} cases chosen, of ${grouped(data.ids.length)} in this page and ${grouped(data.tried)} flown`;
    if (ids.length > known.length) text += `; ${grouped(ids.length - known.length)} are drawn without their numbers`;
    if (known.length > MOST_ROWS) text += `; the first ${MOST_ROWS} are listed`;
    document.getElementById("selection-count").textContent = text;
    selection.hidden = false;
  }

  function lift(ids) {
    choices += 1;
    for (const figure of clouds) {
      for (const trace of figure.data) {
        if (trace.meta !== "cases") continue;
        delete trace.selectedpoints;
        if (!ids) continue;
        trace.selectedpoints = trace.customdata.flatMap((item, index) => (ids.has(caseOf(item)) ? [index] : []));
        trace.selected = { marker: { opacity: 1 } };
        trace.unselected = { marker: { opacity: 0.08 } };
      }
      figure.layout.selections = []; // the outline of a box goes: other figures and axes show the same choice
      figure.layout.selectionrevision = choices;
      reportFigures.draw(figure);
    }
  }

  // ids: cases, or null for none chosen.
  function choose(ids) {
    chosen = ids && new Set(ids);
    lift(chosen);
    if (chosen) list([...chosen].sort((a, b) => a - b));
    else selection.hidden = true;
    document.body.classList.toggle("choosing", Boolean(chosen));
  }

  for (const figure of clouds) {
    const panel = document.getElementById(figure.id);
    panel.on("plotly_selected", (event) => {
      if (!event || !(event.range || event.lassoPoints)) return; // a mere click, or our own drawing
      choose(event.points.filter((point) => point.data.meta === "cases").map((point) => caseOf(point.customdata)));
    });
    panel.on("plotly_deselect", () => choose(null));
  }

  // ---- the figure of cases: other axes, and choosing without a mouse

  function columnOf(id) {
    return data.columns[Number(document.getElementById(id).value)];
  }

  function redraw() {
    const x = columnOf("explorer-x"), y = columnOf("explorer-y");
    const figure = reportFigures.figures.find((one) => one.id === explorer.dataset.figure);
    figure.data = data.clouds.map((cloud, k) => {
      const rows = data.ids.map((_, at) => at).filter((at) => data.outcome[at] === k && x.values[at] !== null && y.values[at] !== null);
      return { ...cloud, x: rows.map((at) => x.values[at]), y: rows.map((at) => y.values[at]), customdata: rows.map((at) => data.ids[at]) };
    });
    for (const [axis, column] of [["xaxis", x], ["yaxis", y]]) {
      figure.layout[axis].title.text = reportFigures.plain(column.label);
    }
    document.getElementById(figure.id).parentNode.setAttribute("aria-label", `Scatter of ${y.label} against ${x.label}, a point a case.`);
    lift(chosen);
  }

  if (explorer) {
    for (const id of ["explorer-x", "explorer-y"]) document.getElementById(id).addEventListener("change", redraw);
    explorer.addEventListener("click", (event) => {
      const wanted = event.target.dataset.outcome;
      if (wanted === undefined) return;
      choose(wanted === "none" ? null : data.ids.filter((_, at) => data.outcome[at] === Number(wanted)));
    });
    explorer.addEventListener("submit", (event) => {
      event.preventDefault();
      const column = columnOf("explorer-column");
      const bound = (id, open) => { const text = document.getElementById(id).value; return text === "" ? open : Number(text); };
      const low = bound("explorer-low", -Infinity), high = bound("explorer-high", Infinity);
      choose(data.ids.filter((_, at) => isNumber(column.values[at]) && column.values[at] >= low && column.values[at] <= high));
    });
  }
  document.getElementById("selection-close").addEventListener("click", () => choose(null));
  return { data, place, shown, element };
})();
