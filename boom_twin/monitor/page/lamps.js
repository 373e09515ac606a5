// The first glance: how everything is, and each group; then every lamp and alarm in tables.

import { escapeHtml, fixed, formatNumber } from "./html_table.js";

export const SIGNS = { OK: "✔", WARN: "▲", ERROR: "✖", STALE: "◌", OFF: "–" };
const OVERALL = { OK: "ALL WELL", WARN: "WARNING", ERROR: "FAULT", STALE: "STALE" };
const LOSSES = 3; // topics whose dropped messages are told one by one
const SILENCE = 2000; // ms without a word from the monitor after which nothing here is known

export class Lamps {
  constructor(connection) {
    this.connection = connection;
    this.overall = document.getElementById("overall");
    this.groups = document.getElementById("groups");
    this.notice = document.getElementById("notice");
    this.dropped = document.getElementById("dropped");
    connection.addEventListener("state", event => { this.state = event.detail; this.show(event.detail); });
    connection.addEventListener("alarms", event => this.showAlarms(event.detail.alarms));
  }

  // What the page itself knows: called often.
  watch(isReplay) {
    const now = performance.now(), silence = now - this.connection.lastMessage;
    let words = "";
    if (silence > SILENCE) words = Number.isFinite(silence) ? `NO CONNECTION to the monitor for ${Math.round(silence / 1000)} s: nothing here is current` : "NO CONNECTION to the monitor";
    else if (!isReplay && now - this.connection.lastRows > SILENCE) words = Number.isFinite(this.connection.lastRows) ? `NO DATA for ${Math.round((now - this.connection.lastRows) / 1000)} s: the traces are old` : "NO DATA yet: is the node active, and do strokes come?";
    else if (this.state?.trouble) words = this.state.trouble;
    if (this.notice.textContent !== words) this.notice.textContent = words;
    this.notice.hidden = !words;
    document.querySelector("main").classList.toggle("old", Boolean(words) && words !== this.state?.trouble);
    if (silence > SILENCE && this.isShown !== "lost") { this.isShown = "lost"; this.showLost(); }
  }

  showLost() {
    setLamp(this.overall, "STALE", "STALE", "no connection to the monitor");
    for (const lamp of this.groups.children) setLamp(lamp, "STALE", "STALE", "not known");
  }

  show(state) {
    this.isShown = "state";
    setLamp(this.overall, state.level, OVERALL[state.level], state.reason);
    for (const group of state.groups) {
      let lamp = document.getElementById(`group-${group.name}`);
      if (!lamp) {
        lamp = document.createElement("div");
        lamp.id = `group-${group.name}`;
        lamp.className = "lamp";
        lamp.innerHTML = '<span class="name"></span><span class="sign"></span><b class="word"></b><span class="reason"></span><span class="detail"></span>';
        lamp.querySelector(".name").textContent = group.name;
        this.groups.append(lamp);
      }
      setLamp(lamp, group.level, group.level, group.reason, detail(worst(group)));
    }
    this.showDropped(state.dropped);
    this.fillTable(state);
  }

  // Messages that could not be used: how many, of which topic, why the last one.
  showDropped(dropped) {
    this.dropped.hidden = !dropped.length;
    const lines = dropped.slice(0, LOSSES).map(({ topic, count, reason }) => `<span>${escapeHtml(topic)}: ${count}, the last because: ${escapeHtml(reason)}</span>`);
    const more = dropped.length > LOSSES ? `<span>topics not listed here: ${dropped.length - LOSSES}</span>` : "";
    const words = dropped.length ? `<b>▲ ${dropped.reduce((sum, { count }) => sum + count, 0)} messages dropped</b>${lines.join("")}${more}` : "";
    if (this.words !== words) this.dropped.innerHTML = this.words = words;
  }

  fillTable(state) {
    const table = document.getElementById("lamps");
    if (!table.offsetParent) return;
    table.innerHTML = "<tr><th>group<th class=text>of<th class=text>state<th class=text>reason<th class=text>judged<th>value<th>limit<th>for, s</tr>" +
      state.groups.flatMap(group => group.lamps.map(lamp => `<tr><td>${group.name}<td class=text>${escapeHtml(lamp.name)}<td class=text data-level=${lamp.level}>${SIGNS[lamp.level]} ${lamp.level}` +
        `<td class=text>${escapeHtml(lamp.reason)}<td class=text>${escapeHtml(lamp.quantity)}<td>${formatNumber(lamp.value ?? NaN)}<td>${formatNumber(lamp.limit ?? NaN)}<td>${formatNumber(lamp.age === null ? NaN : Math.round(lamp.age))}</tr>`)).join("");
  }

  showAlarms(alarms) {
    const table = document.getElementById("alarms");
    table.innerHTML = `<caption>alarms: ${alarms.length || "none"}</caption>` + (alarms.length ? "<tr><th>of<th class=text>level<th class=text>reason<th class=text>cause<th>from, s<th>to, s<th></tr>" : "") +
      alarms.slice(-50).reverse().map(alarm => `<tr><td>${escapeHtml(alarm.name)}<td class=text data-level=${alarm.level}>${SIGNS[alarm.level]} ${alarm.level}<td class=text>${escapeHtml(alarm.reason)}` +
        `<td class=text>${alarm.causes.map(([cause, share]) => escapeHtml(cause) + (share === null ? "" : ` ${(100 * share).toFixed(0)} %`)).join(", ")}<td>${fixed(alarm.begin, 2)}<td>${alarm.end === null ? "lasts" : fixed(alarm.end, 2)}<td>${alarm.is_acknowledged ? "acknowledged" : `<button data-number=${alarm.number}>Acknowledge</button>`}</tr>`).join("");
  }
}

export const RANKS = ["OFF", "OK", "WARN", "STALE", "ERROR"];
const worst = group => group.lamps.reduce((found, lamp) => !found || RANKS.indexOf(lamp.level) > RANKS.indexOf(found.level) ? lamp : found, null);

function detail(lamp) {
  if (!lamp) return "";
  const judged = lamp.quantity && lamp.value !== null ? `${lamp.quantity.replaceAll("_", " ")} ${formatNumber(lamp.value)}, limit ${formatNumber(lamp.limit ?? NaN)}` : "";
  return [judged, lamp.age === null ? "" : `for ${span(lamp.age)}`].filter(Boolean).join(", ");
}

const span = seconds => seconds < 120 ? `${Math.round(seconds)} s` : seconds < 7200 ? `${Math.round(seconds / 60)} min` : `${Math.round(seconds / 3600)} h`;

function setLamp(lamp, level, word, reason, detail = "") {
  lamp.dataset.level = level;
  for (const [name, text] of Object.entries({ sign: SIGNS[level], word, reason, detail })) {
    const place = lamp.querySelector(`.${name}`);
    if (place && place.textContent !== text) place.textContent = text;
  }
}
