// A uPlot chart that fills its element and takes the page's colours.

import uPlot from "/page/uplot.js";
import { lineColour, themeColour } from "./colours.js";
import { formatNumber } from "./html_table.js";

const LEGEND = 24; // px

export class Chart {
  // series: [{ label, colour: number or name, dash, width, show }], bands: [[high, low, colour]] by place in series
  constructor(element, { title, series, bands = [], scales = {}, axes = [{}, {}], hooks = {}, cursor = {} }) {
    this.element = element;
    element.replaceChildren();
    const colour = c => typeof c === "number" ? lineColour(c) : themeColour(c);
    const axis = { stroke: themeColour("soft"), grid: { stroke: themeColour("grid"), width: 1 }, ticks: { stroke: themeColour("grid"), width: 1 } };
    this.plot = new uPlot({
      width: 300, height: 100,
      pxAlign: 0,
      scales: { x: { time: false, auto: false }, ...scales },
      axes: [{ ...axis, ...axes[0] }, { ...axis, size: 56, values: (_, ticks) => ticks.map(formatNumber), ...axes[1] }],
      series: [{ label: title, value: (_, v) => v == null ? "" : v.toFixed(3) }, ...series.map(s => ({
        stroke: colour(s.colour), width: s.width ?? 1, points: { show: false }, show: s.show ?? true, class: s.class ?? null, dash: s.dash, label: s.label,
        value: (_, v) => v == null ? "–" : v.toPrecision(4),
      }))],
      bands: bands.map(([high, low, c]) => ({ series: [high, low], fill: colour(c) + "38" })),
      cursor: { points: { size: 6 }, ...cursor },
      legend: { live: true },
      hooks,
    }, [[0], ...series.map(() => [null])], element);
    this.observer = new ResizeObserver(() => this.fit());
    this.observer.observe(element);
    this.fit();
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.element;
    const isNew = Math.abs(this.plot.width - width) > 1 || Math.abs(this.plot.height - height + LEGEND) > 1;
    if (width > 60 && height > 60 && isNew) this.plot.setSize({ width, height: height - LEGEND });
  }

  draw(data, from, to) {
    this.plot.batch(() => { this.plot.setData(data, false); this.plot.setScale("x", { min: from, max: to }); });
  }

  close() { this.observer.disconnect(); this.plot.destroy(); }
}
