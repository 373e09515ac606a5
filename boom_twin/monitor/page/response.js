// How the tip answers to a force and to every cylinder's drive in the present posture, and the measured spectrum over it.

import { Chart } from "./chart.js";
import { t, words } from "./i18n.js";
import { markFrequencies, oneDigit } from "./spectrum.js";

export class ResponseTab {
  constructor(connection) {
    this.lines = { natural: [], source: "" };
    this.loads = { names: [], trouble: "waiting for the model" };
    connection.addEventListener("lines", event => { if (event.detail.source !== this.lines.source) this.rebuild(); this.lines = event.detail; this.isNew = true; });
    connection.addEventListener("loads", event => { if (event.detail.names.length !== this.loads.names.length) this.rebuild(); this.loads = event.detail; this.isNew = true; });
    connection.addEventListener("response", event => { this.response = event.detail; this.isNew = true; });
    connection.addEventListener("spectrum", event => { this.spectrum = event.detail; this.isNew = true; });
    connection.addEventListener("reset", () => { this.spectrum = null; this.isNew = true; });
  }

  rebuild() { this.chart?.close(); this.chart = null; this.isNew = true; }

  draw() {
    if (!this.isNew) return;
    this.isNew = false;
    document.getElementById("response-words").textContent = this.words;
    const isKnown = !this.loads.trouble && this.response?.columns === this.loads.names.length;
    document.getElementById("answers").hidden = !isKnown;
    if (!isKnown) return;
    const { times, values, rows, columns } = this.response, frequencies = Array.from(times);
    this.chart ??= new Chart(document.getElementById("answers"), {
      title: t("m/s² of the tip by"),
      series: [...this.loads.names.map((label, i) => ({ label: label.startsWith("1 mm") ? t("1 mm of cylinder {n}", { n: i }) : t(label), colour: i })), { label: `${t(this.lines.source || "nothing measured")}, m/s²/√Hz`, colour: "ink", width: 2, dash: [2, 3], scale: "measured" }],
      scales: { x: { time: false, auto: false, distr: 3, range: (_, low, high) => [low, high] }, y: { distr: 3 }, measured: { distr: 3 } },
      axes: [{ label: t("frequency, Hz"), labelSize: 18, size: 44 }, { label: "m/s²", size: 62, values: oneDigit }, { label: "m/s²/√Hz", labelSize: 15, scale: "measured", side: 1, size: 62, grid: { show: false }, values: oneDigit }],
      hooks: { draw: [plot => markFrequencies(plot, this.lines.natural)] },
    });
    const curves = Array.from({ length: columns }, (_, c) => Array.from(values.subarray(c * rows, (c + 1) * rows)));
    this.chart.draw([frequencies, ...curves, this.measuredAt(frequencies)], frequencies[0], frequencies.at(-1));
  }

  get words() {
    if (this.loads.trouble) return t("no response: {why}", { why: words(this.loads.trouble) });
    const moved = this.lines.moved > 0 ? t("; THE BOOM MOVED within them, a cylinder by {size} mm: the spectrum is not of this posture", { size: (1000 * this.lines.moved).toFixed(0) }) : "";
    const measured = this.spectrum ? t("; dotted, right: root of the density of the acceleration {source}, last 40 s", { source: t(this.lines.source) }) + moved : t("; no spectrum yet, which needs 8 s");
    return t("amplitude of the tip's acceleration, both directions, by each load in this posture; dashed: natural frequencies") + measured;
  }

  // Root of the density of both directions, brought to the frequencies of the response.
  measuredAt(frequencies) {
    if (!this.spectrum) return frequencies.map(() => null);
    const { times, values, rows, columns } = this.spectrum, step = times[1] - times[0];
    const density = row => { let sum = 0; for (let c = 0; c < columns; c++) sum += values[c * rows + row]; return sum; };
    return frequencies.map(frequency => {
      const place = (frequency - times[0]) / step, row = Math.floor(place), share = place - row;
      const found = row + 1 < rows ? Math.sqrt((1 - share) * density(row) + share * density(row + 1)) : 0;
      return found > 0 ? found : null; // a logarithm is drawn
    });
  }
}
