// Elements. Names come from a trace: they become text, never markup.

const SVG = "http://www.w3.org/2000/svg";
const fill = (node, attributes, children) => {
  for (const [name, value] of Object.entries(attributes || {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value === true ? "" : value);
  }
  for (const child of children.flat(3)) {
    if (child !== null && child !== undefined) node.append(child instanceof Node ? child : String(child));
  }
  return node;
};
export const el = (tag, attributes, ...children) => fill(document.createElement(tag), attributes, children);
export const svg = (tag, attributes, ...children) => fill(document.createElementNS(SVG, tag), attributes, children);
export const link = (text, action, tip) =>
  el("button", {class: "link", type: "button", onclick: action, title: tip}, text);
// What is wider, or higher, than there is room for: keys scroll it, too.
export const scrolled = (label, child, isTall) =>
  el("div", {class: isTall ? "scroll tall" : "scroll", tabindex: "0", role: "region", "aria-label": label}, child);
// Columns of a table without any value go; the first one stays.
export const withoutEmptyColumns = table => {
  const rows = [...table.querySelectorAll("tr")];
  const isEmpty = cell => ["", "\u2013"].includes(cell.textContent);
  for (let i = rows[0].cells.length - 1; i > 0; --i) {
    if (rows.slice(1).every(row => isEmpty(row.cells[i]))) for (const row of rows) row.cells[i].remove();
  }
  return table;
};
// What a colour stands for, in a key.
export const colour = (kind, text) =>
  el(
    "span",
    {},
    svg(
      "svg",
      {width: 11, height: 11, "aria-hidden": "true"},
      svg("rect", {class: `f-${kind}`, width: 11, height: 11}),
    ),
    text,
  );
// A wide drawing, of its own size in pixels, that scrolls.
export const drawing = (W, H, label, ...children) =>
  svg(
    "svg",
    {viewBox: `0 0 ${W} ${H}`, width: W, height: H, class: "wide", role: "img", "aria-label": label},
    ...children,
  );
