"use strict";
// Figures: drawn with the page's own colours (those written "@ink"), again when light turns dark or for print.
const reportFigures = (function () {
  const figures = JSON.parse(document.getElementById("figures").textContent);
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const later = []; // what else is to be drawn again in other colours
  let colours = {};

  function pageColours(onPaper) {
    if (onPaper) return { ink: "#1b1f23", muted: "#5d666f", grid: "#dfe3e6", paper: "#ffffff" };
    const style = getComputedStyle(document.documentElement);
    const found = {};
    for (const name of ["ink", "muted", "grid", "paper"]) found[name] = style.getPropertyValue("--" + name).trim();
    return found;
  }

  // Only colour members are replaced: a text such as "@ink" in a name stays a text.
  function coloured(value, member) {
    if (typeof value === "string") {
      const colour = /color$/i.test(member) && value[0] === "@" ? colours[value.slice(1)] : undefined;
      return colour === undefined ? value : colour;
    }
    if (Array.isArray(value)) return member === "customdata" || value.length > 64 ? value : value.map((item) => coloured(item, member));
    if (value === null || typeof value !== "object") return value;
    return Object.fromEntries(Object.entries(value).map(([key, item]) => [key, coloured(item, key)]));
  }

  // A figure's cases can be chosen with a box or a lasso; all others only zoom.
  function draw(figure) {
    const layout = coloured(figure.layout, "");
    layout.font.family = getComputedStyle(document.body).fontFamily;
    layout.uirevision = "kept"; // a zoom outlives a new colour
    const unused = figure.data.some((trace) => trace.meta === "cases") ? [] : ["select2d", "lasso2d"];
    return Plotly.react(figure.id, coloured(figure.data, ""), layout, {
      displaylogo: false, responsive: true,
      // plotly offers to send a chart to its own site: a report goes nowhere unless its reader sends it
      modeBarButtonsToRemove: [...unused, "autoScale2d", "sendChartToCloud"], showSendToCloud: false, plotlyServerURL: "",
      toImageButtonOptions: { format: "svg", filename: figure.id },
    });
  }

  function drawAll(onPaper) {
    colours = pageColours(onPaper);
    for (const figure of figures) draw(figure);
    for (const again of later) again();
  }

  if (figures.length) {
    drawAll(false);
    dark.addEventListener("change", () => drawAll(false));
    window.addEventListener("beforeprint", () => drawAll(true));
    window.addEventListener("afterprint", () => drawAll(false));
  }
  // A text for plotly, which reads a small HTML of its own in every label.
  const plain = (text) => text.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");

  return { figures, draw, plain, onColours: (again) => later.push(again) };
})();
