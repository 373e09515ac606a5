// Side view of the boom: deflected with a stated exaggeration, undeflected as a ghost, cylinders by force, trace of the tip.

import { lineColour, themeColour } from "./colours.js";
import { formatNumber } from "./html_table.js";
import { t, words as translated } from "./i18n.js";
import { niceStep } from "./path.js";

const TRACE = 5; // s
const FULL = 1e5; // N that has the full colour
const MARGIN = 30; // px
const ARROW = 0.01; // m of the arrow for a newton of load at the tip
const HEAD = 9; // px
const LEAST = 5; // N; no arrow below, nor below two standard deviations

export class Shape {
  constructor(connection, view) {
    this.connection = connection;
    this.view = view;
    this.canvas = document.getElementById("boom");
    for (const button of document.querySelectorAll("#factors button")) button.onclick = () => this.choose(Number(button.dataset.factor));
    this.choose(1);
    connection.addEventListener("reset", () => { this.box = null; });
    connection.addEventListener("state", event => { this.uncertainty = showLoad(event.detail.groups); });
  }

  choose(factor) {
    this.factor = factor;
    this.box = null;
    for (const button of document.querySelectorAll("#factors button")) button.setAttribute("aria-checked", Number(button.dataset.factor) === factor);
    this.view.version++;
  }

  draw() {
    const table = this.connection.table("shape");
    if (!table?.count) return;
    const read = prefix => table.columns.flatMap((name, i) => name.startsWith(prefix) ? [table.values[i][0]] : []);
    const points = values => Array.from({ length: values.length / 2 }, (_, i) => [values[2 * i], values[2 * i + 1]]);
    const straight = points(read("straight_")), bent = points(read("line_"));
    const large = bent.map(([x, z], i) => [straight[i][0] + this.factor * (x - straight[i][0]), straight[i][1] + this.factor * (z - straight[i][1])]);
    const pins = points(read("pins_")), forces = read("force_"), trace = this.trace();
    const frame = this.frame([...straight, ...large, ...pins, ...trace, [straight[0][0], 0]]);
    drawMetres(frame);
    this.drawLine(frame, straight, { colour: themeColour("off"), width: 2, dash: [7, 6] });
    this.drawLine(frame, large, { colour: themeColour("ink"), width: 5 });
    this.drawLine(frame, trace, { colour: lineColour(2), width: 2 });
    forces.forEach((force, i) => this.drawLine(frame, pins.slice(2 * i, 2 * i + 2), { colour: colourOf(force), width: 8, label: `${i + 1}: ${Math.abs(force / 1000).toFixed(1)} kN ${t(force < 0 ? "push" : "pull")}` }));
    this.drawLoad(frame, large.at(-1));
    this.drawn = { boxes: placeLabels(frame), segments: frame.segments };
    this.describe(bent.at(-1), straight.at(-1), bent, forces);
    if (this.canvas.clientHeight !== frame.height) this.view.version++; // the words below took another line
  }

  missing() { return this.connection.table("shape")?.count ? "" : "No shape of the boom yet: it comes with the first prediction."; }

  // The tip's way of the last seconds, exaggerated as the boom is.
  trace() {
    const position = this.connection.table("position"), displacement = this.connection.table("displacement");
    if (!position?.count || position.count !== displacement?.count) return [];
    const step = Math.max(1, Math.floor((position.count - position.from(position.newest - TRACE)) / 250)), found = [];
    for (let row = position.from(position.newest - TRACE); row < position.count; row += step)
      found.push([0, 1].map(c => position.at(c, row) + (this.factor - 1) * displacement.at(c, row)));
    return found;
  }

