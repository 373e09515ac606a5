// The way of the tip in the plane of the boom over the span that is shown: predicted, and estimated from all sensors.

import { lineColour, themeColour } from "./colours.js";
import { formatNumber } from "./html_table.js";
import { t } from "./i18n.js";

const POINTS = 2000; // of a line, at most
const LEFT = 64, BELOW = 40, MARGIN = 16; // px around the plot
const TICKS = 6; // about so many on an axis
const LEAST = 0.02; // m that are shown at least

export class Path {
  constructor(connection, view) {
    this.connection = connection;
    this.view = view;
    this.canvas = document.getElementById("way");
  }

  draw() {
    const [from, to] = this.view.span, lines = [this.predicted(from, to), this.estimated(from, to)];
    const points = lines.flat();
    if (!points.length) return;
    const frame = this.frame(points);
    this.drawAxes(frame);
    lines.forEach((line, i) => this.drawLine(frame, line, lineColour(i ? 2 : 0)));
    const last = lines.map(line => line.at(-1)), [x, z] = last[0] ?? last[1];
    document.getElementById("way-words").textContent = t(lines[1].length ? "tip, {span} s: predicted, and estimated from all sensors (dashed); now {x} m forward, {z} m up" : "tip, {span} s: predicted; now {x} m forward, {z} m up", { span: (to - from).toFixed(0), x: x.toFixed(3), z: z.toFixed(3) });
    if (this.canvas.clientHeight !== frame.height) this.view.version++;
  }

  missing() { return this.connection.table("position")?.count ? "" : "No position of the tip yet: it comes with the first prediction."; }

  rows(table, from, to) {
    const first = table.from(from), end = table.from(to + 1e-9), step = Math.max(1, Math.ceil((end - first) / POINTS));
    return Array.from({ length: Math.max(0, Math.ceil((end - first) / step)) }, (_, i) => first + i * step);
  }

  predicted(from, to) {
    const table = this.connection.table("position");
    return table?.count ? finite(this.rows(table, from, to).map(row => [table.at(0, row), table.at(1, row)])) : [];
  }

  // Where the undeflected tip is, and the estimated displacement.
  estimated(from, to) {
    const [position, displacement, estimate] = ["position", "displacement", "estimate"].map(name => this.connection.table(name));
    if (!estimate?.count || !position?.count || position.count !== displacement?.count) return [];
    return finite(this.rows(estimate, from, to).map(row => {
      const there = Math.min(position.from(estimate.time(row)), position.count - 1);
      return [0, 1].map(c => position.at(c, there) - displacement.at(c, there) + estimate.at(c, row));
    }));
  }

  // Metres alike on both axes, all points inside.
  frame(points) {
    const { canvas } = this, scale = devicePixelRatio, width = canvas.clientWidth, height = canvas.clientHeight;
    Object.assign(canvas, { width: width * scale, height: height * scale });
    const context = canvas.getContext("2d"), [xs, zs] = [0, 1].map(c => points.map(p => p[c]));
    const bounds = [xs, zs].map(values => values.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [Infinity, -Infinity]));
    context.setTransform(scale, 0, 0, scale, 0, 0);
    const wide = width - LEFT - MARGIN, high = height - BELOW - MARGIN, spans = bounds.map(([low, up]) => Math.max(LEAST, 1.1 * (up - low)));
    const unit = Math.min(wide / spans[0], high / spans[1]), [middleX, middleZ] = bounds.map(([low, up]) => (low + up) / 2);
    const at = ([x, z]) => [LEFT + wide / 2 + unit * (x - middleX), MARGIN + high / 2 - unit * (z - middleZ)];
    return { context, at, unit, width, height, low: [middleX - wide / 2 / unit, middleZ - high / 2 / unit], span: [wide / unit, high / unit] };
  }

  drawAxes({ context, at, width, height, low, span }) {
    Object.assign(context, { strokeStyle: themeColour("grid"), fillStyle: themeColour("soft"), lineWidth: 1, font: "12px system-ui" });
    for (const c of [0, 1]) {
      const step = niceStep(span[c] / TICKS);
      for (let value = Math.ceil(low[c] / step) * step; value <= low[c] + span[c]; value += step) {
        const [x, y] = at(c ? [low[0], value] : [value, low[1]]);
        context.beginPath();
        if (c) { context.moveTo(LEFT, y); context.lineTo(width - MARGIN, y); } else { context.moveTo(x, MARGIN); context.lineTo(x, height - BELOW); }
        context.stroke();
        context.textAlign = c ? "right" : "center";
        context.fillText(formatNumber(Number(value.toFixed(6))), c ? LEFT - 6 : x, c ? y + 4 : height - BELOW + 16);
      }
    }
    context.textAlign = "center";
    context.fillText(t("forward, m"), width / 2, height - 8);
    context.textAlign = "left";
    context.fillText(t("up, m"), 6, 12);
  }

  drawLine({ context, at }, points, colour) {
    if (!points.length) return;
    Object.assign(context, { strokeStyle: colour, fillStyle: colour, lineWidth: 2, lineJoin: "round" });
    context.setLineDash(colour === lineColour(2) ? [6, 4] : []);
    context.beginPath();
    points.forEach((point, i) => i ? context.lineTo(...at(point)) : context.moveTo(...at(point)));
    context.stroke();
    context.setLineDash([]);
    context.beginPath();
    context.arc(...at(points.at(-1)), 5, 0, 7);
    context.fill();
  }
}

const finite = points => points.filter(point => point.every(Number.isFinite));

// 1, 2 or 5 times a power of ten, at least so much.
export function niceStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return power * [1, 2, 5, 10].find(factor => factor * power >= least);
}
