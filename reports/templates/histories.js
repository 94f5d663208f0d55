"use strict";
// The time history of one case, over the nominal one: opened by a link "#case-17", from tables or from elsewhere.
(function () {
  if (!reportCases) return;
  const { data, listed, place, shown } = reportCases;
  const dialog = document.getElementById("history"), panels = document.getElementById("history-panels");
  const held = Object.keys(data.histories).map(Number).sort((a, b) => a - b);
  let open = null;

  function curve(id, quantity) {
    const found = (data.histories[id] || {})[quantity.name];
    if (!found) return [];
    const nominal = id === -1;
    return [{
      type: "scatter", mode: "lines", x: found[0], y: found[1], name: nominal ? "nominal" : "case " + id,
      line: { color: nominal ? "@ink" : "#E69F00", dash: nominal ? "dot" : "solid", width: nominal ? 1.4 : 2 },
      hovertemplate: `${data.panel.xaxis.title.text}: %{x:.5g}<br>${reportFigures.plain(quantity.label)}: %{y:.5g}<extra>%{fullData.name}</extra>`,
    }];
  }

  function figureOf(quantity, index) {
    const layout = structuredClone(data.panel);
    layout.title.text = reportFigures.plain(quantity.label);
    const cases = open === -1 ? [-1] : [-1, open];
    const found = cases.flatMap((id) => curve(id, quantity));
    const drawn = reportFigures.figures.find((figure) => figure.quantity === quantity.name);
    const behind = drawn ? drawn.behind.map((place) => drawn.data[place]) : [];
    return { id: "history-" + index, data: [...behind, ...found], layout };
  }

  function inputs(id) {
    const at = place.get(id);
    if (at === undefined) return "Every input at its nominal value.";
    const parts = listed.filter((column) => column.role === "dispersion").map((column) => `${column.label} ${shown(column.values[at])}`);
    return `${data.outcomes[data.outcome[at]]}; ${parts.join(", ")}. Dotted: the nominal case; shaded, where the report has them: the envelopes of the cases.`;
  }

  function draw() {
    if (open === null) return;
    const figures = data.quantities.map(figureOf).filter((figure) => figure.data.length);
    for (const figure of figures) reportFigures.draw(figure);
  }

  function show(id) {
    open = id;
    const name = id === -1 ? "Nominal case" : "Case " + id;
    document.getElementById("history-title").textContent = name;
    document.getElementById("history-inputs").textContent = inputs(id);
    for (const panel of panels.children) Plotly.purge(panel);
    panels.replaceChildren(...data.quantities.map((quantity, index) => {
      const panel = reportCases.element("div", undefined, "panel");
      panel.id = "history-" + index;
      panel.setAttribute("role", "group");
      panel.setAttribute("aria-label", `${name}: ${quantity.label} against time`);
      return panel;
    }));
    if (!dialog.open) dialog.showModal();
    draw();
  }

  function step(by) {
    const next = held[(held.indexOf(open) + by + held.length) % held.length];
    location.replace("#case-" + next);
  }

  function follow() {
    const wanted = /^#case-(-?\d+)$/.exec(location.hash);
    if (wanted && wanted[1] in data.histories) show(Number(wanted[1]));
    else if (dialog.open) dialog.close();
  }

  // The address keeps the case while it is open, so a link to one case of a report can be passed on.
  dialog.addEventListener("close", () => {
    open = null;
    if (/^#case-/.test(location.hash)) history.replaceState(null, "", location.pathname + location.search);
  });
  document.getElementById("history-close").addEventListener("click", () => dialog.close());
  document.getElementById("history-before").addEventListener("click", () => step(-1));
  document.getElementById("history-after").addEventListener("click", () => step(1));
  document.addEventListener("click", (event) => {
    const link = event.target.closest('a[href^="#case-"]');
    if (link && link.getAttribute("href") === location.hash) follow(); // the same case again: no change of address
  });
  window.addEventListener("hashchange", follow);
  reportFigures.onColours(draw);
  follow();
})();