  // A canvas with metres as units; its frame grows with what is drawn and is kept otherwise.
  frame(points) {
    const { canvas } = this, scale = devicePixelRatio, width = canvas.clientWidth, height = canvas.clientHeight;
    if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) Object.assign(canvas, { width: width * scale, height: height * scale });
    const xs = points.map(p => p[0]), zs = points.map(p => p[1]), old = this.box ?? [Infinity, Infinity, -Infinity, -Infinity];
    this.box = [Math.min(old[0], ...xs), Math.min(old[1], ...zs), Math.max(old[2], ...xs), Math.max(old[3], ...zs)];
    const [left, bottom, right, top] = this.box, unit = Math.min((width - 2 * MARGIN) / (right - left), (height - 2 * MARGIN) / (top - bottom));
    const context = canvas.getContext("2d");
    context.setTransform(scale, 0, 0, scale, 0, 0);
    context.clearRect(0, 0, width, height);
    const across = (width - unit * (right - left)) / 2, down = (height - unit * (top - bottom)) / 2;
    return { context, width, height, unit, segments: [], labels: [], at: ([x, z]) => [across + unit * (x - left), height - down - unit * (z - bottom)], to: ([x, y]) => [left + (x - across) / unit, bottom + (height - down - y) / unit] };
  }

  // The load that the model does not know, as an arrow that ends at the tip.
  drawLoad(frame, tip) {
    const table = this.connection.table("estimate");
    if (!table?.count) return;
    const [x, z] = [8, 9].map(column => table.at(column, table.count - 1)), size = Math.hypot(x, z);
    if (!(size > Math.max(LEAST, 2 * (this.uncertainty || 0)))) return;
    const colour = lineColour(3), tail = [tip[0] - ARROW * x, tip[1] - ARROW * z];
    this.drawLine(frame, [tail, tip], { colour, width: 4, label: `${size.toFixed(0)} N` });
    const { context, at } = frame, [px, py] = at(tip), angle = Math.atan2(-z, x);
    context.beginPath();
    context.moveTo(px, py);
    for (const side of [-0.5, 0.5]) context.lineTo(px - 2 * HEAD * Math.cos(angle + side), py - 2 * HEAD * Math.sin(angle + side));
    context.fillStyle = colour;
    context.fill();
  }

  drawLine({ context, at, segments, labels }, points, { colour, width, dash = [], label }) {
    if (points.length < 2) return;
    context.beginPath();
    points.forEach((point, i) => i ? context.lineTo(...at(point)) : context.moveTo(...at(point)));
    Object.assign(context, { strokeStyle: colour, lineWidth: width, lineJoin: "round", lineCap: "round" });
    context.setLineDash(dash);
    context.stroke();
    const pixels = points.map(at);
    for (let i = 1; i < pixels.length; i++) segments.push([pixels[i - 1], pixels[i]]);
    if (label) labels.push({ label, middle: [0, 1].map(c => (pixels[0][c] + pixels[1][c]) / 2) });
  }

  describe([x, z], [x0, z0], bent, forces) {
    const words = (id, text) => { document.getElementById(id).textContent = text; };
    words("exaggeration", t("displacements drawn x{factor}; dashed: undeflected", { factor: this.factor }));
    words("reach", t("reach {reach} m", { reach: x.toFixed(3) }));
    words("height", t("height {height} m", { height: z.toFixed(3) }));
    words("forces", t("tip {x} mm forward, {z} mm up; most loaded cylinder {force} kN", { x: formatNumber(1000 * (x - x0)), z: formatNumber(1000 * (z - z0)), force: (Math.max(...forces.map(Math.abs)) / 1000).toFixed(1) }));
  }
}

