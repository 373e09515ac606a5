// An HTML table of words and numbers.

export class Sheet {
  constructor(id) { this.element = document.getElementById(id); }

  fill(heads, rows, caption = "") {
    const cells = (kind, row) => "<tr>" + row.map(cell => `<${kind}${typeof cell === "string" ? ' class="text"' : ""}>${show(cell)}</${kind}>`).join("") + "</tr>";
    this.element.innerHTML = (caption ? `<caption>${escape(caption)}</caption>` : "") + cells("th", heads) + rows.map(row => cells("td", row)).join("");
  }
}

// Three or four digits of a number, – where it is not known.
export function show(cell) {
  if (typeof cell === "string") return escape(cell);
  if (!Number.isFinite(cell)) return "–";
  const size = Math.abs(cell);
  return size && (size < 1e-3 || size >= 1e6) ? cell.toExponential(2) : Number(cell.toPrecision(4)).toString();
}

export const escape = text => text.replace(/[&<>"]/g, sign => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[sign]);
