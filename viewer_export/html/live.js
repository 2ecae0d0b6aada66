// The live page: draws each snapshot (cie.live/1) that the server sends. Text of the system goes
// into text nodes only.

import {el} from "./dom.js";
import {time} from "./words.js";

const byId = id => document.getElementById(id);
const columns = [
  {title: "callback", text: true, value: c => c.name, tip: fullName},
  {title: "pid", value: c => c.pid},
  {title: "runs/s", value: c => c.window.instances / seconds(), show: v => v.toFixed(1)},
  {title: "p50", value: c => c.window.response_time_ns?.p50 ?? -1, show: duration},
  {title: "p99", value: c => c.window.response_time_ns?.p99 ?? -1, show: duration},
  {title: "max", value: c => c.window.response_time_ns?.max ?? -1, show: duration},
  {title: "last", value: c => c.last_response_ns ?? -1, show: duration},
  {title: "deadline", value: c => c.deadline_ns ?? -1, show: duration},
  {
    title: "late",
    value: c => (c.deadline_ns === null ? -1 : c.total.late),
    show: v => (v < 0 ? "-" : String(v)),
    bad: c => c.total.late > 0,
  },
  {title: "missed", value: c => c.total.missed_releases, bad: c => c.total.missed_releases > 0},
];
const keptInstances = 200;
const keptChanges = 200;
const state = {
  snapshot: null,
  sort: 4,
  descending: true,
  paused: false,
  chosen: null,
  instances: new Map(),
  changes: [],
};

// With its machine in front, where several are followed.
function withHost(host, text) {
  return state.snapshot.hosts.length > 0 ? `${host} ${text}` : text;
}
// What tells a callback from all others.
function fullName(callback) {
  return `${withHost(callback.host, callback.logical_id)} (pid ${callback.pid})`;
}
const isolations = {isolated: "isolated", not_isolated: "not isolated", never_ran: "never ran"};
function seconds() {
  return Math.max(state.snapshot.window_ns / 1e9, 0.1);
}
function duration(ns) {
  return ns === null || ns < 0 ? "-" : time(ns);
}
// A machine of several that is not heard of as it should be.
function isInTrouble(host) {
  return ["silent", "lost"].includes(host.state) || host.message !== "";
}
function inWords(host) {
  const since = host.state === "ended" ? "" : ` for ${duration(host.silent_ns)}`;
  return `${host.host}: ${host.state}${since}${host.message ? `, ${host.message}` : ""}`;
}
function table(target, titles, rows) {
  const head = el("thead");
  head.append(el("tr"));
  head.firstChild.append(...titles.map(title => el("th", {scope: "col"}, title)));
  const body = el("tbody");
  body.append(
    ...rows.map(cells => {
      const row = el("tr");
      row.append(...cells.map(cell => (typeof cell === "string" ? el("td", {}, cell) : cell)));
      return row;
    }),
  );
  target.replaceChildren(head, body);
}

function drawCallbacks() {
  const head = el("tr");
  columns.forEach((column, i) => {
    const cell = el("th", {scope: "col"});
    if (i === state.sort) cell.setAttribute("aria-sort", state.descending ? "descending" : "ascending");
    const button = el("button", {type: "button"}, column.title);
    button.addEventListener("click", () => {
      state.descending = state.sort === i ? !state.descending : !column.text;
      state.sort = i;
      draw();
    });
    cell.append(button);
    head.append(cell);
  });
  const wanted = byId("filter").value.toLowerCase();
  const chosen = state.snapshot.callbacks.filter(c =>
    `${c.logical_id}\n${c.name}\n${c.host}\n${c.pid}`.toLowerCase().includes(wanted),
  );
  const {value} = columns[state.sort];
  const compare = (a, b) => (value(a) < value(b) ? -1 : value(a) > value(b) ? 1 : 0);
  chosen.sort((a, b) => (state.descending ? compare(b, a) : compare(a, b)) || (a.logical_id < b.logical_id ? -1 : 1));
  const body = el("tbody");
  for (const c of chosen) {
    const row = el("tr", {tabindex: "0"});
    row.dataset.index = String(c.index);
    row.classList.toggle("ended", c.ended);
    row.classList.toggle("chosen", c.index === state.chosen);
    columns.forEach((column, i) => {
      const shown = column.show ? column.show(column.value(c)) : String(column.value(c));
      const bound = !c.exact && i >= 3 && i <= 6 && shown !== "-" ? ">" : "";
      const cell = el("td", {title: column.tip?.(c)}, bound + shown);
      if (column.text) cell.classList.add("name");
      if (column.bad?.(c)) cell.classList.add("bad");
      row.append(cell);
    });
    const open = () => {
      state.chosen = state.chosen === c.index ? null : c.index;
      draw();
    };
    row.addEventListener("click", open);
    row.addEventListener("keydown", event => {
      if (event.key === "Enter") open();
    });
    body.append(row);
  }
  const focused = document.activeElement?.closest?.("#callbacks tbody tr")?.dataset.index;
  const thead = el("thead");
  thead.append(head);
  byId("callbacks").replaceChildren(thead, body);
  if (focused !== undefined) [...body.rows].find(row => row.dataset.index === focused)?.focus();
}

