// What one does with the page: mark, acknowledge, export.

import { themeColour } from "./colours.js";
import { t, words } from "./i18n.js";

const TABLES = ["displacement", "position", "acceleration", "force", "joints", "uncertainty"];

export class Actions {
  constructor(connection, view) {
    this.connection = connection;
    this.view = view;
    this.answer = document.getElementById("answer");
    const mark = document.getElementById("mark"), dialog = document.getElementById("note"), text = document.getElementById("note-text");
    mark.onclick = () => { text.value = ""; dialog.showModal(); };
    dialog.onclose = () => { if (dialog.returnValue === "ok") connection.send({ do: "mark", note: text.value }); dialog.returnValue = ""; };
    document.getElementById("alarms").onclick = event => { if (event.target.dataset.number) connection.send({ do: "acknowledge", numbers: [Number(event.target.dataset.number)] }); };
    document.getElementById("picture").onclick = () => this.savePicture();
    document.getElementById("csv").onclick = () => this.saveTable();
    connection.addEventListener("hello", event => this.permit(event.detail.permitted));
    connection.addEventListener("answer", event => { this.answer.textContent = words(event.detail.words); });
  }

  permit(permitted) {
    document.getElementById("mark").disabled = !permitted.includes("mark");
    document.getElementById("alarms").classList.toggle("locked", !permitted.includes("acknowledge"));
  }

  // All canvases of the open tab below each other.
  savePicture() {
    const canvases = [...document.querySelectorAll(".tab.open canvas")].filter(each => each.width && each.height);
    const picture = document.createElement("canvas"), context = picture.getContext("2d");
    picture.width = Math.max(...canvases.map(each => each.width));
    picture.height = 30 + canvases.reduce((sum, each) => sum + each.height, 0);
    context.fillStyle = themeColour("ground");
    context.fillRect(0, 0, picture.width, picture.height);
    context.fillStyle = themeColour("ink");
    context.font = "15px system-ui";
    context.fillText(`${document.getElementById("title").textContent}, ${this.view.span.map(t => t.toFixed(2)).join(" to ")} s, ${document.querySelector("#overall .word").textContent}`, 8, 20);
    let y = 30;
    for (const each of canvases) { context.drawImage(each, 0, y); y += each.height; }
    picture.toBlob(blob => save(blob, "boom_twin.png"));
  }

  // Every row of the span that is shown, by stamp; empty where a table has none at that stamp. Of the alarms their log.
  saveTable() {
    if (document.querySelector("#state.open")) return saveRows([...document.querySelectorAll("#alarms tr")].map(row => [...row.cells].slice(0, 6).map(cell => `"${cell.innerText.replaceAll('"', '""')}"`).join(",")), "boom_twin_alarms.csv");
    const [from, to] = this.view.span, rows = new Map(), heads = ["t_s"];
    const others = this.connection.residualTables.filter(({ name }) => !TABLES.includes(name));
    for (const table of [...TABLES.map(name => this.connection.table(name)).filter(Boolean), ...others]) {
      const start = heads.length;
      heads.push(...table.columns.map(column => `${table.name}_${column}`));
      for (let row = table.from(from); row < table.count && table.time(row) <= to; row++) {
        const time = table.time(row).toFixed(6);
        if (!rows.has(time)) rows.set(time, []);
        table.columns.forEach((_, c) => { rows.get(time)[start - 1 + c] = table.at(c, row); });
      }
    }
    const line = ([time, values]) => [time, ...Array.from({ length: heads.length - 1 }, (_, i) => values[i] === undefined || Number.isNaN(values[i]) ? "" : Number(values[i].toPrecision(8)))].join(",");
    const sorted = [...rows].sort(([a], [b]) => a - b);
    saveRows([heads.join(","), ...sorted.map(line)], "boom_twin.csv");
  }
}

const saveRows = (rows, name) => save(new Blob([rows.join("\n") + "\n"], { type: "text/csv" }), name);

function save(blob, name) {
  const anchor = document.createElement("a");
  anchor.href = URL.createObjectURL(blob);
  anchor.download = name;
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(anchor.href), 1000);
}
