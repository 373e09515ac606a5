// Puts the page together: connection, lamps, tabs, keys, and the loop that draws.

import { theme } from "./colours.js";
import { choose, language, LANGUAGES, t, translatePage } from "./i18n.js";
import { Lamps } from "./lamps.js";
import { Now } from "./now.js";
import { Connection } from "./connection.js";
import { Path } from "./path.js";
import { Shape } from "./shape.js";
import { HtmlTable } from "./html_table.js";
import { SpectrumTab } from "./spectrum.js";
import { Timeline } from "./timeline.js";
import { Traces } from "./traces.js";
import { View } from "./view.js";
import { Actions } from "./actions.js";

const IDLE_RATIO = 2; // least time between two drawings, as a multiple of what one takes
const LONGEST = 60, SLOW = 45, FAST = 55; // ms between drawings at most, and the frames/s below and above which that changes
const get = id => document.getElementById(id);

translatePage();
const connection = new Connection(), view = new View(connection), timeline = new Timeline(connection), lamps = new Lamps(connection);
new Actions(connection, view);
new Now(connection);
const spectrum = new SpectrumTab(connection, new HtmlTable("peaks"));
const tabs = { traces: new Traces(connection, view, new HtmlTable("figures")), spectrum, shape: new Shape(connection, view), path: new Path(connection, view), state: null };
let open = "traces", drawn = "", due = 0, frames = 0, second = performance.now(), shown = NaN, pace = 0;
const delays = []; // s from the newest stamp to the frame after its drawing, live, if the clocks agree

// -- what is chosen ---------------------------------------------------------------------------------------------------

function selectTab(tab) {
  open = tab;
  for (const section of document.querySelectorAll(".tab")) section.classList.toggle("open", section.id === tab);
  for (const button of document.querySelectorAll("#tabs button")) button.setAttribute("aria-selected", button.dataset.tab === tab);
  spectrum.isNew = true;
  view.version++;
  if (tab === "state" && lamps.state) lamps.fillTable(lamps.state);
}

function setTheme(name) {
  document.documentElement.dataset.theme = name;
  localStorage.setItem("theme", name);
  get("theme").textContent = t(name === "dark" ? "Light" : "Dark");
  tabs.traces.rebuild();
  spectrum.rebuild();
  view.version++;
}

function pause() {
  if (timeline.isReplay) timeline.hold(!timeline.isHeld);
  else { view.hold(!view.isHeld); get("pause").textContent = t(view.isHeld ? "Go on" : "Pause"); }
}

for (const button of document.querySelectorAll("#tabs button")) button.onclick = () => selectTab(button.dataset.tab);
get("window").onchange = event => view.set({ window: Number(event.target.value), zoom: null });
get("pause").onclick = pause;
get("language").replaceChildren(...Object.entries(LANGUAGES).map(([name, label]) => new Option(label, name, name === language, name === language)));
get("language").onchange = event => choose(event.target.value);
get("all").onclick = () => view.set({ zoom: null });
get("theme").onclick = () => setTheme(theme() === "dark" ? "light" : "dark");

const KEYS = { " ": pause, z: () => get("all").click(), m: () => get("mark").click(), p: () => get("picture").click(), c: () => get("csv").click(), t: () => get("theme").click(),
  ",": () => timeline.jump(-1), ".": () => timeline.jump(1), ArrowLeft: () => timeline.isReplay && timeline.seek(timeline.position - 5), ArrowRight: () => timeline.isReplay && timeline.seek(timeline.position + 5) };
addEventListener("keydown", event => {
  if (event.ctrlKey || event.metaKey || event.altKey || /INPUT|SELECT|DIALOG/.test(event.target.tagName) || get("note").open) return;
  const tab = document.querySelectorAll("#tabs button")[Number(event.key) - 1];
  if (event.key === " " && event.target.tagName === "BUTTON" && event.target.id !== "pause") return;
  if (tab) tab.click();
  else if (KEYS[event.key]) { event.preventDefault(); KEYS[event.key](); }
});

connection.addEventListener("hello", event => {
  get("title").textContent = t(event.detail.title);
  get("pause").hidden = timeline.isReplay;
  view.set({ end: null, zoom: null });
});
connection.addEventListener("reset", () => { tabs.traces.rebuild(); if (view.zoom || view.isHeld) view.set({ zoom: null, end: null }); });

// -- what is drawn ----------------------------------------------------------------------------------------------------

function draw(now) {
  requestAnimationFrame(draw);
  frames++;
  recordDelay();
  if (now - second > 1000) showRate(now);
  const state = `${open} ${view.version} ${view.isHeld || view.zoom ? "" : connection.lastRows}`;
  if (now < due || `${state} ${tabs[open]?.isNew}` === drawn || document.hidden) return;
  const began = performance.now();
  tabs[open]?.draw(open);
  const missing = tabs[open]?.missing?.(open) ?? "";
  get("empty").hidden = !missing;
  get("empty").textContent = t(missing);
  drawn = `${state} ${tabs[open]?.isNew}`; // as it is now: what comes before the next frame is new again
  due = now + Math.max(pace, IDLE_RATIO * (performance.now() - began));
  shown = view.newest;
}

function recordDelay() {
  if (!timeline.isReplay && connection.epoch && Number.isFinite(shown)) delays.push(Date.now() / 1000 - Number(connection.epoch / 1000n) / 1e6 - shown);
  shown = NaN;
}

function showRate(now) {
  const rate = 1000 * frames / (now - second);
  get("fps").textContent = t("{rate} frames/s", { rate: Math.round(rate) });
  if (rate < SLOW) pace = Math.min(pace + 20, LONGEST); // a machine that does not keep up draws less often
  if (rate > FAST) pace = Math.max(pace - 5, 0);
  frames = 0;
  second = now;
  lamps.watch(timeline.isReplay);
  const sorted = delays.splice(0).sort((a, b) => a - b), delay = sorted[sorted.length >> 1];
  get("connection").textContent = t(!connection.isOpen ? "not connected" : timeline.isReplay ? "recorded session" : delay > -0.5 && delay < 60 ? "live, {delay} ms behind the sensors" : "live", { delay: Math.round(1000 * delay) });
}

setInterval(() => lamps.watch(timeline.isReplay), 500);
setTheme(localStorage.getItem("theme") ?? (matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark"));
selectTab("traces");
requestAnimationFrame(draw);
Object.assign(window, { twin: { connection, view, timeline, delays, shape: tabs.shape, charts: name => tabs.traces.charts.get(name) } }); // for tests and for the curious
