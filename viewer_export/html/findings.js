// The first minute: verdict, worst callback, what is missing.
import {choose} from "./callbacks.js";
import {el, link} from "./dom.js";
import {knowsWhomItWaitedFor, laneOf, partsOf, waitedFor, worstRun} from "./instances.js";
import {
  claims,
  fullName,
  idleTime,
  inWords,
  input,
  lanes,
  missedTooMany,
  name,
  page,
  report,
  responseTime,
  section,
  severalHosts,
  shortNames,
  spec,
  verdicts,
  whyIdle,
} from "./recording.js";
import {timeline} from "./timeline.js";
import {COLOUR, SIGN, WORD, count, percent, plural, time} from "./words.js";

// The callback that the text report has first; -1 where no response time is known.
export const worstIndex = () => claims.worst ?? -1;
const sentence = (verdict, ...text) =>
  el("li", {}, el("span", {class: `sign ${COLOUR[verdict]}`, "aria-hidden": "true"}, SIGN[verdict]), text);

export const head = () => {
  const t = report.trace;
  const began =
    t.clock_offset_ns !== null && t.begin_ns !== null
      ? `${new Date((t.begin_ns + t.clock_offset_ns) / 1e6).toISOString().replace("T", " ").slice(0, 19)} UTC, `
      : "";
  page.append(
    el(
      "header",
      {class: "head"},
      el(
        "div",
        {},
        el("h1", {id: "fact"}, claims.fact),
        claims.isolation === null ? null : el("p", {}, `${claims.isolation}.`),
        el(
          "p",
          {class: "soft"},
          `Callback report of ${t.paths.join(", ")}`,
          el("br"),
          `${began}${t.begin_ns === null ? "no packets" : time(t.end_ns - t.begin_ns)}, ${plural(t.events, "event")}, `,
          `${plural(report.processes.length, "process", "processes")} on ${t.hosts.join(", ") || "an unnamed host"}`,
          spec === null ? ", without a scheduling spec" : `, against ${spec}`,
        ),
      ),
      claims.verdict === null
        ? null
        : el(
            "div",
            {class: `verdict ${COLOUR[claims.verdict]}`, id: "verdict"},
            `${SIGN[claims.verdict]} ${claims.verdict}`,
          ),
    ),
  );
};
// Who is to blame for the longest part of an instance's response time, as far as the recording shows it.
const why = (lane, i, [, kind, ns]) => {
  if (kind === "preempted") {
    const c = lane.callbackReport;
    const by = c.preempted_by.find(p => p.tid !== 0);
    const all = c.preempted_ns.sum;
    if (idleTime(c) > (by?.ns ?? 0))
      return `; its CPU was idle for ${time(idleTime(c))} of ${time(all)} in all its instances: ${whyIdle(c)}`;
    return by
      ? `; ${by.name || `thread ${by.tid}`} ran instead for ${time(by.ns)} of ${time(all)} in all its instances`
      : "";
  }
  if (kind !== "wait") return "";
  const others = waitedFor(lane, i);
  const isAll = knowsWhomItWaitedFor(lane, i);
  const sum = others.reduce((all, [, part]) => all + part, 0);
  if (sum < ns / 5) return sum === 0 && isAll ? ", though no callback ran on its thread" : "";
  const [first, part] = others[0];
  return `, while its thread ran ${first === lane ? "an earlier release of itself" : first.title} for ${isAll ? "" : "at least "}${time(part)}${others.length > 1 ? ` and ${plural(others.length - 1, "other")} for ${time(sum - part)}` : ""}`;
};
const hasNamedThreads = c =>
  c.threads.reduce((runs, t) => runs + t.instances, 0) >= c.instances && c.threads.length > 0;
