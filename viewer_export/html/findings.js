
// --- the first minute: verdict, worst callback, what is missing ---------------------------------
const byResponse = (a, b) => (b.response_time_ns ? b.response_time_ns.max : -1) - (a.response_time_ns ? a.response_time_ns.max : -1);
const worstIndex = () => {
  const late = facts.callbacks.map((f, i) => [f.deadline_ns && report.callbacks[i].response_time_ns
    ? report.callbacks[i].response_time_ns.max / f.deadline_ns : 0, i]).filter(x => x[0] > 1);
  if (late.length) return late.sort((a, b) => b[0] - a[0])[0][1];
  const worst = [...report.callbacks].sort(byResponse)[0];
  return worst && worst.response_time_ns ? report.callbacks.indexOf(worst) : -1;
};
const sentence = (verdict, ...text) => el("li", {}, el("span", {class: `sign ${COLOUR[verdict]}`, "aria-hidden": "true"}, SIGN[verdict]), text);
const link = (text, action) => el("button", {class: "link", type: "button", onclick: action}, text);

const head = () => {
  const t = report.trace;
  const began = facts.clock_offset_ns !== null && t.begin_ns !== null
    ? new Date((t.begin_ns + facts.clock_offset_ns) / 1e6).toISOString().replace("T", " ").slice(0, 19) + " UTC, " : "";
  page.append(el("header", {class: "head"},
    el("div", {}, el("h1", {}, "Callback report"),
      el("p", {class: "soft"}, t.paths.join(", "), el("br"),
        `${began}${t.begin_ns === null ? "no packets" : time(t.end_ns - t.begin_ns)}, ${plural(t.events, "event")}, `,
        `${plural(report.processes.length, "process", "processes")} on ${t.hosts.join(", ") || "an unnamed host"}`,
        facts.spec === null ? ", without a scheduling spec" : `, against ${facts.spec}`)),
    el("div", {class: `verdict ${COLOUR[verdicts.verdict]}`, id: "verdict"}, `${SIGN[verdicts.verdict]} ${verdicts.verdict}`)));
};
// Who is to blame for the longest part of an instance's response time, as far as the recording shows it.
const why = (lane, i, [, kind, ns]) => {
  if (kind === "preempted") {
    const by = facts.callbacks[lane.callback].preempted_by[0];
    return by ? `; over all its runs mostly ${by.name || "thread " + by.tid} ran instead` : "";
  }
  if (kind !== "wait") return "";
  const others = waitedFor(lane, i), sum = others.reduce((all, [, part]) => all + part, 0);
  if (sum < ns / 5) return sum === 0 ? ", though no callback ran on its thread" : "";
  const [first, longest] = others[0];
  return `, while its thread ran ${first === lane ? "an earlier release of itself" : first.title} for ${time(longest)}`
    + (others.length > 1 ? ` and ${plural(others.length - 1, "other")} for ${time(sum - longest)}` : "");
};
const inShort = () => {
  const lines = [];
  const isolated = report.callbacks.filter(c => c.isolated).length, all = report.callbacks.length;
  const failing = verdicts.rules.filter(r => r.verdict === "FAIL"), open = verdicts.rules.filter(r => r.verdict === "INCONCLUSIVE");
  for (const [rules, verdict, says] of [[failing, "FAIL", "Enforcement does not hold: "], [open, "INCONCLUSIVE", failing.length ? "" : "Whether enforcement holds is not decided: "]]) {
    if (rules.length) lines.push(sentence(verdict, says, `${plural(rules.length, "rule")} ${rules.length === 1 ? WORD[verdict] : WORD[verdict].replace("is ", "are ")}: `,
      rules.map(r => `${r.id} ${r.name}`).join(", "), ". ", el("a", {href: "#rules"}, "Evidence")));
  }
  if (!failing.length && !open.length) lines.push(sentence("PASS", `Enforcement holds: ${plural(verdicts.rules.filter(r => r.verdict === "PASS").length, "rule")} passed, none is violated or undecided.`));
  if (all === 0) lines.push(sentence("INCONCLUSIVE", "No callback was seen in this recording."));
  else if (isolated === all) lines.push(sentence("PASS", `Each of the ${plural(all, "callback")} had a thread of its own, and each of their threads one callback.`));
  else {
    const shared = report.callbacks.filter(c => !c.isolated).map(title);
    lines.push(sentence("FAIL", `${count(all - isolated)} of ${plural(all, "callback")} did not have a thread of their own: ${shared.slice(0, 3).join(", ")}${shared.length > 3 ? " and others" : ""}.`));
  }
  const worst = worstIndex();
  if (worst >= 0) {
    const c = report.callbacks[worst], r = c.response_time_ns, deadline = facts.callbacks[worst].deadline_ns;
    const lane = laneOf(worst), i = lane ? slowest(lane, 1)[0] : undefined;
    const parts = i === undefined ? [] : partsOf(lane, i).sort((a, b) => b[2] - a[2]);
    lines.push(sentence(deadline !== null && r.max > deadline ? "FAIL" : "NOT_APPLICABLE",
      "Slowest: ", link(title(c), () => choose(worst, true)), ` took ${time(r.max)} from release to end at worst (half took at most ${time(r.p50)}, 99\u202f% at most ${time(r.p99)})`,
      deadline === null ? "" : `, ${r.max > deadline ? "beyond" : "within"} its deadline of ${time(deadline)}`, ". ",
      parts.length ? `In that run it ${parts[0][0] === "preempted" ? "was " : ""}${parts[0][0]} for ${time(parts[0][2])}, ${percent(parts[0][2] / lane.response(i))} of it${why(lane, i, parts[0])}. ` : "",
      i === undefined ? "" : link("Show it", () => timeline.show(lane, i))));
  }
  const missed = report.callbacks.filter(c => c.missed_releases > 0);
  if (missed.length) lines.push(sentence("FAIL", `${plural(missed.reduce((n, c) => n + c.missed_releases, 0), "release")} of ${plural(missed.length, "timer")} ${missed.length === 1 ? "was" : "were"} missed: ${missed.slice(0, 3).map(title).join(", ")}${missed.length > 3 ? " and others" : ""}.`));
  for (const d of report.defects.filter(d => d.severity !== "info")) {
    lines.push(sentence("INCONCLUSIVE", `The trace has a defect, ${d.kind}${d.count > 1 ? ` (${count(d.count)} times)` : ""}: ${d.advice}`));
  }
  page.append(el("ul", {class: "short", id: "short", "aria-label": "In short"}, lines));
};

