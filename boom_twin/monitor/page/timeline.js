// Where one is in a recorded session: scrubber, speed, marks.

import { t } from "./i18n.js";
import { alarmWords, RANKS } from "./lamps.js";

export class Timeline {
  constructor(connection) {
    this.connection = connection;
    this.times = [];
    this.alarms = [];
    this.scrubber = document.getElementById("scrubber");
    this.play = document.getElementById("play");
    this.scrubber.oninput = () => this.seek(Number(this.scrubber.value));
    this.play.onclick = () => this.hold(!this.isHeld);
    document.getElementById("speed").onchange = event => connection.send({ do: "speed", value: Number(event.target.value) });
    document.getElementById("before").onclick = () => this.jump(-1);
    document.getElementById("after").onclick = () => this.jump(1);
    connection.addEventListener("hello", event => this.begin(event.detail));
    connection.addEventListener("state", event => this.update(event.detail));
    connection.addEventListener("alarms", event => this.drawMarks(event.detail.alarms));
  }

  get isReplay() { return this.end !== null && this.end !== undefined; }

  begin({ end }) {
    this.end = end;
    document.getElementById("timeline").hidden = end === null;
    if (this.isReplay) this.connection.send({ do: "speed", value: Number(document.getElementById("speed").value) });
  }

  update({ position, is_held: isHeld, end, read }) {
    if (!this.isReplay) return;
    if (end !== this.end) { this.end = end; this.drawMarks(this.alarms); }
    this.scrubber.max = end;
    this.isRead = read >= end;
    this.isHeld = isHeld;
    this.position = position;
    this.play.textContent = t(isHeld ? "Play" : "Pause");
    if (document.activeElement !== this.scrubber || !this.scrubber.matches(":active")) this.scrubber.value = position;
    document.getElementById("position").textContent = t("{position} of {end} s", { position: position.toFixed(2), end: end.toFixed(2) }) + (this.isRead ? "" : `, ${t("reading: {share} %", { share: (100 * read / end).toFixed(0) })}`);
  }

  drawMarks(alarms) {
    this.alarms = alarms;
    if (!this.isReplay) return;
    this.times = [...new Set(alarms.map(alarm => alarm.begin))].sort((a, b) => a - b);
    document.getElementById("marks").replaceChildren(...alarms.toSorted((a, b) => RANKS.indexOf(a.level) - RANKS.indexOf(b.level)).map(alarm => {
      const mark = document.createElement("i"), end = alarm.end ?? this.end;
      mark.dataset.level = alarm.level;
      mark.title = `${alarm.name}: ${alarmWords(alarm)} ${alarm.begin.toFixed(2)} s`;
      mark.style.left = `${100 * alarm.begin / this.end}%`;
      mark.style.width = `${100 * (end - alarm.begin) / this.end}%`;
      return mark;
    }));
  }

  hold(isHeld) { this.connection.send({ do: "hold", value: isHeld ? 1 : 0 }); }
  seek(value) { this.connection.send({ do: "seek", value }); }

  // To the mark before (-1) or after (1) the present position.
  jump(direction) {
    const near = this.position + (direction > 0 ? 0.01 : -0.6);
    const target = direction > 0 ? this.times.find(time => time > near) : this.times.findLast(time => time < near);
    if (target !== undefined) this.seek(target + 0.001);
  }
}
