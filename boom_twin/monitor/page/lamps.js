// The first glance: what to do and why, and each group; then all alarms and lamps in tables.

import { escapeHtml, fixed, formatNumber } from "./html_table.js";
import { language, t, words } from "./i18n.js";

export const SIGNS = { OK: "✔", WARN: "▲", ERROR: "✖", STALE: "◌", OFF: "–" };
const ACTIONS = { go: "GO ON", look: "LOOK", stop: "STOP", unknown: "NOT KNOWN" };
const LOSSES = 3; // topics whose dropped messages are told one by one
const MOST = 100; // alarms acknowledged at once
const SILENCE = 2000; // ms without a word from the monitor after which nothing here is known

export const alarmWords = alarm => alarm.words[language] ?? words(alarm.reason);

export class Lamps {
  constructor(connection) {
    this.connection = connection;
    this.alarms = [];
    for (const name of ["overall", "groups", "notice", "dropped", "acknowledge"]) this[name] = document.getElementById(name);
    connection.addEventListener("hello", event => { this.isReplay = event.detail.end !== null; this.mayAcknowledge = event.detail.permitted.includes("acknowledge"); });
    connection.addEventListener("state", event => { this.state = event.detail; this.show(event.detail); });
    connection.addEventListener("alarms", event => { this.alarms = event.detail.alarms; this.showAlarms(); if (this.state) this.show(this.state); });
    this.acknowledge.onclick = () => connection.send({ do: "acknowledge", numbers: this.unacknowledged.map(({ number }) => number) });
  }

  get unacknowledged() {
    return this.alarms.filter(({ level, is_acknowledged: isDone, begin }) => !isDone && level !== "OK" && begin <= this.state.time).slice(-MOST);
  }

  // What the page itself knows: called often.
  watch(isReplay) {
    const now = performance.now(), silence = now - this.connection.lastMessage, isSilent = silence > SILENCE;
    let told = "";
    if (isSilent) told = Number.isFinite(silence) ? t("NO CONNECTION to the monitor for {time} s: nothing here is current", { time: Math.round(silence / 1000) }) : t("NO CONNECTION to the monitor");
    else if (this.state?.phase) told = words(this.state.phase);
    else if (!isReplay && now - this.connection.lastRows > SILENCE) told = Number.isFinite(this.connection.lastRows) ? t("NO DATA for {time} s: the traces are old", { time: Math.round((now - this.connection.lastRows) / 1000) }) : t("NO DATA yet: is the node active, and do cylinder lengths come?");
    else if (this.state?.trouble) told = this.state.trouble;
    if (this.notice.textContent !== told) this.notice.textContent = told;
    this.notice.hidden = !told;
    document.querySelector("main").classList.toggle("old", Boolean(told) && (isSilent || (!this.state?.phase && told !== this.state?.trouble)));
    if (isSilent && this.isShown !== "lost") { this.isShown = "lost"; this.showLost(); }
  }

  showLost() {
    setLamp(this.overall, "STALE", t(ACTIONS.unknown), t("no connection to the monitor"));
    for (const lamp of this.groups.children) setLamp(lamp, "STALE", "STALE");
  }

  show(state) {
    this.isShown = "state";
    const alarm = this.alarms.find(({ number }) => number === state.alarm);
    const reason = alarm ? alarmWords(alarm) : words(state.reason), since = alarm ? t("since {time}", { time: this.moment(alarm.begin) }) : "";
    setLamp(this.overall, state.level, t(ACTIONS[state.action]), reason, [alarm?.evidence, since].filter(Boolean).join("; "));
    for (const group of state.groups) {
      let lamp = document.getElementById(`group-${group.name}`);
      if (!lamp) {
        lamp = document.createElement("div");
        lamp.id = `group-${group.name}`;
        lamp.className = "lamp";
        lamp.innerHTML = '<span class="name"></span><span class="sign"></span><b class="word"></b>';
        lamp.querySelector(".name").textContent = t(group.name);
        this.groups.append(lamp);
      }
      setLamp(lamp, group.level, t(group.level));
      lamp.title = [words(group.reason), detail(worst(group))].filter(Boolean).join("; ");
    }
    const count = this.unacknowledged.length;
    this.acknowledge.hidden = !count || !this.mayAcknowledge;
    this.acknowledge.textContent = t("Acknowledge ({count})", { count });
    this.showDropped(state.dropped);
    this.fillTable(state);
  }