// --- rules --------------------------------------------------------------------------------------
const rules = () => {
  const chips = ["FAIL", "INCONCLUSIVE", "PASS", "NOT_APPLICABLE"].flatMap(v => verdicts.rules.filter(r => r.verdict === v)
    .map(r => el("li", {class: COLOUR[v], title: `${r.name} ${WORD[v]}`}, `${SIGN[v]} ${r.id} ${r.name}`)));
  const FIRST = 2, MOST = 100;
  const where = e => [e.event, report.trace.begin_ns === null ? null : `${time(e.time_ns - report.trace.begin_ns)} into the trace`, e.cpu === null || e.cpu === undefined ? null : `CPU ${e.cpu}`, e.tid === null || e.tid === undefined ? null : `thread ${e.tid}`].filter(Boolean).join(", ");
  const told = s => [el("p", {}, s.subject, ` (${count(s.checked)} checked)`),
    el("ul", {class: "evidence"}, s.evidence.slice(0, 3).map(e => el("li", {}, e.note || e.event, el("span", {class: "soft"}, ` (${where(e)})`))),
      s.evidence.length > 3 ? el("li", {class: "soft"}, `and ${count(s.evidence.length - 3)} more: cie verify --format json`) : null)];
  const findings = ["FAIL", "INCONCLUSIVE"].flatMap(v => verdicts.rules.filter(r => r.verdict === v).map(r => {
    const subjects = r.subjects.filter(s => s.verdict === v);
    return el("details", {open: v === "FAIL"}, el("summary", {class: COLOUR[v]}, `${SIGN[v]} ${r.id} ${r.name} ${WORD[v]}: ${plural(subjects.length, "subject")}`),
      subjects.slice(0, FIRST).map(told),
      subjects.length > FIRST ? el("details", {}, el("summary", {}, `${plural(subjects.length - FIRST, "more subject")}`), subjects.slice(FIRST, MOST).map(told),
        subjects.length > MOST ? el("p", {class: "soft"}, `and ${count(subjects.length - MOST)} more: cie verify`) : null) : null);
  }));
  section("rules", "Does enforcement hold?", el("ul", {class: "chips"}, chips), findings);
};
