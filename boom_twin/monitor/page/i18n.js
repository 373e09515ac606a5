// Texts in the viewer's language: that of `?lang=`, else the one chosen before, else the browser's. English texts are the keys.

export const LANGUAGES = { en: "English", de: "Deutsch", zh: "中文" };
const wanted = [new URLSearchParams(location.search).get("lang"), localStorage.getItem("language"), ...navigator.languages.map(each => each.slice(0, 2)), "en"];
export const language = wanted.find(each => each in LANGUAGES);
const table = language === "en" ? {} : await (await fetch("/page/texts.json")).json();

export function t(english, values = {}) {
  const text = table[english]?.[Object.keys(LANGUAGES).indexOf(language) - 1] ?? english;
  return text.replace(/\{(\w+)\}/g, (all, name) => values[name] ?? all);
}

// What a node says: a text of the table, or several with "; " or ": " between them, with names that stay as they are.
export const words = said => said in table ? t(said) : said.split("; ").map(part => part in table ? t(part) : part.split(": ").map(each => t(each)).join(": ")).join("; ");

export function choose(name) {
  localStorage.setItem("language", name);
  const url = new URL(location);
  url.searchParams.delete("lang");
  location.assign(url);
}

// Every text of the page itself.
export function translatePage() {
  document.documentElement.lang = language;
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode, text = node.data.trim();
    if (text) node.data = node.data.replace(text, t(text));
  }
  for (const name of ["title", "aria-label"]) for (const element of document.querySelectorAll(`[${name}]`)) element.setAttribute(name, t(element.getAttribute(name)));
}
