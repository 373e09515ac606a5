// Power spectral density of the tip's acceleration, the model's natural frequencies, peaks; and the density against time.

import { Chart } from "./chart.js";
import { lineColour, themeColour } from "./colours.js";
import { t } from "./i18n.js";
import { niceStep } from "./path.js";

const LOWEST = 0.25, HIGHEST = 50; // Hz
const COLUMNS = 300; // of the spectrogram
const WIDTH = 2, HEIGHT = 0.125; // s and Hz of one of its cells: COLUMN_STEP and FREQUENCIES of boom_twin/monitor/data/spectrum.py
const RANGE = 60; // dB from dark to bright
const SOURCES = ["measured by the IMU", "estimated from all sensors", "predicted"]; // SIGNALS of boom_twin/monitor/data/analyst.py

export class SpectrumTab {
  constructor(connection, htmlTable) {
    this.htmlTable = htmlTable;
    this.history = [];
    this.lines = { natural: [], peaks: [], source: "", moved: 0 };
    connection.addEventListener("lines", event => this.setLines(event.detail));
    connection.addEventListener("spectrum", event => this.setSpectrum(event.detail));
    connection.addEventListener("spectrogram", event => this.addColumns(event.detail));
    connection.addEventListener("reset", () => { this.history = []; this.isNew = true; });
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

  addColumns({ table: source, times, values, rows, columns }) {
    const decibels = row => Float32Array.from({ length: columns }, (_, c) => 10 * Math.log10(Math.max(values[c * rows + row], 1e-30)));
    this.history = [...this.history, ...Array.from(times, (time, row) => ({ time, source, levels: decibels(row) }))].slice(-COLUMNS);
    this.isNew = true;
  }

  rebuild() { this.chart?.close(); this.chart = null; this.isNew = true; }

  draw(tab) {
    if (!this.isNew) return;
    this.isNew = false;
    if (!this.density) return;
    if (tab === "spectrogram") return this.drawSpectrogram();
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

  missing(tab) { return (tab === "spectrogram" ? this.history.length : this.density) ? "" : "No spectrum yet: it needs 8 s of data."; }

  fillPeaks() {
    const { natural, peaks } = this.lines;
    const percent = share => share === null ? NaN : 100 * share;
    const rows = peaks.map(({ frequency, damping, mode, deviation, drift }) =>
      [frequency.toFixed(3), percent(damping), mode === null ? "–" : `${mode}`, mode === null ? NaN : natural[mode - 1], percent(deviation), percent(drift)]);
    const others = natural.map((frequency, i) => [`${t("mode")} ${i + 1}`, frequency]).filter((_, i) => !peaks.some(peak => peak.mode === i + 1));
    const moved = this.lines.moved > 0 ? t("THE BOOM MOVED within them, a cylinder by {size} mm: the frequencies changed, \"off by\" means nothing; ", { size: (1000 * this.lines.moved).toFixed(0) }) : "";
    const words = t(natural.length ? "dashed: the model's natural frequencies in this posture" : "the model's frequencies are not known: give --scene");
    this.htmlTable.fill(["peak, Hz", "damping, %", "mode", "model, Hz", "off by, %", "drift, %"].map(head => t(head)), [...rows, ...others.map(([name, value]) => ["", NaN, name, value, NaN, NaN])], `${t("{source}, last 40 s, segments of 8 s; ", { source: t(this.lines.source) })}${moved}${words}`);
  }

  // Whose density it is, in the order of time.
  sources() {
    const changes = this.history.filter(({ source }, i) => i === 0 || source !== this.history[i - 1].source);
    return changes.map(({ source, time }, i) => i === 0 ? t(SOURCES[source]) : t("from {time} s {source}", { time: time.toFixed(0), source: t(SOURCES[source]) })).join(", ");
  }

  // One pixel for every cell, drawn large.
  drawSpectrogram() {
    if (!this.history.length) return;
    const canvas = document.getElementById("waterfall"), { clientWidth: width, clientHeight: height } = canvas;
    Object.assign(canvas, { width, height });
    const cells = this.history[0].levels.length, count = this.history.length;
    const picture = new OffscreenCanvas(count, cells), image = new ImageData(count, cells);
    const top = this.history.reduce((most, { levels }) => levels.reduce((a, b) => b > a ? b : a, most), -Infinity);
    this.history.forEach(({ levels }, i) => levels.forEach((level, c) => {
      if (Number.isFinite(level)) image.data.set(viridis(1 + (level - top) / RANGE), 4 * ((cells - 1 - c) * count + i));
    }));
    picture.getContext("2d").putImageData(image, 0, 0);
    const context = canvas.getContext("2d"), left = 44, right = width - 128, bottom = height - 34, highest = (cells - 1) * HEIGHT;
    context.imageSmoothingEnabled = false;
    context.drawImage(picture, left, 0, right - left, bottom);
    context.fillStyle = themeColour("ink");
    context.font = "13px system-ui";
    for (let f = 0; f <= highest; f += 5) context.fillText(`${f}`, 20, Math.max(12, bottom * (1 - f / highest)));
    this.lines.natural.forEach((f, i) => f < highest && context.fillText(`◂ ${t("mode")} ${i + 1}`, right + 2, bottom * (1 - f / highest) + 5));
    const began = this.history[0].time - WIDTH, ended = this.history.at(-1).time, step = niceStep((ended - began) / 8);
    for (let s = Math.ceil(began / step) * step; s <= ended; s += step) context.fillText(`${Number(s.toFixed(3))}`, left + (right - left) * (s - began) / (ended - began) - 8, bottom + 15);
    context.fillText(t("time, s"), (left + right) / 2 - 20, height - 4);
    context.save();
    context.rotate(-Math.PI / 2);
    context.fillText(t("frequency, Hz"), -bottom / 2 - 40, 13);
    context.restore();
    const ramp = context.createLinearGradient(0, bottom, 0, 20);
    for (let i = 0; i <= 8; i++) ramp.addColorStop(i / 8, `rgb(${viridis(i / 8).slice(0, 3)})`);
    context.fillStyle = ramp;
    context.fillRect(width - 48, 20, 12, bottom - 20);
    context.fillStyle = themeColour("ink");
    for (const part of [0, 0.5, 1]) context.fillText((top - RANGE * (1 - part)).toFixed(0), width - 32, bottom - part * (bottom - 20) + (part === 1 ? 10 : 0));
    context.fillText("dB", width - 48, 13);
    document.getElementById("waterfall-words").textContent = t("density of the tip's acceleration, {source}, both directions; bright: {top} dB of 1 (m/s²)²/Hz, dark: {range} dB below", { source: this.sources(), top: top.toFixed(0), range: RANGE });
  }
}

// Labels of a logarithmic axis.
export const oneDigit = (_, ticks) => ticks.map(tick => tick === null ? null : tick.toExponential(0).replace("+", ""));

// Dashed lines over the plot at natural frequencies (Hz), each with the number of its mode.
export function markFrequencies({ ctx, bbox, valToPos }, frequencies) {
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

// Viridis in five steps; grows lighter all the way, so it reads without colour.
const STEPS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
function viridis(share) {
  const x = Math.min(Math.max(share, 0), 1) * (STEPS.length - 1), i = Math.min(Math.floor(x), STEPS.length - 2), t = x - i;
  return [0, 1, 2].map(c => STEPS[i][c] * (1 - t) + STEPS[i + 1][c] * t).concat(255);
}
