// What the tip does and how far it is from what was measured, against time.

import { Chart } from "./chart.js";
import { themeColour } from "./colours.js";
import { t } from "./i18n.js";
import { RANKS } from "./lamps.js";
import uPlot from "/page/uplot.js";
import { decimate, statistics } from "./decimation.js";

const POWERS = Array.from({ length: 40 }, (_, i) => 2 ** (i - 3));  // of the ticks of normalised residuals, which are shown from -4 to 4 at least
const BAND = 2; // deviations that are shaded
const SLOT = 2; // px from lowest to highest of which one line is drawn
const BAR = 4; // px, of an alarm's mark
const PERIOD = 500; // ms between two looks at the figures
const NAMES = { x: "forward", z: "up" };

const range = (from, to) => Array.from({ length: to - from }, (_, i) => from + i);
// Of a table of residuals: the columns of residuals over their deviation, which are the second half, and the channels' names.
const normalised = table => range(table.columns.length / 2, table.columns.length);
const channels = table => normalised(table).map(column => table.columns[column].replace("_normalised", ""));

// Every chart: table, columns (a function of the table), their labels, a factor of the unit. Further streams of residuals follow.
const residualChart = (name, table, title) => ({ name, table, title, unit: "σ", factor: 1, columns: normalised, labels: channels, isResidual: true });
const CHARTS = [
  { name: "displacement", table: "displacement", title: "displacement", unit: "mm", factor: 1000, columns: () => [0, 1], isUncertain: true, estimate: [0, 1, 2, 3] },
  { name: "acceleration", table: "acceleration", title: "acceleration", unit: "m/s²", factor: 1, columns: () => [0, 1], labels: ["predicted →", "predicted ↑"], estimate: [4, 5, 6, 7] },
  { name: "force", table: "force", title: "IMU", unit: "m/s²", factor: 1, columns: () => [1, 3, 5, 0, 2, 4], isBanded: true },
  residualChart("residuals", "joints", "residual"),
];

// Every quantity of the table of statistics: table, number of columns, their names, factor and unit. Those of residuals follow.
const QUANTITIES = [
  { table: "displacement", count: 2, label: column => `${t("displ.")} ${t(NAMES[column[0]])}`, factor: 1000, unit: "mm" },
  { table: "acceleration", count: 2, label: column => `${t("accel.")} ${t(NAMES[column[0]])}`, factor: 1, unit: "m/s²" },
  { table: "force", count: 4, label: column => `IMU ${column.replace("_m_s2", "").replace("_", " ")}`, factor: 1, unit: "m/s²" },
];
const residualQuantity = table => ({ table: table.name, count: table.columns.length / 2, label: (_, i) => `${t("resid.")} ${channels(table)[i]}`, ...table.residuals });

export class Traces {
  constructor(connection, view, htmlTable) {
    this.connection = connection;
    this.view = view;
    this.htmlTable = htmlTable;
    this.charts = new Map();
    this.alarms = [];
    connection.addEventListener("alarms", event => { this.alarms = event.detail.alarms; view.version++; });
    setInterval(() => this.fillStatistics(), PERIOD);
    this.kinds = [];
    this.add(CHARTS);
  }

  // Make room for further charts below the others.
  add(kinds) {
    for (const { name } of kinds) {
      const element = document.createElement("div");
      element.className = "chart";
      element.id = `chart-${name}`;
      document.getElementById("charts").append(element);
    }
    this.kinds = [...this.kinds, ...kinds];
  }

  rebuild() {
    for (const chart of this.charts.values()) chart.close();
    this.charts.clear();
  }

