// A uPlot chart that fills its element and takes the page's colours.

import uPlot from "/page/uplot.js";
import { lineColour, themeColour } from "./colours.js";
import { formatNumber } from "./html_table.js";

const FONT = "12px system-ui", LABEL = 15; // px for the label of an axis

export class Chart {
  // series: [{ label, colour: number or name, isFaint, dash, width, show, scale }], bands: [[high, low, colour]] by place in series
  constructor(element, { title, series, bands = [], scales = {}, axes = [{}, {}], hooks = {}, cursor = {} }) {
    this.element = element;
    element.replaceChildren();
    const colour = c => typeof c === "number" ? lineColour(c) : themeColour(c);
    const axis = { font: FONT, labelFont: FONT, stroke: themeColour("soft"), grid: { stroke: themeColour("grid"), width: 1 }, ticks: { stroke: themeColour("grid"), width: 1 } };
    this.plot = new uPlot({
      width: 300, height: 100,
      pxAlign: 0,
      scales: { x: { time: false, auto: false }, ...scales },
      axes: [{ ...axis, ...axes[0] }, { ...axis, size: 56, labelSize: LABEL, values: (_, ticks) => ticks.map(formatNumber), ...axes[1] }, ...axes.slice(2).map(own => ({ ...axis, ...own }))],
      series: [{ label: title, value: (_, v) => v == null ? "" : v.toFixed(3) }, ...series.map(s => ({
        stroke: colour(s.colour) + (s.isFaint ? "70" : ""), width: s.width ?? 1, points: { show: false }, show: s.show ?? true, class: s.class ?? null, dash: s.dash, label: s.label, scale: s.scale ?? "y",
        value: (_, v) => v == null ? "–" : v.toPrecision(4),
      }))],
      bands: bands.map(([high, low, c]) => ({ series: [high, low], fill: colour(c) + "38" })),
      cursor: { points: { size: 6 }, ...cursor },
      legend: { live: true },
      hooks,
    }, [[0], ...series.map(() => [null])], element);
    listenToTouch(this.plot.over);
    this.observer = new ResizeObserver(() => this.fit());
    this.legend = element.querySelector(".u-legend");
    this.observer.observe(element);
    this.observer.observe(this.legend); // which takes more lines where it is narrow
    this.fit();
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.element;
    const free = Math.max(height - this.legend.offsetHeight - 2, 30);
    const isNew = Math.abs(this.plot.width - width) > 1 || Math.abs(this.plot.height - free) > 1;
    if (width > 60 && height > 60 && isNew) this.plot.setSize({ width, height: free });
  }

  draw(data, from, to) {
    this.plot.batch(() => { this.plot.setData(data, false); this.plot.setScale("x", { min: from, max: to }); });
  }

  close() { this.observer.disconnect(); this.plot.destroy(); }
}

const AS_MOUSE = { touchstart: "mousedown", touchmove: "mousemove", touchend: "mouseup", touchcancel: "mouseup" };

// One finger reads values and chooses a span as the mouse does; two are left to the browser.
function listenToTouch(element) {
  let last = 0; // uPlot takes a mouse that is said not to have moved for one that has not
  for (const [touch, mouse] of Object.entries(AS_MOUSE)) element.addEventListener(touch, event => {
    const finger = event.changedTouches[0];
    if (event.touches.length > 1 || !finger) return;
    const { clientX, clientY, screenX, screenY } = finger, options = { clientX, clientY, screenX, screenY, movementX: clientX - last, bubbles: true, button: 0 };
    last = clientX;
    if (touch === "touchstart") for (const kind of ["mouseenter", "mousemove"]) element.dispatchEvent(new MouseEvent(kind, options));
    element.dispatchEvent(new MouseEvent(mouse, options));
  }, { passive: true });
}
