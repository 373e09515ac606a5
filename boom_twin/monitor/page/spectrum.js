// Power spectral density of the tip's acceleration, the model's natural frequencies, peaks.

import { Chart } from "./chart.js";
import { lineColour, themeColour } from "./colours.js";
import { t } from "./i18n.js";

const LOWEST = 0.25, HIGHEST = 50; // Hz

export class SpectrumTab {
  constructor(connection, htmlTable) {
    this.htmlTable = htmlTable;
    this.lines = { natural: [], peaks: [], source: "", moved: 0 };
    connection.addEventListener("lines", event => this.setLines(event.detail));
    connection.addEventListener("spectrum", event => this.setSpectrum(event.detail));
  }

  setLines(lines) {
    if (lines.source !== this.lines.source) this.rebuild();
    this.lines = lines;
    this.isNew = true;
  }

  setSpectrum({ times: frequencies, values, rows }) {
    this.density = [Array.from(frequencies).slice(1), ...[0, 1].map(c => Array.from(values.slice(c * rows + 1, (c + 1) * rows)))];
    this.isNew = true;
  }

  rebuild() { this.chart?.close(); this.chart = null; this.isNew = true; }

  draw() {
    if (!this.isNew) return;
    this.isNew = false;
    if (!this.density) return;
    this.chart ??= new Chart(document.getElementById("density"), {
      title: `${t("density")}, ${t(this.lines.source)}`,
      series: this.lines.axes.map((label, i) => ({ label: t(label), colour: i })),
      scales: { x: { time: false, auto: false, distr: 3 }, y: { distr: 3 } },
      axes: [{ label: t("frequency, Hz"), labelSize: 18, size: 44 }, { label: "(m/s²)²/Hz", size: 62, values: oneDigit }],
      hooks: { draw: [plot => this.drawModes(plot)] },
    });
    this.chart.draw(this.density, LOWEST, Math.min(HIGHEST, this.density[0].at(-1)));
    this.fillPeaks();
  }

  drawModes(plot) {
    markFrequencies(plot, this.lines.natural);
    const { ctx } = plot;
    ctx.save();
    ctx.strokeStyle = lineColour(2);
    ctx.lineWidth = 2;
    for (const peak of this.lines.peaks) {
      ctx.beginPath(); ctx.arc(plot.valToPos(peak.frequency, "x", true), plot.valToPos(peak.density, "y", true), 7 * devicePixelRatio, 0, 7); ctx.stroke();
    }
    ctx.restore();
  }

  missing() { return this.density ? "" : "No spectrum yet: it needs 8 s of data."; }

  fillPeaks() {
    const { natural, peaks } = this.lines;
    const percent = share => share === null ? NaN : 100 * share;
    const rows = peaks.map(({ frequency, mode, deviation }) =>
      [frequency.toFixed(3), mode === null ? "–" : `${mode}`, mode === null ? NaN : natural[mode - 1], percent(deviation)]);
    const others = natural.map((frequency, i) => [`${t("mode")} ${i + 1}`, frequency]).filter((_, i) => !peaks.some(peak => peak.mode === i + 1));
    const moved = this.lines.moved > 0 ? t("THE BOOM MOVED in these 40 s, a cylinder by {size} mm: the frequencies changed, \"off by\" has no meaning; ", { size: (1000 * this.lines.moved).toFixed(0) }) : "";
    const words = t(natural.length ? "dashed: the model's natural frequencies in this posture" : "the model's frequencies are not known: give --scene");
    this.htmlTable.fill(["peak, Hz", "mode", "model, Hz", "off by, %"].map(head => t(head)), [...rows, ...others.map(([name, value]) => ["", name, value, NaN])], `${t("{source}, last 40 s, segments of 8 s; ", { source: t(this.lines.source) })}${moved}${words}`);
  }
}

// Labels of a logarithmic axis.
const oneDigit = (_, ticks) => ticks.map(tick => tick === null ? null : tick.toExponential(0).replace("+", ""));

// Dashed lines over the plot at natural frequencies (Hz), each with the number of its mode.
function markFrequencies({ ctx, bbox, valToPos }, frequencies) {
  ctx.save();
  ctx.font = `${13 * devicePixelRatio}px system-ui`;
  ctx.fillStyle = ctx.strokeStyle = themeColour("ink");
  ctx.setLineDash([6, 4]);
  frequencies.forEach((frequency, i) => {
    const x = valToPos(frequency, "x", true);
    if (x < bbox.left || x > bbox.left + bbox.width) return;
    ctx.beginPath(); ctx.moveTo(x, bbox.top); ctx.lineTo(x, bbox.top + bbox.height); ctx.stroke();
    ctx.fillText(`${i + 1}`, x + 4, bbox.top + 14 * devicePixelRatio);
  });
  ctx.restore();
}
