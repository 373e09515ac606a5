// An HTML table of words and numbers.

export class HtmlTable {
  constructor(id) { this.element = document.getElementById(id); }

  fill(heads, rows, caption = "") {
    const words = heads.map((_, i) => rows.some(row => typeof row[i] === "string")); // a head stands over its column: left over words, right over numbers
    const cells = (kind, row) => "<tr>" + row.map((cell, i) => `<${kind}${words[i] ? ' class="text"' : ""}>${formatNumber(cell)}</${kind}>`).join("") + "</tr>";
    this.element.innerHTML = (caption ? `<caption>${escapeHtml(caption)}</caption>` : "") + cells("th", heads) + rows.map(row => cells("td", row)).join("");
  }
}

// Three or four digits of a number, – where it is not known.
export function fixed(number, digits) { // without the sign of what is rounded to nothing
  const text = number.toFixed(digits);
  return Number(text) === 0 ? text.replace("-", "") : text;
}

export function formatNumber(cell) {
  if (typeof cell === "string") return escapeHtml(cell);
  if (!Number.isFinite(cell)) return "–";
  const size = Math.abs(cell);
  return size && (size < 1e-3 || size >= 1e6) ? cell.toExponential(2) : Number(cell.toPrecision(4)).toString();
}

export const escapeHtml = text => text.replace(/[&<>"]/g, sign => ({ "&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;" })[sign]);
