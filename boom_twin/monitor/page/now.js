// Two figures of now: how far the tip swings against its limit, and the pump's rate against the rates to avoid.

import { t, words } from "./i18n.js";

const MOST = 3; // ranges that there is room for
const NEAR = 0.01; // Hz, beside a range to avoid

export class Now {
  constructor(connection) {
    this.avoid = [];
    this.trouble = "rates to avoid are not known yet";
    connection.addEventListener("rates", event => { Object.assign(this, { avoid: event.detail.avoid, trouble: event.detail.trouble }); this.show(); });
    connection.addEventListener("state", event => { this.lamps = event.detail.groups.flatMap(group => group.lamps); this.show(); });
  }

  figures(name) {
    const lamp = this.lamps?.find(lamp => lamp.name === name);
    return lamp && lamp.level !== "STALE" ? lamp.figures : {};
  }

  show() {
    const { swing_m: swing, swing_m_warn: warn, swing_m_error: limit } = this.figures("swing"), { frequency_Hz: rate } = this.figures("tip load");
    const isKnown = Number.isFinite(swing) && Number.isFinite(limit), millimetres = metres => (1000 * metres).toFixed(0);
    const level = !isKnown ? "OFF" : swing > limit ? "ERROR" : swing > warn ? "WARN" : "OK";
    fill("tip-now", level, isKnown ? t("tip swings {size} mm", { size: millimetres(swing) }) : t("swing of the tip not known"),
      isKnown ? t("limit {size} mm", { size: millimetres(limit) }) : "", isKnown ? swing / limit : 0);
    const away = ([from, to]) => Math.max(from - rate, rate - to, 0); // Hz, of a range from the present rate
    const near = rate ? this.avoid.toSorted((a, b) => away(a) - away(b)).slice(0, MOST).sort((a, b) => a[0] - b[0]) : this.avoid.slice(0, MOST);
    const ranges = near.map(range => [...new Set(range.map(rate => rate.toFixed(2)))].join("–")).join(", ");
    const isBad = this.avoid.some(([from, to]) => rate > from - NEAR && rate < to + NEAR);
    fill("pump-now", !rate ? "OFF" : isBad ? "WARN" : "OK", rate ? t("pump {rate} Hz ({count}/min)", { rate: rate.toFixed(2), count: (60 * rate).toFixed(0) }) : t("no pump pulses"),
      ranges ? t("avoid {ranges} Hz", { ranges }) : words(this.trouble), 0);
  }
}

function fill(id, level, text, detail, share) {
  const element = document.getElementById(id);
  element.dataset.level = level;
  element.querySelector("b").textContent = text;
  element.querySelector("span").textContent = detail;
  element.style.setProperty("--share", `${Math.min(100, 100 * share)}%`);
}
