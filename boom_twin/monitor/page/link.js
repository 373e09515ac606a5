// The WebSocket: connected again and again; what comes is handed on.

import { blocks, ROWS, SPECTRUM } from "./frames.js";
import { Table } from "./table.js";

const RETRY = 1000; // ms

export class Link extends EventTarget {
  constructor() {
    super();
    this.tables = [];
    this.heard = -Infinity; // ms, by performance.now()
    this.grown = -Infinity; // when rows came last
    this.open();
  }

  open() {
    this.socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = event => this.take(event.data);
    this.socket.onclose = () => setTimeout(() => this.open(), RETRY);
  }

  get isOpen() { return this.socket.readyState === WebSocket.OPEN; }
  table(name) { return this.tables.find(table => table.name === name); }
  ask(request) { if (this.isOpen) this.socket.send(JSON.stringify(request)); }
  tell(kind, detail) { this.dispatchEvent(new CustomEvent(kind, { detail })); }

  take(data) {
    this.heard = performance.now();
    if (typeof data !== "string") return this.takeBlocks(data);
    const message = JSON.parse(data);
    if (message.kind === "reset") this.tables = [];
    if (message.kind === "layout") {
      this.epoch = BigInt(message.epoch_ns);
      this.tables = message.tables.map((each, i) => this.tables[i] ?? new Table(each.name, each.columns));
    }
    this.tell(message.kind, message);
  }

  takeBlocks(buffer) {
    for (const block of blocks(buffer)) {
      if (block.kind !== ROWS) { this.tell(block.kind === SPECTRUM ? "density" : "past", block); continue; }
      if (!this.tables[block.table]) continue;
      this.tables[block.table].add(block.times, block.values);
      this.grown = performance.now();
    }
  }
}
