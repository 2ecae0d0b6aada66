"use strict";
// The page in parts that share one scope, in this order: tools, instances, findings, tables, timeline, start.

const data = id => JSON.parse(document.getElementById(id).textContent);
const report = data("report"), verdicts = data("verdicts"), facts = data("facts"), lanes = data("lanes");
const page = document.getElementById("page");
const severalProcesses = report.processes.length > 1;

// --- small tools. Names come from a trace: they become text, never markup. ---------------------
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
const el = (tag, attributes, ...children) => fill(document.createElement(tag), attributes, children);
const svg = (tag, attributes, ...children) => fill(document.createElementNS(SVG, tag), attributes, children);
const section = (id, title, ...children) => {
  const part = el("section", {"aria-labelledby": id}, el("h2", {id}, title), children);
  page.append(part);
  return part;
};
const count = n => n.toLocaleString("en-US").replaceAll(",", "\u202f");
const plural = (n, one, many) => `${count(n)} ${n === 1 ? one : many || one + "s"}`;
const percent = x => x >= 0.995 || x < 0.0005 ? `${Math.round(100 * x)}\u202f%` : `${+(100 * x).toPrecision(2)}\u202f%`;
// Nanoseconds for people: four digits, as the text report has them.
const time = ns => {
  if (ns === null || ns === undefined) return "\u2013";
  const size = Math.abs(ns);
  const [unit, name] = size < 1e3 ? [1, "ns"] : size < 1e6 ? [1e3, "\u00b5s"] : size < 1e9 ? [1e6, "ms"] : [1e9, "s"];
  return (unit === 1 ? String(Math.round(ns)) : (ns / unit).toPrecision(4)) + "\u202f" + name;
};
const title = c => c.logical_id + (severalProcesses ? ` (pid ${c.pid})` : "");
const SIGN = {PASS: "\u2713", FAIL: "\u2717", INCONCLUSIVE: "?", NOT_APPLICABLE: "\u2013"};
const COLOUR = {PASS: "pass", FAIL: "fail", INCONCLUSIVE: "open", NOT_APPLICABLE: "soft"};
const WORD = {PASS: "holds", FAIL: "is violated", INCONCLUSIVE: "cannot be decided", NOT_APPLICABLE: "does not apply"};
