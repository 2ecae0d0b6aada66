// The table of callbacks: sorted, filtered, one of them chosen.
import {boundsOf, details} from "./callback.js";
import {el, link, scrolled} from "./dom.js";
import {
  atLeast,
  claims,
  fullName,
  isCalled,
  missedTooMany,
  name,
  report,
  responseTime,
  section,
  wordsIn,
} from "./recording.js";
import {COLOUR, SIGN, count, plural, time} from "./words.js";

const stat = (c, key, which) => (c[key] === null ? null : c[key][which]);
const ISOLATION = {
  isolated: ["PASS", "yes"],
  not_isolated: [claims.claimed ? "FAIL" : "NOT_APPLICABLE", "NO"],
  never_ran: ["NOT_APPLICABLE", "never ran"],
};
const isolationOf = c =>
  c.isolation === "never_ran" && c.runs_not_seen
    ? ["NOT_APPLICABLE", "no instance seen"]
    : ISOLATION[c.isolation] || ["INCONCLUSIVE", "unknown"];
const nsOf = r => (r === null ? null : r.ns);

// Where no release is known, as in recordings of ROS 2's own executors, durations tell more than bounds.
const hasDurationsAlone = report.callbacks.every(c => c.response_time_ns === null && c.release_source !== "wakeup");
const TIMES = hasDurationsAlone
  ? [
      ["duration p50", c => stat(c, "duration_ns", "p50"), "time"],
      ["duration p99", c => stat(c, "duration_ns", "p99"), "time"],
      ["duration max", c => stat(c, "duration_ns", "max"), "time"],
      ["response at most", c => stat(c, "response_time_upper_ns", "max"), "time"],
    ]
  : [
      ["response p50", c => nsOf(responseTime(c, "p50")), "time", "p50"],
      ["response p99", c => nsOf(responseTime(c, "p99")), "time", "p99"],
      ["response max", c => nsOf(responseTime(c, "max")), "time", "max"],
    ];
const COLUMNS = [
  ["callback", c => name(c), "text"],
  ...TIMES,
  ["deadline", c => c.response_deadline_ns, "time"],
  ["late", c => (c.late === null ? null : c.late + (c.late_open ?? 0))],
  ["isolated", c => isolationOf(c)[1], "text"],
  ["threads", c => c.threads.length],
  ["count", c => c.instances],
  ["start latency max", c => stat(c, "start_latency_ns", "max"), "time"],
  ["execution max", c => stat(c, "execution_time_ns", "max"), "time"],
  ["preempted max", c => stat(c, "preempted_ns", "max"), "time"],
  ["blocked max", c => stat(c, "blocked_ns", "max"), "time"],
  ["missed", c => c.missed_releases],
];

// Runs that ended late, and open ones that are late for certain: "0+1", as the text has it.
const lateText = c => (c.late_open ? `${count(c.late)}+${count(c.late_open)}` : count(c.late));

let chosen = -1;
let detail;
let rows = [];

// Marks the callback's row and shows what is known of it.
export const choose = (index, scroll) => {
  if (chosen >= 0) rows[chosen].classList.remove("chosen");
  chosen = index;
  rows[index].classList.add("chosen");
  detail.replaceChildren(...details(index));
  if (scroll) detail.scrollIntoView({block: "nearest"});
};

export const callbacks = () => {
  if (!report.callbacks.length) return;
  const shown = COLUMNS.filter(([, get]) => report.callbacks.some((c, i) => get(c, i) !== null));
  const body = el("tbody");
  rows = report.callbacks.map((c, i) =>
    el(
      "tr",
      {},
      shown.map(([header, get, kind, which], at) => {
        const value = get(c, i);
        if (at === 0)
          return el(
            "td",
            {class: "name"},
            link(value, () => choose(i), fullName(c)),
          );
        if (header === "isolated") {
          const [verdict] = isolationOf(c);
          return el("td", {class: `text ${COLOUR[verdict]}`}, `${SIGN[verdict]} ${value}`);
        }
        const isBeyond = header === "response max" && c.response_deadline_ns !== null && value > c.response_deadline_ns;
        const isBad = isBeyond || (header === "late" && value > 0) || (header === "missed" && missedTooMany(c));
        const told = which ? responseTime(c, which) : null;
        const shownAs = n => (kind === "time" ? time(n) : header === "late" ? lateText(c) : count(n));
        const text = value === null ? "\u2013" : told ? atLeast(told) : shownAs(value);
        return el(
          "td",
          {
            class: isBad ? "fail" : null,
            title: (which && boundsOf(c)) || null,
            "data-ns": kind === "time" ? value : null,
            "data-bound": told?.isBound,
          },
          isBad ? `${SIGN.FAIL} ${text}` : text,
        );
      }),
    ),
  );
  const order = report.callbacks.map((_, i) => i);
  const state = el("p", {class: "soft", role: "status"});
  const draw = () => {
    const words = wordsIn(filter.value);
    const visible = order.filter(i => isCalled(report.callbacks[i], words));
    body.replaceChildren(...visible.map(i => rows[i]));
    state.textContent =
      visible.length === order.length ? "" : `${count(visible.length)} of ${plural(order.length, "callback")}`;
  };
  const sort = (at, direction) => {
    const [, get] = shown[at];
    const value = i => get(report.callbacks[i], i);
    order.sort((a, b) => {
      const x = value(a);
      const y = value(b);
      if (x === y) return a - b;
      if (x === null) return 1;
      if (y === null) return -1;
      return (x < y ? -1 : 1) * direction;
    });
    headers.forEach((h, i) =>
      i === at
        ? h.setAttribute("aria-sort", direction > 0 ? "ascending" : "descending")
        : h.removeAttribute("aria-sort"),
    );
    draw();
  };
  const headers = shown.map(([header, , kind], at) =>
    el(
      "th",
      {scope: "col", class: kind === "text" ? "text" : null},
      el(
        "button",
        {
          type: "button",
          onclick: () =>
            sort(
              at,
              headers[at].getAttribute("aria-sort") === "descending" ||
                (at === 0 && !headers[at].hasAttribute("aria-sort"))
                ? 1
                : -1,
            ),
        },
        header,
      ),
    ),
  );
  const filter = el("input", {
    type: "search",
    placeholder: "Filter by name",
    "aria-label": "Filter callbacks by name",
    oninput: draw,
  });
  detail = el("div", {class: "detail", "aria-live": "polite"});
  section(
    "callbacks",
    "Callbacks",
    el("div", {class: "bar"}, filter, state),
    scrolled(
      "Table of callbacks",
      el("table", {id: "callback-table"}, el("thead", {}, el("tr", {}, headers)), body),
      true,
    ),
    el(
      "p",
      {class: "soft"},
      "Response time: from release to end. Start latency: from release to start. Duration: from start to end. \u2013: not measured. \u2265: at least, when the release is not known exactly.",
    ),
    detail,
  );
  const byMax = shown.findIndex(([header]) => header === TIMES[2][0]);
  sort(byMax < 0 ? 0 : byMax, byMax < 0 ? 1 : -1);
};