  draw() {
    const [from, to] = this.view.span;
    if (!Number.isFinite(to)) return;
    const further = this.connection.residualTables.filter(({ name }) => !this.kinds.some(kind => kind.table === name));
    if (further.length) this.add(further.map(({ name, residuals }) => residualChart(`residuals-${name}`, name, residuals.title)));
    const hasEstimate = Boolean(this.estimate?.count);
    if (this.hasEstimate !== hasEstimate) { this.hasEstimate = hasEstimate; this.rebuild(); }
    const filled = this.kinds.filter(kind => this.connection.table(kind.table)?.count);
    if (filled.at(-1) !== this.lowest) { this.lowest = filled.at(-1); this.rebuild(); } // it has the axis of time
    for (const kind of filled) {
      const table = this.connection.table(kind.table);
      if (!this.charts.has(kind.name)) this.charts.set(kind.name, this.build(kind, table));
      const chart = this.charts.get(kind.name);
      const slots = Math.max(200, chart.element.clientWidth / SLOT), [times, ...values] = scaled(decimate(table, kind.columns(table), from, to, slots), kind.factor);
      const data = [times, ...(kind.isBanded ? banded(values) : kind.isUncertain ? this.uncertain(times, values, kind.factor) : values)];
      chart.draw(kind.estimate && this.hasEstimate ? uPlot.join([data, this.estimated(kind, from, to, slots)]) : data, from, to);
    }
  }

  missing() { return this.connection.table("displacement")?.count ? "" : "Nothing is predicted yet: cylinder lengths are needed."; }

  get estimate() { return this.connection.table("estimate"); }

  // What all sensors together say of the tip: two lines, and the ends of their bands.
  estimated({ estimate, factor }, from, to, slots) {
    const [times, x, z, sigmaX, sigmaZ] = scaled(decimate(this.estimate, estimate, from, to, slots), factor);
    const offset = (values, sigmas, sign) => values.map((value, i) => value === null || sigmas[i] === null ? null : value + sign * BAND * sigmas[i]);
    return [times, x, z, offset(x, sigmaX, 1), offset(x, sigmaX, -1), offset(z, sigmaZ, 1), offset(z, sigmaZ, -1)];
  }

  // The tip's lines, and beside each what it may be off by: as told last before each time.
  uncertain(times, values, factor) {
    const table = this.connection.table("uncertainty");
    let row = table?.count ? Math.max(table.first, table.from(times[0]) - 1) : NaN;
    const at = times.map(time => { while (row + 1 < table?.count && table.time(row + 1) <= time) row++; return row; });
    const offset = (column, sign) => values[column].map((value, i) => value === null || !(table?.time(at[i]) <= times[i]) ? null : value + sign * factor * BAND * table.at(column, at[i]));
    return [...values, ...[0, 1].flatMap(column => [offset(column, 1), offset(column, -1)])];
  }

  build(kind, table) {
    const labels = typeof kind.labels === "function" ? kind.labels(table) : kind.labels;
    const plain = () => labels.map((label, i) => ({ label: t(label), colour: i }));
    const plainOptions = kind.isBanded ? BANDED : kind.isUncertain ? UNCERTAIN : { series: plain() };
    const options = kind.estimate && this.hasEstimate ? withEstimate(plainOptions) : plainOptions;
    return new Chart(document.getElementById(`chart-${kind.name}`), {
      title: `${t(kind.title)}, ${kind.unit}`,
      axes: [kind === this.lowest ? { size: 28, label: t("time, s"), labelSize: 15 } : { values: (_, ticks) => ticks.map(() => ""), size: 6 }, { label: kind.unit, ...(kind.isResidual ? { space: 14, incrs: POWERS } : { space: 20 }) }],
      ...options,
      scales: kind.isResidual ? { y: { range: (_, low, high) => [Math.min(low, -4), Math.max(high, 4)] } } : {},
      cursor: { sync: { key: "time" }, drag: { x: true, y: false, setScale: false } },
      hooks: {
        setSelect: [plot => {
          const { left, width } = plot.select;
          if (width > 5) this.view.set({ zoom: [plot.posToVal(left, "x"), plot.posToVal(left + width, "x")] });
          plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
        }],
        draw: [plot => this.markAlarms(plot), ...(kind.isResidual ? [shadeExpected] : [])],
      },
    });
  }

  // The alarms of a span of time, the worst last.
  alarmsBetween(from, to) {
    return this.alarms.filter(({ begin, end }) => begin <= to && (end ?? Infinity) >= from).sort((a, b) => RANKS.indexOf(a.level) - RANKS.indexOf(b.level) || a.causes.length - b.causes.length);
  }

