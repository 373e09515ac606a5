// Two figures of now: how far the tip swings against its limit, and the pump's rate.

import { t } from "./i18n.js";

export class Now {
  constructor(connection) {
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
    fill("pump-now", rate ? "OK" : "OFF", rate ? t("pump {rate} Hz ({count}/min)", { rate: rate.toFixed(2), count: (60 * rate).toFixed(0) }) : t("no pump pulses"), "", 0);
  }
}

function fill(id, level, text, detail, share) {
  const element = document.getElementById(id);
  element.dataset.level = level;
  element.querySelector("b").textContent = text;
  element.querySelector("span").textContent = detail;
  element.style.setProperty("--share", `${Math.min(100, 100 * share)}%`);
}
