// Power spectral density of the tip's acceleration, the model's natural frequencies, peaks; and the density against time.

import { Chart } from "./chart.js";
import { line, paint } from "./colours.js";

const LOWEST = 0.25, HIGHEST = 50; // Hz
const COLUMNS = 300, FEWEST = 60; // of the spectrogram
const SPAN = 20; // Hz, of the spectrogram
const RANGE = 60; // dB from dark to bright

export class SpectrumTab {
  constructor(link, sheet) {
    this.sheet = sheet;
    this.past = [];
    this.firsts = new Map();
    this.lines = { natural: [], peaks: [] };
    link.addEventListener("lines", event => { this.lines = event.detail; this.isNew = true; });
    link.addEventListener("density", event => this.take(event.detail));
    link.addEventListener("reset", () => { this.past = []; this.firsts.clear(); this.isNew = true; });
  }

  take({ times: frequencies, values, rows }) {
    this.density = [Array.from(frequencies).slice(1), ...[0, 1].map(c => Array.from(values.slice(c * rows + 1, (c + 1) * rows)))];
    if (this.past.at(-1)?.time !== this.lines.time) {
      const sum = this.density[1].map((value, i) => 10 * Math.log10(Math.max(value + this.density[2][i], 1e-30)));
      this.past = [...this.past.slice(-COLUMNS + 1), { time: this.lines.time, step: frequencies[1], sum, natural: this.lines.natural }];
    }
    this.isNew = true;
  }

  rebuild() { this.chart?.close(); this.chart = null; this.isNew = true; }

  draw(tab) {
    if (!this.isNew || !this.density) return;
    this.isNew = false;
    if (tab === "spectrogram") return this.drawPast();
    this.chart ??= new Chart(document.getElementById("density"), {
      title: "density, (m/s²)²/Hz",
      series: [{ label: "forward", colour: 0 }, { label: "up", colour: 1 }],
      scales: { x: { time: false, auto: false, distr: 3 }, y: { distr: 3 } },
      axes: [{ label: "frequency, Hz", labelSize: 18, size: 44 }, { size: 72, values: (_, ticks) => ticks.map(tick => tick === null ? null : `1e${Math.round(Math.log10(tick))}`) }],
      hooks: { draw: [plot => this.drawLines(plot)] },
    });
    this.chart.draw(this.density, LOWEST, Math.min(HIGHEST, this.density[0].at(-1)));
    this.tell();
  }

  drawLines(plot) {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.font = `${13 * devicePixelRatio}px system-ui`;
    ctx.fillStyle = ctx.strokeStyle = paint("ink");
    ctx.setLineDash([6, 4]);
    this.lines.natural.forEach((frequency, i) => {
      const x = plot.valToPos(frequency, "x", true);
      if (x < bbox.left || x > bbox.left + bbox.width) return;
      ctx.beginPath(); ctx.moveTo(x, bbox.top); ctx.lineTo(x, bbox.top + bbox.height); ctx.stroke();
      ctx.fillText(`${i + 1}`, x + 4, bbox.top + 14 * devicePixelRatio);
    });
    ctx.setLineDash([]);
    ctx.strokeStyle = line(2);
    ctx.lineWidth = 2;
    for (const peak of this.lines.peaks) {
      ctx.beginPath(); ctx.arc(plot.valToPos(peak.frequency, "x", true), plot.valToPos(peak.density, "y", true), 7 * devicePixelRatio, 0, 7); ctx.stroke();
    }
    ctx.restore();
  }

  // Drift: against the first time that this peak was seen, told by the mode it is near, or by its place.
  tell() {
    const { natural, peaks } = this.lines;
    const rows = peaks.map(peak => {
      const key = peak.mode ?? Math.round(4 * Math.log2(peak.frequency)) / 4;
      if (!this.firsts.has(key)) this.firsts.set(key, peak.frequency);
      const model = peak.mode === null ? NaN : natural[peak.mode - 1];
      return [peak.frequency.toFixed(3), peak.damping === null ? NaN : 100 * peak.damping, peak.mode === null ? "–" : `${peak.mode}`, model, 100 * (peak.frequency / model - 1), 100 * (peak.frequency / this.firsts.get(key) - 1)];
    });
    const others = natural.map((frequency, i) => [`mode ${i + 1}`, frequency]).filter((_, i) => !peaks.some(peak => peak.mode === i + 1));
    const words = natural.length ? "dashed: the model's natural frequencies in this posture" : "the model's frequencies are not known: give --scene";
    this.sheet.fill(["peak, Hz", "damping, %", "mode", "model, Hz", "off by, %", "drift, %"], [...rows, ...others.map(([name, value]) => ["", NaN, name, value, NaN, NaN])], `last 40 s, segments of 8 s; ${words}`);
  }

  drawPast() {
    const canvas = document.getElementById("waterfall"), { clientWidth: width, clientHeight: height } = canvas;
    canvas.width = width; canvas.height = height;
    const context = canvas.getContext("2d"), left = 44, count = Math.max(FEWEST, this.past.length), image = context.createImageData(count, height - 24);
    const top = Math.max(...this.past.flatMap(({ sum, step }) => sum.slice(0, Math.ceil(SPAN / step))));
    this.past.forEach(({ sum, step }, i) => {
      for (let y = 0; y < image.height; y++) {
        const place = Math.round(SPAN * (1 - y / image.height) / step) - 1;
        image.data.set(heat(1 + (sum[Math.max(0, place)] - top) / RANGE), 4 * (y * count + i + count - this.past.length));
      }
    });
    const picture = new OffscreenCanvas(count, image.height);
    picture.getContext("2d").putImageData(image, 0, 0);
    context.imageSmoothingEnabled = false;
    context.drawImage(picture, left, 0, width - left - 60, image.height);
    context.fillStyle = paint("ink");
    context.font = "13px system-ui";
    for (let f = 0; f <= SPAN; f += 5) context.fillText(`${f} Hz`, 2, Math.max(12, image.height * (1 - f / SPAN)));
    this.past.at(-1).natural.forEach((f, i) => f < SPAN && context.fillText(`◂ mode ${i + 1}`, width - 58, image.height * (1 - f / SPAN) + 5));
    context.fillText(`${this.past[0].time.toFixed(0)} s`, left + (width - left - 60) * (1 - this.past.length / count), height - 6);
    context.fillText(`${this.past.at(-1).time.toFixed(0)} s`, width - 90, height - 6);
    document.getElementById("waterfall-words").textContent = `density of the tip's acceleration, both directions; bright: ${top.toFixed(0)} dB of 1 (m/s²)²/Hz, dark: ${RANGE} dB below`;
  }
}

// Viridis in five steps; grows lighter all the way, so it reads without colour.
const STEPS = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
function heat(share) {
  const x = Math.min(Math.max(share, 0), 1) * (STEPS.length - 1), i = Math.min(Math.floor(x), STEPS.length - 2), t = x - i;
  return [0, 1, 2].map(c => STEPS[i][c] * (1 - t) + STEPS[i + 1][c] * t).concat(255);
}
