// Rows of one table: the newest so many, in arrays that are made once.

export const CAPACITY = 1 << 17; // rows: ten minutes at 200 Hz

export class Table {
  // residuals: what they are of, factor and unit in which they are shown; only tables of residuals have it
  constructor(name, columns, residuals) {
    this.name = name;
    this.columns = columns;
    this.residuals = residuals;
    const capacity = name === "shape" ? 1 : CAPACITY; // of the shape only the newest is drawn
    this.times = new Float64Array(capacity);
    this.values = columns.map(() => new Float32Array(capacity));
    this.count = 0;
  }

  get first() { return Math.max(0, this.count - this.times.length); }
  get newest() { return this.count ? this.time(this.count - 1) : NaN; }
  time(row) { return this.times[row % this.times.length]; }
  at(column, row) { return this.values[column][row % this.times.length]; }

  // Take a block: times (k), values (k x c, column by column).
  add(times, values) {
    const rows = times.length, size = this.times.length;
    for (let i = Math.max(0, rows - size); i < rows; i++) {
      const place = (this.count + i) % size;
      this.times[place] = times[i];
      for (let c = 0; c < this.values.length; c++) this.values[c][place] = values[c * rows + i];
    }
    this.count += rows;
  }

  // Number of the first row at or after a time.
  from(time) {
    let low = this.first, high = this.count;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.time(middle) < time) low = middle + 1; else high = middle;
    }
    return low;
  }
}