  // A bar at the top of the chart as long as an alarm lasts, the worst over the others.
  markAlarms({ ctx, bbox, scales, valToPos }) {
    const right = bbox.left + bbox.width, at = time => Math.min(Math.max(valToPos(time, "x", true), bbox.left), right);
    ctx.save();
    for (const { level, begin, end } of this.alarmsBetween(scales.x.min, scales.x.max)) {
      ctx.fillStyle = themeColour(level === "OK" ? "accent" : level.toLowerCase());
      ctx.fillRect(at(begin), bbox.top, Math.max((end === null ? right : at(end)) - at(begin), 2 * devicePixelRatio), BAR * devicePixelRatio);
    }
    ctx.restore();
  }

  // The table of statistics of what is shown.
  fillStatistics() {
    const [from, to] = this.view.span, span = `${from} ${to} ${this.connection.lastRows} ${this.view.version}`;
    if (span === this.span || !Number.isFinite(to) || !this.htmlTable.element.offsetParent) return;
    this.span = span;
    const rows = [];
    for (const { table: name, count, label, factor, unit } of [...QUANTITIES, ...this.connection.residualTables.map(residualQuantity)]) {
      const table = this.connection.table(name);
      if (!table?.count) continue;
      for (let column = 0; column < count; column++) {
        const found = statistics(table, column, from, to);
        rows.push([`${label(table.columns[column], column)}, ${unit}`, ...["mean", "rms", "peak", "range"].map(key => found[key] * factor), found.crest]);
      }
    }
    this.htmlTable.fill(["", "mean", "rms", "peak", "p-p", "crest"].map(head => head && t(head)), rows, t("of the {span} s shown; rms and peak about the mean", { span: (to - from).toFixed(1) }));
  }
}

const BANDED = {
  series: [
    { label: t("measured z"), colour: "soft", width: 1 }, { label: t("predicted z"), colour: 0, width: 1 },
    { label: "+2σ", colour: 0, width: 0, class: "quiet" }, { label: "−2σ", colour: 0, width: 0, class: "quiet" },
    { label: t("measured x"), colour: "soft", width: 1, show: false }, { label: t("predicted x"), colour: 1, width: 1, show: false },
  ],
  bands: [[3, 4, 0]],
};

const UNCERTAIN = {
  series: [{ label: t("predicted →"), colour: 0 }, { label: t("predicted ↑"), colour: 1 }, ...[0, 0, 1, 1].map((colour, i) => ({ label: i % 2 ? "−2σ" : "+2σ", colour, width: 0, class: "quiet" }))],
  bands: [[3, 4, 0], [5, 6, 1]],
};

// The same chart with the lines of the estimate and their bands; the prediction lies under them, broad and faint.
function withEstimate({ series, bands = [] }) {
  const first = series.length + 1, lines = ["estimated →", "estimated ↑"].map((label, i) => ({ label: t(label), colour: i }));
  const edges = [0, 0, 1, 1].map((colour, i) => ({ label: i % 2 ? "−2σ" : "+2σ", colour, width: 0, class: "quiet" }));
  return { series: [...series.map(each => ({ ...each, isFaint: true, width: each.width ?? 4 })), ...lines, ...edges], bands: [...bands, [first + 2, first + 3, 0], [first + 4, first + 5, 1]] };
}

// Times, and all values in the unit that is shown.
const scaled = ([times, ...values], factor) => [times, ...(factor === 1 ? values : values.map(each => each.map(v => v === null ? null : v * factor)))];

// From measured, predicted, deviation of z, then of x, to what is drawn.
function banded([measuredZ, predictedZ, sigmaZ, measuredX, predictedX]) {
  const offset = sign => predictedZ.map((value, i) => value === null || sigmaZ[i] === null ? null : value + sign * BAND * sigmaZ[i]);
  return [measuredZ, predictedZ, offset(1), offset(-1), measuredX, predictedX];
}

// Residuals over their deviation are mostly within 2.
function shadeExpected(plot) {
  const { ctx, bbox } = plot, top = plot.valToPos(BAND, "y", true), bottom = plot.valToPos(-BAND, "y", true);
  ctx.save();
  ctx.globalAlpha = 0.12;
  ctx.fillStyle = "#808890";
  ctx.fillRect(bbox.left, top, bbox.width, bottom - top);
  ctx.restore();
}
