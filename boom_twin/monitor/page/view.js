// What span of time is shown.

export class View {
  constructor(connection) {
    this.connection = connection;
    this.window = 30; // s
    this.end = null; // where it is held; null: at the newest row
    this.zoom = null; // [from, to] chosen on a chart
    this.version = 0; // raised with every change
  }

  get newest() { return this.connection.table("displacement")?.newest ?? NaN; }
  get isHeld() { return this.end !== null; }

  get span() {
    if (this.zoom) return this.zoom;
    const end = this.end ?? this.newest;
    return [end - this.window, end];
  }

  set(changes) { Object.assign(this, changes); this.version++; }
  hold(isHeld) { this.set({ end: isHeld ? this.newest : null }); }
}