// Whether each callback that ran had a thread of its own: a line for what is known, and one for what is not.
const isolation = () => {
  const all = report.callbacks;
  const named = list => `${list.slice(0, 3).map(name).join(", ")}${list.length > 3 ? " and others" : ""}`;
  if (all.length === 0) return [sentence("INCONCLUSIVE", "No callback was seen in this recording.")];
  const ran = all.filter(c => c.isolation !== "never_ran");
  const never = all.length - ran.length;
  const unseen = all.filter(c => c.isolation === "never_ran" && c.runs_not_seen).length;
  const others = [
    unseen === 0 ? "" : `; of ${count(unseen)} no instance was seen`,
    never === unseen ? "." : `; ${count(never - unseen)} never ran.`,
  ].join("");
  const shared = ran.filter(c => c.isolation === "not_isolated");
  const unknown = ran.filter(c => c.isolation === null);
  const lines = [];
  if (ran.length === 0)
    return [
      sentence(
        "INCONCLUSIVE",
        unseen === 0
          ? `None of the ${plural(all.length, "callback")} ran.`
          : `No whole instance of the ${plural(all.length, "callback")} was seen.`,
      ),
    ];
  // What is not in the recording may have been otherwise.
  const isDecided = !verdicts.rules.some(r => ["M2", "M3"].includes(r.id) && r.verdict === "INCONCLUSIVE");
  const known = text => (isDecided ? text : `As far as recorded, ${text[0].toLowerCase()}${text.slice(1)}`);
  const sharing = claims.claimed ? "FAIL" : "NOT_APPLICABLE";
  if (shared.length) {
    const those = never === 0 ? plural(ran.length, "callback") : `${plural(ran.length, "callback")} that ran`;
    lines.push(
      sentence(
        sharing,
        `${count(shared.length)} of ${those} did not have a thread of their own: ${named(shared)}${others}`,
      ),
    );
  } else if (!unknown.length) {
    lines.push(
      sentence(
        isDecided ? "PASS" : "INCONCLUSIVE",
        known(
          all.length === 1
            ? "The callback had a thread of its own, and that thread no other callback."
            : never === 0
              ? `Each of the ${plural(all.length, "callback")} had a thread of its own, and each of their threads one callback.`
              : ran.length === 1
                ? `The callback that ran had a thread of its own${others}`
                : `All ${plural(ran.length, "callback")} that ran had a thread of their own${others}`,
        ),
      ),
    );
  }
  const say = (list, text) => list.length && lines.push(sentence("INCONCLUSIVE", `${text(list)}: ${named(list)}.`));
  say(
    unknown.filter(c => !hasNamedThreads(c)),
    list => `The trace does not name the threads of ${plural(list.length, "callback")}`,
  );
  say(
    unknown.filter(hasNamedThreads),
    list =>
      `Whether ${plural(list.length, "callback")} had a thread of ${list.length === 1 ? "its" : "their"} own is not known, for the thread may also have served a client or an action of ROS 2`,
  );
  return lines;
};
// Rules of timing and of queues demand that callbacks keep up; all others are about how they are run.
const isOfTiming = rule => /^[RQ]/.test(rule.id);
const isAccused = rule => claims.accused.includes(rule.id);
export const inShort = () => {
  const lines = [];
  const failing = verdicts.rules.filter(r => r.verdict === "FAIL");
  const open = verdicts.rules.filter(r => r.verdict === "INCONCLUSIVE");
  const accused = failing.filter(isAccused);
  const others = failing.filter(r => !isAccused(r));
  const enforced = verdicts.rules.filter(r => !isOfTiming(r));
  const isBroken = failing.some(r => !isOfTiming(r));
  const isEnforcementOpen = open.some(r => !isOfTiming(r));
  for (const [rules, verdict, says, sign] of [
    [accused.filter(r => !isOfTiming(r)), "FAIL", claims.claimed ? "Enforcement does not hold: " : ""],
    [accused.filter(isOfTiming), "FAIL", claims.claimed ? "Timing does not hold: " : ""],
    [
      others,
      "FAIL",
      "No executor and no spec claims that callbacks have threads of their own. cie verify demands it all the same: ",
      "NOT_APPLICABLE",
    ],
    [
      open,
      "INCONCLUSIVE",
      isBroken ? "" : `Whether ${isEnforcementOpen ? "enforcement" : "timing"} holds is not decided: `,
    ],
  ]) {
    if (rules.length)
      lines.push(
        sentence(
          sign || verdict,
          says,
          `${plural(rules.length, "rule")} ${rules.length === 1 ? WORD[verdict] : WORD[verdict].replace("is ", "are ")}: `,
          rules.map(r => `${r.id} ${r.name}`).join(", "),
          ". ",
          el("a", {href: "#rules"}, "Evidence"),
        ),
      );
  }
  if (![...failing, ...open].some(r => !isOfTiming(r))) {
    const isAllKept = !failing.length && !open.length;
    const kept = (isAllKept ? verdicts.rules : enforced).filter(r => r.verdict === "PASS");
    lines.push(
      sentence(
        "PASS",
        `Enforcement holds: ${plural(kept.length, "rule")} ${isAllKept ? "" : "about it "}passed, none is violated or undecided.`,
      ),
    );
  }
  lines.push(...isolation());
  const worst = worstIndex();
  if (worst >= 0) {
    const c = report.callbacks[worst];
    const r = responseTime(c, "max");
    const deadline = c.response_deadline_ns;
    const half = responseTime(c, "p50");
    const most = responseTime(c, "p99");
    const isLate = deadline !== null && r.ns > deadline;
    const lane = laneOf(worst);
    const i = lane ? worstRun(lane) : undefined;
    const parts = i === undefined ? [] : partsOf(lane, i).sort((a, b) => b[2] - a[2]);
    const took = r.isBound
      ? ` took at least ${time(r.ns)} from release to end at worst; when it was released is not known exactly`
      : ` took ${time(r.ns)} from release to end at worst (half took at most ${time(half.ns)}, 99\u202f% at most ${time(most.ns)})`;
    lines.push(
      sentence(
        isLate ? "FAIL" : "NOT_APPLICABLE",
        isLate ? "Worst against its deadline: " : "Slowest: ",
        link(name(c), () => choose(worst, true), fullName(c)),
        took,
        deadline === null || (r.isBound && !isLate)
          ? ""
          : `, ${isLate ? "beyond" : "within"} its deadline of ${time(deadline)}`,
        ". ",
        parts.length > 1
          ? `Most of it: ${parts[0][0]}, ${time(parts[0][2])} (${percent(parts[0][2] / lane.least(i))})${why(lane, i, parts[0])}. `
          : "",
        i === undefined ? "" : link("Show it", () => timeline.show(lane, i)),
      ),
    );
  }
  const missed = report.callbacks
    .filter(c => c.missed_releases > 0)
    .sort((a, b) => b.missed_releases - a.missed_releases);
  const isBad = c => claims.claimed && missedTooMany(c);
  for (const [those, verdict, timer] of [
    [missed.filter(isBad), "FAIL", "timer"],
    [missed.filter(c => !isBad(c)), "NOT_APPLICABLE", missed.some(isBad) ? "other timer" : "timer"],
  ]) {
    const releases = those.reduce((n, c) => n + c.missed_releases, 0);
    if (those.length)
      lines.push(
        sentence(
          verdict,
          `${plural(releases, "release")} of ${plural(those.length, timer)} ${releases === 1 ? "was" : "were"} missed: ${those
            .slice(0, 3)
            .map(c => (those.length > 1 ? `${count(c.missed_releases)} of ${name(c)}` : name(c)))
            .join(", ")}${those.length > 3 ? " and others" : ""}.`,
        ),
      );
  }
  for (const d of report.defects.filter(d => d.severity !== "info")) {
    lines.push(
      sentence(
        "INCONCLUSIVE",
        `The trace has a defect, ${d.kind}${d.count > 1 ? ` (${count(d.count)} times)` : ""}: ${d.advice}`,
      ),
    );
  }
  page.append(el("ul", {class: "short", id: "short", "aria-label": "In short"}, lines));
};

