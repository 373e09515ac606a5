// The WebSocket: connected again and again; what comes is handed on.

import { decodeBlocks, ROWS } from "./protocol.js";
import { Table } from "./table.js";

const RETRY = 1000; // ms

export class Connection extends EventTarget {
  constructor() {
    super();
    this.tables = [];
    this.lastMessage = -Infinity; // ms, by performance.now()
    this.lastRows = -Infinity; // when rows came last
    this.open();
  }

  open() {
    this.socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/socket`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = event => this.receive(event.data);
    this.socket.onclose = () => setTimeout(() => this.open(), RETRY);
  }

  get isOpen() { return this.socket.readyState === WebSocket.OPEN; }
  table(name) { return this.tables.find(table => table.name === name); }
  get residualTables() { return this.tables.filter(table => table.residuals); }
  send(request) { if (this.isOpen) this.socket.send(JSON.stringify(request)); }
  emit(kind, detail) { this.dispatchEvent(new CustomEvent(kind, { detail })); }

  receive(data) {
    this.lastMessage = performance.now();
    if (typeof data !== "string") return this.receiveBlocks(data);
    const message = JSON.parse(data);
    if (message.kind === "reset") this.tables = [];
    if (message.kind === "layout") {
      this.epoch = BigInt(message.epoch_ns);
      this.tables = message.tables.map((each, i) => this.tables[i] ?? new Table(each.name, each.columns, each.residuals));
    }
    this.emit(message.kind, message);
  }

  receiveBlocks(buffer) {
    for (const block of decodeBlocks(buffer)) {
      if (block.kind !== ROWS) { this.emit("spectrum", block); continue; }
      if (!this.tables[block.table]) continue;
      this.tables[block.table].add(block.times, block.values);
      this.lastRows = performance.now();
    }
  }
}