  // Messages that could not be used: how many, of which topic, why the last one.
  showDropped(dropped) {
    this.dropped.hidden = !dropped.length;
    const lines = dropped.slice(0, LOSSES).map(({ topic, count, reason }) => `<span>${escapeHtml(topic)}: ${count}, ${t("the last because:")} ${escapeHtml(reason)}</span>`);
    const more = dropped.length > LOSSES ? `<span>${t("topics not listed here:")} ${dropped.length - LOSSES}</span>` : "";
    const html = dropped.length ? `<b>▲ ${dropped.reduce((sum, { count }) => sum + count, 0)} ${t("messages dropped")}</b>${lines.join("")}${more}` : "";
    if (this.html !== html) this.dropped.innerHTML = this.html = html;
  }

  fillTable(state) {
    const table = document.getElementById("lamps");
    if (!table.offsetParent) return;
    table.innerHTML = row("th", ["group", "of", "state", "reason", "judged", "value", "limit", "for, s"].map(head => t(head)), "rttttrrr") +
      state.groups.flatMap(group => group.lamps.map(lamp => `<tr><td>${t(group.name)}<td class=text>${escapeHtml(lamp.name)}<td class=text data-level=${lamp.level}>${SIGNS[lamp.level]} ${t(lamp.level)}` +
        `<td class=text>${escapeHtml(this.lampWords(lamp))}<td class=text>${escapeHtml(lamp.quantity)}<td>${formatNumber(lamp.value ?? NaN)}<td>${formatNumber(lamp.limit ?? NaN)}<td>${formatNumber(lamp.age === null ? NaN : Math.round(lamp.age))}</tr>`)).join("");
  }

  // An alarm stands among the lamps in the words of its own.
  lampWords({ name, reason }) {
    const alarm = this.alarms.find(each => each.name === name && each.reason === reason);
    return alarm ? alarmWords(alarm) : words(reason);
  }

  // A time of the session: of a recording in seconds, else by the clock on the wall.
  moment(seconds) {
    if (this.isReplay || !this.connection.epoch) return `${fixed(seconds, 2)} s`;
    return new Date(Number(this.connection.epoch / 1000000n) + 1000 * seconds).toLocaleString(language, { dateStyle: "short", timeStyle: "medium" });
  }

  // The log of all alarms that the monitor knows, the newest first.
  showAlarms() {
    const heads = ["of", "level", "what and what to do", "cause", "from", "to", ""];
    const rows = this.alarms.toReversed().map(alarm => `<tr><td>${escapeHtml(alarm.name)}<td class=text data-level=${alarm.level}>${SIGNS[alarm.level]} ${t(alarm.level)}` +
      `<td class=text>${escapeHtml(alarmWords(alarm))}${alarm.evidence ? ` <span class=soft>${escapeHtml(alarm.evidence)}</span>` : ""}` +
      `<td class=text>${alarm.causes.map(([cause, share]) => escapeHtml(cause === "unknown" ? t("something else") : cause) + (share === null ? "" : ` ${(100 * share).toFixed(0)} %`)).join(", ")}` +
      `<td>${this.moment(alarm.begin)}<td>${alarm.end === null ? t("lasts") : this.moment(alarm.end)}` +
      `<td>${alarm.level === "OK" ? "" : alarm.is_acknowledged ? t("acknowledged") : `<button data-number=${alarm.number}>${t("Acknowledge")}</button>`}</tr>`);
    const caption = `<caption>${t("alarms and marks since the monitor started: {count}", { count: this.alarms.length || t("none") })}</caption>`;
    document.getElementById("alarms").innerHTML = caption + (rows.length ? row("th", heads.map(head => head && t(head)), "tttttrr") + rows.join("") : "");
  }
}

const row = (kind, cells, sides) => `<tr>${cells.map((cell, i) => `<${kind}${sides[i] === "t" ? " class=text" : ""}>${cell}`).join("")}</tr>`;
export const RANKS = ["OFF", "OK", "WARN", "STALE", "ERROR"];
const worst = group => group.lamps.reduce((found, lamp) => !found || RANKS.indexOf(lamp.level) > RANKS.indexOf(found.level) ? lamp : found, null);

function detail(lamp) {
  if (!lamp) return "";
  return lamp.quantity && lamp.value !== null ? `${lamp.quantity.replaceAll("_", " ")} ${formatNumber(lamp.value)}, ${t("limit")} ${formatNumber(lamp.limit ?? NaN)}` : "";
}

function setLamp(lamp, level, word, reason, detail = "") {
  lamp.dataset.level = level;
  for (const [name, text] of Object.entries({ sign: SIGNS[level], word, reason, detail })) {
    const place = lamp.querySelector(`.${name}`);
    if (place && text !== undefined && place.textContent !== text) place.textContent = text;
  }
}