function drawDetail() {
  const detail = byId("detail");
  const callback = state.snapshot.callbacks.find(c => c.index === state.chosen);
  detail.hidden = !callback;
  if (!callback) return;
  const list = el("table");
  const rows = [...(state.instances.get(callback.index) ?? [])].reverse().map(i => [
    String(i.seq),
    String(i.tid),
    i.cpu === null ? "-" : String(i.cpu),
    (() => {
      const cell = el("td", {}, (i.exact ? "" : ">") + duration(i.response_ns));
      if (i.late) cell.classList.add("bad");
      return cell;
    })(),
    duration(i.execution_ns),
    String(i.missed),
  ]);
  table(list, ["seq", "tid", "CPU", "response time", "execution time", "missed"], rows);
  const scroll = el("div", {class: "scroll tall"});
  scroll.append(list);
  detail.replaceChildren(
    el("h3", {title: fullName(callback)}, callback.name),
    el(
      "p",
      {},
      `${fullName(callback)}: ${callback.kind}, ${isolations[callback.isolation] ?? "isolation unknown"}, ${callback.total.instances} instances since the start`,
    ),
    scroll,
  );
}

function drawVerdicts() {
  const items = state.snapshot.verdicts
    .filter(v => v.verdict === "FAIL")
    .map(v => {
      const item = el("li");
      item.append(
        el("span", {class: "sign fail", "aria-hidden": "true"}, "\u2717"),
        el("strong", {}, `${v.rule} ${v.name}`),
        `, ${v.says}`,
      );
      return item;
    });
  byId("violations").replaceChildren(...(items.length ? items : [el("li", {}, "none")]));
  table(
    byId("changes"),
    ["time", "rule", "subject and evidence", "was", "is"],
    [...state.changes].reverse().map(c => [c.at, `${c.rule} ${c.name}`, c.says, c.from, c.to]),
  );
}

function drawThreads() {
  const key = (row, id) => JSON.stringify([row.host, row.pid, id]);
  const names = new Map(state.snapshot.callbacks.map(c => [key(c, c.logical_id), c.name]));
  const sorted = [...state.snapshot.threads].sort((a, b) => (b.cpu_percent ?? -1) - (a.cpu_percent ?? -1));
  table(
    byId("threads"),
    ["thread", "pid", "tid", "CPU %", "callbacks"],
    sorted.map(t => [
      withHost(t.host, t.name),
      String(t.pid),
      String(t.tid),
      t.cpu_percent === null ? "-" : t.cpu_percent.toFixed(1),
      t.callbacks.map(id => names.get(key(t, id)) ?? id).join(", ") || t.role,
    ]),
  );
}

function draw() {
  const s = state.snapshot;
  if (!s) return;
  byId("source").textContent = `${s.source.url}, ${s.source.state}`;
  byId("message").textContent = [s.source.message, ...s.hosts.filter(isInTrouble).map(inWords)]
    .filter(Boolean)
    .join("; ");
  const verdict = byId("verdict");
  verdict.textContent = s.verdict;
  verdict.className = `verdict ${{PASS: "pass", FAIL: "fail"}[s.verdict] ?? "open"}`;
  const lost = s.lost_events === null ? `unknown, ${s.lost_packets} packets` : String(s.lost_events);
  byId("facts").replaceChildren(
    ...[
      `${s.events} events`,
      `${s.events_per_second.toFixed(0)} events/s`,
      `lost: ${lost}`,
      ...(s.delay_ns === null ? [] : [`${duration(s.delay_ns)} old`]),
    ].map(text => el("li", {}, text)),
  );
  drawCallbacks();
  drawDetail();
  drawVerdicts();
  drawThreads();
}

function take(snapshot) {
  const at = new Date(snapshot.realtime_ns / 1e6).toLocaleTimeString();
  const instances = new Map();
  for (const c of snapshot.callbacks) {
    instances.set(c.index, [...(state.instances.get(c.index) ?? []), ...c.recent].slice(-keptInstances));
  }
  state.instances = instances;
  state.changes = [...state.changes, ...snapshot.changes.map(c => ({...c, at}))].slice(-keptChanges);
  if (state.paused) return;
  state.snapshot = snapshot;
  draw();
  document.documentElement.dataset.ready = "true";
}

byId("filter").addEventListener("input", draw);
byId("pause").addEventListener("click", () => {
  state.paused = !state.paused;
  byId("pause").setAttribute("aria-pressed", String(state.paused));
  byId("pause").textContent = state.paused ? "Go on" : "Pause";
});
const events = new EventSource("events");
events.addEventListener("message", event => take(JSON.parse(event.data)));
events.addEventListener("error", () => {
  byId("message").textContent = "The connection to cie live is lost; trying again.";
});
