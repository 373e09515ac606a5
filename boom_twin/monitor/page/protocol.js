// Binary messages as boom_twin/monitor/protocol.py describes them.

export const ROWS = 1, SPECTRUM = 2;

export function* decodeBlocks(buffer) {
  const view = new DataView(buffer);
  for (let at = 0; at < buffer.byteLength;) {
    const kind = view.getUint8(at), table = view.getUint8(at + 1);
    const columns = view.getUint16(at + 2, true), rows = view.getUint32(at + 4, true);
    const times = new Float64Array(buffer, at + 8, rows);
    const values = new Float32Array(buffer, at + 8 + 8 * rows, rows * columns);
    yield { kind, table, columns, rows, times, values };
    at += 8 + 8 * rows + 8 * Math.ceil(rows * columns / 2);
  }
}
