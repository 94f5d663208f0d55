"use strict";
// Figures: drawn as they come in sight, with the page's own colours (those written "@ink", and the blue of most marks,
// which is lighter on a dark page), again when light turns dark.
const reportFigures = (function () {
  const figures = JSON.parse(document.getElementById("figures").textContent);
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  const shown = new Set(); // figures that are drawn
  const later = []; // what else is to be drawn again in other colours
  const KINDS = { f4: Float32Array, f8: Float64Array, i4: Int32Array, u4: Uint32Array, u1: Uint8Array };
  let colours = pageColours(false);

  // Numbers of the page's JSON: a list, or base64 of their bytes.  What is not a number is NaN.
  function numbers(list) {
    if (Array.isArray(list)) return list.map((value) => (value === null ? NaN : value));
    const found = new KINDS[list.dtype](Uint8Array.from(atob(list.bdata), (sign) => sign.charCodeAt(0)).buffer);
    return list.start ? Float64Array.from(found, (value) => value + list.start) : found;
  }

  function pageColours(onPaper) {
    if (onPaper) return { "@ink": "#1b1f23", "@muted": "#5d666f", "@grid": "#dfe3e6", "@paper": "#ffffff" };
    const style = getComputedStyle(document.documentElement);
    const found = { "#0072B2": style.getPropertyValue("--blue").trim() };
    for (const name of ["ink", "muted", "grid", "paper"]) found["@" + name] = style.getPropertyValue("--" + name).trim();
    return found;
  }

  // Only colour members are replaced: a text such as "@ink" in a name stays a text.
  function coloured(value, member) {
    if (typeof value === "string") {
      return (/color$/i.test(member) && colours[value]) || value;
    }
    if (ArrayBuffer.isView(value)) return value;
    if (Array.isArray(value)) return member === "customdata" || value.length > 64 ? value : value.map((item) => coloured(item, member));
    if (value === null || typeof value !== "object") return value;
    return Object.fromEntries(Object.entries(value).map(([key, item]) => [key, coloured(item, key)]));
  }

  const hasCases = (figure) => figure.data.some((trace) => trace.meta === "cases" || trace.meta === "bins");

  // A figure's cases can be chosen with a box or a lasso; all others only zoom.
  function draw(figure) {
    const layout = coloured(figure.layout, "");
    layout.font.family = getComputedStyle(document.body).fontFamily;
    layout.uirevision = "kept"; // a zoom outlives a new colour
    if (figure.width) layout.width = figure.width;
    const unused = hasCases(figure) ? [] : ["select2d", "lasso2d"];
    const first = !shown.has(figure);
    shown.add(figure);
    const drawn = Plotly.react(figure.id, coloured(figure.data, ""), layout, {
      displaylogo: false, responsive: true,
      // plotly offers to send a chart to its own site: a report goes nowhere unless its reader sends it
      modeBarButtonsToRemove: [...unused, "autoScale2d", "sendChartToCloud"], showSendToCloud: false, plotlyServerURL: "",
      toImageButtonOptions: { format: "svg", filename: figure.id },
    });
    if (first && figure.onDrawn) figure.onDrawn(document.getElementById(figure.id));
    return drawn;
  }

  // Draws a figure that is drawn already; the others are drawn with all changes when they come in sight.
  function update(figure) {
    if (shown.has(figure)) draw(figure);
  }

  function repaint(onPaper, all) {
    colours = pageColours(onPaper);
    for (const figure of figures) if (all || shown.has(figure)) draw(figure);
    for (const again of later) again();
  }

  // Paper is narrower than most windows: figures are drawn for its width, or they would be cut.
  function forPaper(begin) {
    for (const figure of figures) {
      const panel = document.getElementById(figure.id), small = panel.parentNode.classList.contains("small");
      figure.width = begin ? (small ? 310 : 640) : undefined;
    }
    repaint(begin, begin);
    if (!begin) for (const figure of shown) Plotly.Plots.resize(figure.id);
  }

  // The other scripts of the page have their say first.
  window.addEventListener("DOMContentLoaded", () => {
    const byPanel = new Map(figures.map((figure) => [document.getElementById(figure.id), figure]));
    const watch = new IntersectionObserver((entries) => {
      for (const entry of entries) {
        if (!entry.isIntersecting) continue;
        watch.unobserve(entry.target);
        if (!shown.has(byPanel.get(entry.target))) draw(byPanel.get(entry.target));
      }
    }, { rootMargin: "600px 0px" });
    // What is in sight from the start is there with the first picture of the page, which is all that a screenshot takes.
    const inSight = (box) => box.height > 0 && box.top < window.innerHeight && box.bottom > 0;
    const first = [...byPanel.keys()].filter((panel) => inSight(panel.getBoundingClientRect()));
    for (const panel of first) draw(byPanel.get(panel));
    for (const panel of byPanel.keys()) if (!first.includes(panel)) watch.observe(panel);
    dark.addEventListener("change", () => repaint(false, false));
    window.addEventListener("beforeprint", () => forPaper(true));
    window.addEventListener("afterprint", () => forPaper(false));
  });

  // A text for plotly, which reads a small HTML of its own in every label.
  const plain = (text) => text.replace(/&/g, "&amp;").replace(/</g, "&lt;").replace(/>/g, "&gt;");

  return { figures, draw, update, numbers, plain, hasCases, onColours: (again) => later.push(again) };
})();
