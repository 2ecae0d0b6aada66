// What the page was given: one document of the report, the verdicts and what the pictures show.
import {el} from "./dom.js";
import {printable, time} from "./words.js";

export const {
  report,
  verdicts,
  head: claims, // what somebody claimed, and what is violated of it
  input, // of a command that reads the same again
  spec, // its name; null without one
  names: shortNames, // of callbacks and chains by row, what is said instead of ids, and which subjects are worst
  histograms, // of response times, by row of report.callbacks: [ns, runs] of each bucket
  timeline: lanes,
} = JSON.parse(document.getElementById("document").textContent);
// Programs name their threads as they like.
for (const t of [...report.threads, ...report.callbacks.flatMap(c => [...c.threads, ...c.preempted_by])])
  if (t.name) t.name = printable(t.name);
// Of what counts as preempted: its CPU was idle, so that nobody preempted it, and why, as the text has it.
export const idleTime = c => c.preempted_by.find(p => p.tid === 0)?.ns ?? 0;
export const whyIdle = c => claims.idle[c.index];
export const page = document.getElementById("page");
export const severalProcesses = report.processes.length > 1,
  severalHosts = report.trace.hosts.length > 1;
// Rows refer to callbacks by their numbers; names, pids and tids may be the same on several hosts.
export const callbackByIndex = new Map(report.callbacks.map(c => [c.index, c]));
export const processByIndex = new Map(report.processes.map(p => [p.index, p]));

export const section = (id, title, ...children) => {
  const part = el("section", {"aria-labelledby": id}, el("h2", {id}, title), children);
  page.append(part);
  return part;
};
export const whereabouts = process => ` (pid ${process.pid}${severalHosts ? ` on ${process.host}` : ""})`;
const nameByIndex = new Map(report.callbacks.map((c, row) => [c.index, shortNames.callbacks[row]]));
const words = new Map(Object.entries(shortNames.words));
// What people call a callback, and what tells it from all others.
export const name = c => nameByIndex.get(c.index);
export const fullName = c =>
  c.logical_id +
  (shortNames.ordinals[c.index] ?? "") +
  (severalProcesses ? whereabouts(processByIndex.get(c.process)) : "");
// Whether all these words are in one of its names.
export const isCalled = (c, wanted) => {
  const names = `${name(c)}\n${fullName(c)}`.toLowerCase();
  return wanted.every(word => names.includes(word));
};
const tooMany = new Set(
  verdicts.rules
    .filter(r => r.id === "R2")
    .flatMap(r => r.subjects.filter(s => s.verdict === "FAIL" && s.kind === "callback").map(s => s.index)),
);
// Whether a timer missed more releases than it may.
export const missedTooMany = c => tooMany.has(c.index);
export const wordsIn = text => text.toLowerCase().split(/\s+/).filter(Boolean);
// A logical id, or a subject or note of a verdict, by short names.
export const inWords = text => words.get(text) ?? text;
// What runs took at most whose release is not known; null: there are none, or one of them may have taken any time.
export const atMostWhereUnknown = c => {
  const lower = c.response_time_lower_ns;
  const upper = c.response_time_upper_ns;
  return lower === null || upper === null || upper.count < lower.count ? null : upper.max;
};
// A response time that people read: exact where it is known, else what it is at least (isBound). Runs whose release is
// not known may have taken longer than those of which it is.
export const responseTime = (c, which) => {
  const exact = c.response_time_ns;
  const lower = c.response_time_lower_ns;
  if (exact === null && lower === null) return null;
  if (lower === null) return {ns: exact[which], isBound: false};
  if (exact === null) return {ns: lower[which], isBound: true};
  if (which !== "max") return {ns: c.response_time_at_least_ns[which], isBound: !(which === "p50" && c.median_known)};
  const most = atMostWhereUnknown(c);
  return {ns: Math.max(exact.max, lower.max), isBound: most === null || most > exact.max};
};
export const atLeast = r => (r.isBound ? "\u2265\u202f" : "") + time(r.ns);