// Metres as thin lines with figures at two sides, and the ground: the height of `base_link`.
function drawMetres({ context, at, to, unit, width, height }) {
  const step = niceStep(70 / unit), [left, top] = to([0, 0]), [right, bottom] = to([width, height]), text = value => formatNumber(Number(value.toFixed(6)));
  Object.assign(context, { strokeStyle: themeColour("grid"), fillStyle: themeColour("soft"), lineWidth: 1, font: "12px system-ui", textAlign: "left" });
  context.setLineDash([]);
  const line = (a, b) => { context.beginPath(); context.moveTo(...a); context.lineTo(...b); context.stroke(); };
  for (let x = Math.ceil(left / step) * step; x < right; x += step) { const [px] = at([x, 0]); line([px, 0], [px, height]); if (px < width - 90) context.fillText(text(x), px + 3, height - 4); }
  for (let z = Math.ceil(bottom / step) * step; z < top; z += step) { const [, py] = at([0, z]); line([0, py], [width, py]); if (py < height - 26) context.fillText(text(z), 3, py - 3); }
  context.fillText(t("up, m"), 3, 12);
  context.textAlign = "right";
  context.fillText(t("forward, m"), width - 4, height - 4);
  context.textAlign = "left";
  const [, ground] = at([0, 0]);
  Object.assign(context, { strokeStyle: themeColour("soft"), lineWidth: 2 });
  line([0, ground], [width, ground]);
  context.lineWidth = 1;
  for (let x = 10; x < width; x += 14) line([x, ground], [x - 7, ground + 7]);
}

// Every label as near to the middle of its line as there is room, over no line and no other label; far ones with a thin pointer.
function placeLabels({ context, segments, labels, width, height }) {
  context.font = "13px system-ui";
  context.setLineDash([]);
  const taken = [];
  for (const { label, middle } of labels) {
    const wide = context.measureText(label).width + 6, box = [...candidates(middle, wide, width, height)]
      .find(each => !segments.some(([a, b]) => crosses(each, a, b)) && !taken.some(other => overlap(each, other)));
    if (!box) continue; // its force is in the table of figures too
    taken.push(box);
    const [left, top, right, bottom] = box, end = [Math.min(Math.max(middle[0], left), right), Math.min(Math.max(middle[1], top), bottom)];
    if (Math.hypot(end[0] - middle[0], end[1] - middle[1]) > POINTER) {
      Object.assign(context, { strokeStyle: themeColour("soft"), lineWidth: 1 });
      context.beginPath(); context.moveTo(...middle); context.lineTo(...end); context.stroke();
    }
    context.fillStyle = themeColour("ink");
    context.fillText(label, left + 3, bottom - 4);
  }
  return taken;
}

const POINTER = 30, HIGH = 18; // px
function* candidates([x, y], wide, width, height) {
  for (let distance = 12; distance < Math.max(width, height); distance += 8)
    for (let turn = 0; turn < 16; turn++) {
      const angle = turn * Math.PI / 8, left = x + distance * Math.cos(angle) - (Math.cos(angle) < 0 ? wide : 0), top = y + distance * Math.sin(angle) - HIGH / 2;
      if (left >= 0 && top >= 0 && left + wide <= width && top + HIGH <= height) yield [left, top, left + wide, top + HIGH];
    }
}

const overlap = (a, b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];

// Whether a box is met by the line from a to b, 5 px thick (Liang and Barsky).
function crosses([left, top, right, bottom], a, b) {
  let from = 0, to = 1;
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]], gap = 5;
  for (const [p, q] of [[-dx, a[0] - left + gap], [dx, right + gap - a[0]], [-dy, a[1] - top + gap], [dy, bottom + gap - a[1]]]) {
    if (p === 0) { if (q < 0) return false; continue; }
    if (p < 0) from = Math.max(from, q / p); else to = Math.min(to, q / p);
  }
  return from <= to;
}

// Grey without force, red when pulled, blue when pushed.
function colourOf(force) {
  if (!Number.isFinite(force)) return themeColour("off");
  const share = Math.min(Math.abs(force) / FULL, 1), end = force > 0 ? [213, 60, 40] : [40, 110, 230];
  return `rgb(${end.map(c => Math.round(150 + share * (c - 150)))})`;
}

// Show what /diagnostics says of the load at the tip; return its standard deviation, N.
function showLoad(groups) {
  const status = groups.flatMap(group => group.lamps).find(({ name, level }) => name === "tip load" && level === "OK");
  document.getElementById("load").textContent = status ? translated(status.reason) : "";
  return status?.figures.rms_sigma_N;
}
