"use strict";
// Chosen cases: a box or lasso in one figure lists them, with their inputs, and lifts them out in all figures.
const reportCases = (function () {
  const data = JSON.parse(document.getElementById("case-data").textContent);
  if (!data) return null;
  const MOST_ROWS = 300, MOST_DRAWN = 6000;
  const [first, many] = Array.isArray(data.ids) ? data.ids : [0, 0];
  data.ids = many ? Float64Array.from({ length: many }, (_, k) => first + k) : reportFigures.numbers(data.ids);
  data.outcome = reportFigures.numbers(data.outcome);
  for (const column of data.columns) {
    column.words = Array.isArray(column.values) && column.values.some((value) => typeof value === "string");
    if (!column.words) column.values = reportFigures.numbers(column.values);
  }
  const columns = new Map(data.columns.map((column) => [column.name, column]));
  const listed = data.columns.filter((column) => column.role !== "place"); // the others are for figures alone
  const place = new Map(Array.from(data.ids, (id, row) => [id, row]));
  const all = Array.from(data.ids.keys());
  const clouds = reportFigures.figures.filter(reportFigures.hasCases);
  const selection = document.getElementById("selection");
  const explorer = document.getElementById("explorer");
  let choices = 0;
  let chosen = null;

  const isNumber = (value) => typeof value === "number" && !Number.isNaN(value);
  const grouped = (value) => String(value).replace(/\B(?=(\d{3})+$)/g, "\u202f");

  function shown(value) {
    if (typeof value === "string") return value;
    if (!isNumber(value)) return "–";
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
    const cell = element("td", shown(value), typeof value === "string" ? "text" : "number");
    if (isNumber(value)) cell.dataset.value = value;
    return cell;
  }

  function row(id) {
    const at = place.get(id), line = element("tr"), first = element("td", undefined, "number");
    first.dataset.value = id;
    first.append(caseLabel(id));
    line.append(first, element("td", data.outcomes[data.outcome[at]], "text"));
    for (const column of listed) line.append(valueCell(column.values[at]));
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
    for (const column of listed) {
      const value = median(rows.map((at) => column.values[at]));
      line.append(element("td", value === null ? "" : shown(value), "number"));
    }
    return line;
  }

  function heading() {
    const line = element("tr");
    for (const label of ["Case", "Outcome", ...listed.map((column) => column.label)]) {
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
    foot.append(medians(data.ids.length < data.tried ? "median of all in this page" : "median of all", all));
    document.getElementById("selection-table").replaceChildren(head, body, foot);
    let text = `${grouped(ids.length)} ${ids.length === 1 ? "case" : "cases"} chosen of ${grouped(data.tried)}`;
    if (data.ids.length < data.tried) text += `; this page holds ${grouped(data.ids.length)} of them, and counts no others`;
    if (ids.length > known.length) text += `; ${grouped(ids.length - known.length)} are drawn without their numbers`;
    if (known.length > MOST_ROWS) text += `; the first ${MOST_ROWS} are listed`;
    document.getElementById("selection-count").textContent = text;
    selection.hidden = false;
  }

  // Clouds over columns that the page holds come without their numbers.
  for (const figure of clouds) {
    for (const trace of figure.data) {
      if (!trace.rows) continue;
      const rows = reportFigures.numbers(trace.rows), [x, y, told] = trace.columns.map((name) => columns.get(name).values);
      if (told) trace.text = Array.from(rows, (row) => `${reportFigures.plain(columns.get(trace.columns[2]).label)}: ${shown(told[row])}`);
      trace.x = Array.from(rows, (row) => x[row]);
      trace.y = Array.from(rows, (row) => y[row]);
      trace.customdata = Array.from(rows, (row) => data.ids[row]);
    }
  }

  // How the chosen cases spread over the bins of a histogram, as high as its tallest bar.
  function chosenBars(bins, ids) {
    const values = columns.get(bins.columns[0]).values, edges = bins.edges, many = edges.length - 1;
    const counts = new Array(many).fill(0);
    for (const id of ids) {
      const value = place.has(id) ? values[place.get(id)] : NaN;
      const rounding = 1e-6 * (edges[many] - edges[0]); // of numbers of four bytes
      if (!(value >= edges[0] - rounding && value <= edges[many] + rounding)) continue;
      let low = 0, high = many; // edges[low] <= value, and value < edges[high] but at the end
      while (high - low > 1) { const half = (low + high) >> 1; if (edges[half] <= value) low = half; else high = half; }
      counts[low] += 1;
    }
    const tallest = Math.max(...reportFigures.numbers(bins.y)), most = Math.max(1, ...counts);
    return { ...bins, meta: "chosen", y: counts.map((count) => (count * tallest) / most), base: 0,
      marker: { color: "#D55E00", opacity: 0.75, line: { width: 0 } },
      customdata: counts.map((count, k) => `${shown(edges[k])} to ${shown(edges[k + 1])}: ${grouped(count)} of the chosen cases`) };
  }

  function lift(ids) {
    choices += 1;
    for (const figure of clouds) {
      figure.data = figure.data.filter((trace) => trace.meta !== "chosen");
      for (const trace of [...figure.data]) {
        if (trace.meta === "bins" && ids && columns.has(trace.columns[0])) figure.data.push(chosenBars(trace, ids));
        if (trace.meta !== "cases") continue;
        delete trace.selectedpoints;
        if (!ids) continue;
        trace.selectedpoints = Array.from(trace.customdata).flatMap((id, index) => (ids.has(id) ? [index] : []));
        trace.selected = { marker: { opacity: 1 } };
        trace.unselected = { marker: { opacity: 0.08 } };
      }
      figure.layout.selections = []; // the outline of a box goes: other figures and axes show the same choice
      figure.layout.selectionrevision = choices;
      reportFigures.update(figure);
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

  // Whether a point lies in a box or lasso of plotly's, in the units of the axes.
  function inside(event) {
    if (event.range) {
      const [x, y] = [event.range.x, event.range.y].map((ends) => [Math.min(...ends), Math.max(...ends)]);
      return (a, b) => a >= x[0] && a <= x[1] && b >= y[0] && b <= y[1];
    }
    const { x, y } = event.lassoPoints;
    return (a, b) => {
      let odd = false;
      for (let k = 0, before = x.length - 1; k < x.length; before = k++) {
        if (y[k] > b !== y[before] > b && a < ((x[before] - x[k]) * (b - y[k])) / (y[before] - y[k]) + x[k]) odd = !odd;
      }
      return odd;
    };
  }

  // All cases of the page in the box or lasso, those among them that the figure does not draw.
  function caught(figure, event) {
    const within = inside(event), found = new Set();
    const between = (name, low, high) => { // of figures with one column of the cases along x
      const values = columns.has(name) ? columns.get(name).values : [];
      for (const row of all) if (values[row] >= low && values[row] <= high) found.add(data.ids[row]);
    };
    for (const trace of figure.data) {
      if (trace.meta === "bins") {
        const ends = event.range ? event.range.x : event.lassoPoints.x;
        between(trace.columns[0], Math.min(...ends), Math.max(...ends));
      }
      if (trace.meta !== "cases") continue;
      if (trace.columns && trace.columns.length === 1 && columns.has(trace.columns[0])) {
        const [xs, ys] = [trace.x, trace.y].map(reportFigures.numbers), caughtHere = Array.from(xs).filter((x, k) => within(x, ys[k]));
        if (caughtHere.length) between(trace.columns[0], Math.min(...caughtHere), Math.max(...caughtHere));
      } else if (trace.columns && trace.columns.every((name) => columns.has(name))) {
        const [x, y] = trace.columns.map((name) => columns.get(name).values);
        for (const row of all) if (within(x[row], y[row])) found.add(data.ids[row]);
      } else {
        const [xs, ys] = [trace.x, trace.y].map(reportFigures.numbers);
        trace.customdata.forEach((id, k) => within(xs[k], ys[k]) && found.add(id));
      }
    }
    return found;
  }

  for (const figure of clouds) {
    figure.onDrawn = (panel) => {
      panel.on("plotly_selected", (event) => {
        if (!event || !(event.range || event.lassoPoints)) return; // a mere click, or our own drawing
        choose(caught(figure, event));
      });
      panel.on("plotly_deselect", () => choose(null));
    };
  }

  // ---- the figure of cases: other axes, and choosing without a mouse

  function columnOf(id) {
    return listed[Number(document.getElementById(id).value)];
  }

  function evenly(rows) {
    const step = Math.max(1, rows.length / MOST_DRAWN);
    return Array.from({ length: Math.min(rows.length, MOST_DRAWN) }, (_, k) => rows[Math.floor(k * step)]);
  }

  function redraw() {
    const x = columnOf("explorer-x"), y = columnOf("explorer-y");
    const figure = reportFigures.figures.find((one) => one.id === explorer.dataset.figure);
    const there = (column, at) => column.words || isNumber(column.values[at]);
    figure.data = data.clouds.map((cloud, k) => {
      const rows = evenly(all.filter((at) => data.outcome[at] === k && there(x, at) && there(y, at)));
      const take = (column) => rows.map((at) => column.values[at]);
      const names = [x, y].map((column) => reportFigures.plain(column.label));
      return { ...cloud, columns: [x.name, y.name], x: take(x), y: take(y), customdata: rows.map((at) => data.ids[at]),
        hovertemplate: `case %{customdata}<br>${names[0]}: %{x}<br>${names[1]}: %{y}<extra>%{fullData.name}</extra>` };
    });
    for (const axis of ["xaxis", "yaxis"]) {
      for (const member of ["range", "type", "autorange", "tickvals", "ticktext"]) delete figure.layout[axis][member];
    }
    delete figure.layout.yaxis.scaleanchor; // of two lengths, which other axes are not
    figure.layout.title.text = "";
    for (const [axis, column] of [["xaxis", x], ["yaxis", y]]) {
      figure.layout[axis].title.text = reportFigures.plain(column.label);
      figure.layout[axis].categoryorder = "category ascending"; // no before yes
    }
    document.getElementById(figure.id).parentNode.setAttribute("aria-label", `Scatter of ${y.label} against ${x.label}, a point a case.`);
    lift(chosen);
  }

  if (explorer) {
    for (const id of ["explorer-x", "explorer-y"]) document.getElementById(id).addEventListener("change", redraw);
    explorer.addEventListener("click", (event) => {
      const wanted = event.target.dataset.outcome;
      if (wanted === undefined) return;
      choose(wanted === "none" ? null : all.filter((at) => data.outcome[at] === Number(wanted)).map((at) => data.ids[at]));
    });
    explorer.addEventListener("submit", (event) => {
      event.preventDefault();
      const column = columnOf("explorer-column");
      const bound = (id, open) => { const text = document.getElementById(id).value; return text === "" ? open : Number(text); };
      const low = bound("explorer-low", -Infinity), high = bound("explorer-high", Infinity);
      choose(all.filter((at) => isNumber(column.values[at]) && column.values[at] >= low && column.values[at] <= high).map((at) => data.ids[at]));
    });
  }
  document.getElementById("selection-close").addEventListener("click", () => choose(null));
  return { data, listed, place, shown, element };
})();