// --- rules --------------------------------------------------------------------------------------
export const rules = () => {
  const of = verdict => verdicts.rules.filter(r => r.verdict === verdict);
  const chips = listed => {
    const items = listed.flatMap(v =>
      of(v).map(r => el("li", {class: COLOUR[v], title: `${r.name} ${WORD[v]}`}, `${SIGN[v]} ${r.id} ${r.name}`)),
    );
    return items.length ? el("ul", {class: "chips"}, items) : null;
  };
  // What holds needs no room.
  const kept = [
    ["PASS", "passes", "pass"],
    ["NOT_APPLICABLE", "does not apply", "do not apply"],
  ]
    .filter(([v]) => of(v).length)
    .map(([v, one, many]) => `${SIGN[v]} ${plural(of(v).length, "rule")} ${of(v).length === 1 ? one : many}`);
  const folded = kept.length
    ? el("details", {}, el("summary", {}, kept.join(", ")), chips(["PASS", "NOT_APPLICABLE"]))
    : null;
  const FIRST = 2;
  const MOST = 100;
  const where = e =>
    [
      e.event,
      // An event is of its host's clock, the trace of one of several.
      e.time_ns === null || lanes.begin_ns === null || severalHosts
        ? null
        : `${time(e.time_ns - lanes.begin_ns)} into the trace`,
      e.cpu === null || e.cpu === undefined ? null : `CPU ${e.cpu}`,
      e.tid === null || e.tid === undefined ? null : `thread ${e.tid}`,
    ]
      .filter(Boolean)
      .join(", ");
  const told = s => [
    el("p", {title: s.name ?? s.subject}, inWords(s.name ?? s.subject), ` (${count(s.checked)} checked)`),
    el(
      "ul",
      {class: "evidence"},
      s.evidence
        .slice(0, 3)
        .map(e =>
          el("li", {title: e.note || null}, inWords(e.note) || e.event, el("span", {class: "soft"}, ` (${where(e)})`)),
        ),
      s.evidence.length > 3
        ? el("li", {class: "soft"}, `and ${count(s.evidence.length - 3)} more: cie verify ${input} --format json`)
        : null,
    ),
  ];
  const findings = ["FAIL", "INCONCLUSIVE"].flatMap(v =>
    verdicts.rules
      .filter(r => r.verdict === v)
      .map(r => {
        const order = v === "FAIL" ? shortNames.order[r.id] : undefined;
        const subjects = order ? order.map(i => r.subjects[i]) : r.subjects.filter(s => s.verdict === v);
        const remedy = v === "FAIL" ? claims.remedies[r.id] : undefined;
        return el(
          "details",
          {open: v === "FAIL" && isAccused(r)},
          el(
            "summary",
            {class: COLOUR[v]},
            `${SIGN[v]} ${r.id} ${r.name} ${WORD[v]}: ${plural(subjects.length, "subject")}`,
          ),
          subjects.slice(0, FIRST).map(told),
          subjects.length > FIRST
            ? el(
                "details",
                {},
                el("summary", {}, `${plural(subjects.length - FIRST, "more subject")}`),
                subjects.slice(FIRST, MOST).map(told),
                subjects.length > MOST
                  ? el("p", {class: "soft"}, `and ${count(subjects.length - MOST)} more: cie verify ${input}`)
                  : null,
              )
            : null,
          remedy ? el("p", {class: "remedy"}, `\u2192 ${remedy}`) : null,
        );
      }),
  );
  section("rules", "Which rules hold?", chips(["FAIL", "INCONCLUSIVE"]), findings, folded);
};
