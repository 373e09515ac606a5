// Fewer points with the same outline: lowest and highest of every slot, breaks where rows are missing.

const GAP = 0.1; // s without rows that is drawn as a break

// Columns of a table from one time to another, for uPlot: [times, ...values], null at breaks.
export function decimate(table, columns, from, to, slots) {
  const first = Math.max(table.first, table.from(from) - 1), end = Math.min(table.count, table.from(to) + 1);
  const step = Math.max(1, Math.floor((end - first) / slots));
  const times = [], values = columns.map(() => []);
  let before = NaN;
  // slots are cut at fixed row numbers, so that a scrolling line does not flicker
  for (let row = first; row < end;) {
    const stop = beforeGap(table, row, Math.min(end, row - row % step + step));
    if (table.time(row) - before > GAP) { times.push(table.time(row)); values.forEach(each => each.push(null)); }
    if (step < 3) for (let i = row; i < stop; i++) push(table, columns, i, times, values);
    else pushOutline(table, columns, row, stop, times, values);
    before = table.time(stop - 1);
    row = stop;
  }
  return [times, ...values];
}

// The end of the rows from one on that follow each other without a gap.
function beforeGap(table, row, end) {
  for (let i = row + 1; i < end; i++) if (table.time(i) - table.time(i - 1) > GAP) return i;
  return end;
}

function push(table, columns, row, times, values) {
  times.push(table.time(row));
  columns.forEach((column, i) => { const value = table.at(column, row); values[i].push(Number.isFinite(value) ? value : null); });
}

function pushOutline(table, columns, row, stop, times, values) {
  times.push(table.time(row), table.time(stop - 1));
  columns.forEach((column, i) => {
    let low = Infinity, high = -Infinity, rises = true;
    for (let r = row; r < stop; r++) {
      const value = table.at(column, r);
      if (value < low) { low = value; rises = false; }
      if (value > high) { high = value; rises = true; }
    }
    if (low > high) values[i].push(null, null);
    else values[i].push(...(rises ? [low, high] : [high, low]));
  });
}

// Of one column from one time to another: mean, and about it root mean square, largest deviation, range, crest factor.
export function statistics(table, column, from, to) {
  const first = table.from(from), end = table.from(to);
  let sum = 0, squares = 0, count = 0, low = Infinity, high = -Infinity;
  for (let row = first; row < end; row++) {
    const value = table.at(column, row);
    if (!Number.isFinite(value)) continue;
    sum += value;
    count++;
    if (value < low) low = value;
    if (value > high) high = value;
  }
  const mean = sum / count;
  for (let row = first; row < end; row++) {
    const value = table.at(column, row) - mean;
    if (Number.isFinite(value)) squares += value * value;
  }
  const rms = Math.sqrt(squares / count), peak = Math.max(high - mean, mean - low);
  return { mean, rms, peak, range: high - low, crest: peak / rms };
}
