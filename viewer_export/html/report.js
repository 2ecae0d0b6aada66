
"use strict";
(() => {
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

  // --- what the timeline knows: columns of numbers per lane ---------------------------------------
  // Unknown is NaN. Times are relative to lanes.base_ns.
  const decode = async () => {
    const text = document.getElementById("columns").textContent;
    const packed = Uint8Array.from(atob(text), c => c.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
    let at = 0;
    const number = () => {
      let value = 0, scale = 1, byte;
      do { byte = bytes[at++]; value += (byte & 127) * scale; scale *= 128; } while (byte & 128);
      return value;
    };
    const signed = value => value % 2 ? -(value + 1) / 2 : value / 2;
    const optional = () => { const value = number(); return value === 0 ? NaN : signed(value - 1); };
    for (const lane of lanes.lanes) {
      const column = read => { const c = new Float64Array(lane.count); for (let i = 0; i < c.length; ++i) c[i] = read(i); return c; };
      let before = 0;
      lane.start = column(() => before += signed(number()));
      lane.wait = column(optional);
      lane.duration = column(optional);
      lane.execution = column(optional);
      lane.preempted = column(optional);
      lane.blocked = column(optional);
      lane.wake = column(optional);
      let seq = 0;
      lane.seq = column(() => seq += signed(number()));
      const place = column(number);
      lane.tid = i => lane.tids[Math.floor(place[i] / 2)];
      lane.isExact = i => place[i] % 2 === 1;
      lane.response = i => lane.isExact(i) ? lane.wait[i] + lane.duration[i] : NaN;
      lane.callbackReport = lane.callback === null ? null : report.callbacks[lane.callback];
      lane.title = lane.callbackReport ? title(lane.callbackReport) : lane.logical_id || "callback that was never registered";
      lane.deadline = lane.callback === null ? null : facts.callbacks[lane.callback].deadline_ns;
      lane.isLate = i => lane.deadline !== null && lane.response(i) > lane.deadline;
    }
  };
  const laneOf = callback => lanes.lanes.find(lane => lane.callback === callback);
  // Numbers of a lane's instances, slowest first.
  const slowest = (lane, n) => {
    const known = [];
    for (let i = 0; i < lane.count; ++i) if (!Number.isNaN(lane.response(i))) known.push(i);
    known.sort((a, b) => lane.response(b) - lane.response(a) || a - b);
    return known.slice(0, n);
  };
  // Where an instance's response time went: [what, its class, ns]. The parts add up to it.
  const partsOf = (lane, i) => {
    const parts = [["waited to start", "wait", lane.wait[i]]];
    if (Number.isNaN(lane.execution[i])) {
      parts.push(["ran or was kept from running", "run", lane.duration[i]]);
    } else {
      parts.push(["executed", "run", lane.execution[i]], ["preempted", "preempted", lane.preempted[i]],
                 ["blocked", "blocked", lane.blocked[i]], ["waited for a CPU after waking", "wake", lane.wake[i]]);
    }
    return parts.filter(part => part[2] > 0);
  };

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
  const inShort = () => {
    const lines = [];
    const isolated = report.callbacks.filter(c => c.isolated).length, all = report.callbacks.length;
    const failing = verdicts.rules.filter(r => r.verdict === "FAIL"), open = verdicts.rules.filter(r => r.verdict === "INCONCLUSIVE");
    if (all === 0) lines.push(sentence("INCONCLUSIVE", "No callback was seen in this recording."));
    else if (isolated === all) lines.push(sentence("PASS", `Each of the ${plural(all, "callback")} had a thread of its own, and each of their threads one callback.`));
    else {
      const shared = report.callbacks.filter(c => !c.isolated).map(title);
      lines.push(sentence("FAIL", `${count(all - isolated)} of ${plural(all, "callback")} did not have a thread of their own: ${shared.slice(0, 3).join(", ")}${shared.length > 3 ? " and others" : ""}.`));
    }
    for (const [rules, verdict] of [[failing, "FAIL"], [open, "INCONCLUSIVE"]]) {
      if (rules.length) lines.push(sentence(verdict, `${plural(rules.length, "rule")} ${rules.length === 1 ? WORD[verdict] : WORD[verdict].replace("is ", "are ")}: `,
        rules.map(r => `${r.id} ${r.name}`).join(", "), ". ", el("a", {href: "#rules"}, "Evidence")));
    }
    if (!failing.length && !open.length) lines.push(sentence("PASS", `Enforcement holds: ${plural(verdicts.rules.filter(r => r.verdict === "PASS").length, "rule")} passed, none is violated or undecided.`));
    const worst = worstIndex();
    if (worst >= 0) {
      const c = report.callbacks[worst], r = c.response_time_ns, deadline = facts.callbacks[worst].deadline_ns;
      const lane = laneOf(worst), i = lane ? slowest(lane, 1)[0] : undefined;
      const parts = i === undefined ? [] : partsOf(lane, i).sort((a, b) => b[2] - a[2]);
      const by = facts.callbacks[worst].preempted_by[0];
      lines.push(sentence(deadline !== null && r.max > deadline ? "FAIL" : "NOT_APPLICABLE",
        "Slowest: ", link(title(c), () => choose(worst, true)), ` took ${time(r.max)} from release to end at worst (half took at most ${time(r.p50)}, 99\u202f% at most ${time(r.p99)})`,
        deadline === null ? "" : `, ${r.max > deadline ? "beyond" : "within"} its deadline of ${time(deadline)}`, ". ",
        parts.length ? `In that run it ${parts[0][0] === "preempted" ? "was " : ""}${parts[0][0]} for ${time(parts[0][2])}, ${percent(parts[0][2] / lane.response(i))} of it` : "",
        parts.length && parts[0][1] === "preempted" && by ? `; over all its runs mostly ${by.name || "thread " + by.tid} ran instead` : "", parts.length ? ". " : "",
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

  // --- callbacks ----------------------------------------------------------------------------------
  const stat = (c, key, which) => c[key] === null ? null : c[key][which];
  const COLUMNS = [
    ["callback", c => title(c), "text"], ["isolated", c => c.isolated ? "yes" : "NO", "text"], ["threads", c => c.threads.length], ["runs", c => c.instances],
    ["response p50", c => stat(c, "response_time_ns", "p50"), "time"], ["response p99", c => stat(c, "response_time_ns", "p99"), "time"],
    ["response max", c => stat(c, "response_time_ns", "max"), "time"], ["deadline", (c, i) => facts.callbacks[i].deadline_ns, "time"],
    ["start latency max", c => stat(c, "start_latency_ns", "max"), "time"], ["execution max", c => stat(c, "execution_time_ns", "max"), "time"],
    ["preempted max", c => stat(c, "preempted_ns", "max"), "time"], ["blocked max", c => stat(c, "blocked_ns", "max"), "time"],
    ["missed", c => c.missed_releases]];
  let chosen = -1, detail, rows = [];
  const callbacks = () => {
    if (!report.callbacks.length) return;
    const shown = COLUMNS.filter(([, get]) => report.callbacks.some((c, i) => get(c, i) !== null));
    const body = el("tbody");
    rows = report.callbacks.map((c, i) => el("tr", {}, shown.map(([name, get, kind], at) => {
      const value = get(c, i);
      if (at === 0) return el("td", {class: "name"}, link(value, () => choose(i)));
      if (name === "isolated") return el("td", {class: `text ${c.isolated ? "pass" : "fail"}`}, `${c.isolated ? SIGN.PASS : SIGN.FAIL} ${value}`);
      const isLate = name === "response max" && facts.callbacks[i].deadline_ns !== null && value > facts.callbacks[i].deadline_ns;
      const text = value === null ? "\u2013" : kind === "time" ? time(value) : count(value);
      return el("td", {class: isLate || name === "missed" && value > 0 ? "fail" : null, "data-ns": kind === "time" ? value : null}, isLate ? `${SIGN.FAIL} ${text}` : text);
    })));
    let order = report.callbacks.map((_, i) => i);
    const state = el("p", {class: "soft", role: "status"});
    const draw = () => {
      const words = filter.value.toLowerCase().split(/\s+/).filter(Boolean);
      const visible = order.filter(i => words.every(w => title(report.callbacks[i]).toLowerCase().includes(w)));
      body.replaceChildren(...visible.map(i => rows[i]));
      state.textContent = visible.length === order.length ? "" : `${count(visible.length)} of ${plural(order.length, "callback")}`;
    };
    const sort = (at, direction) => {
      const [, get] = shown[at];
      const value = i => get(report.callbacks[i], i);
      order.sort((a, b) => {
        const x = value(a), y = value(b);
        if (x === y) return a - b;
        if (x === null) return 1;
        if (y === null) return -1;
        return (x < y ? -1 : 1) * direction;
      });
      headers.forEach((h, i) => i === at ? h.setAttribute("aria-sort", direction > 0 ? "ascending" : "descending") : h.removeAttribute("aria-sort"));
      draw();
    };
    const headers = shown.map(([name, , kind], at) => el("th", {scope: "col", class: kind === "text" ? "text" : null},
      el("button", {type: "button", onclick: () => sort(at, headers[at].getAttribute("aria-sort") === "descending" || (at === 0 && !headers[at].hasAttribute("aria-sort")) ? 1 : -1)}, name)));
    const filter = el("input", {type: "search", placeholder: "Filter by name", "aria-label": "Filter callbacks by name", oninput: draw});
    detail = el("div", {class: "detail", "aria-live": "polite"});
    section("callbacks", "Callbacks", el("div", {class: "bar"}, filter, state),
      el("div", {class: "scroll tall", tabindex: "0", role: "region", "aria-label": "Table of callbacks"}, el("table", {id: "callback-table"}, el("thead", {}, el("tr", {}, headers)), body)),
      el("p", {class: "soft"}, "Response time: from release to end. Start latency: from release to start. \u2013: not measured."), detail);
    const byMax = shown.findIndex(([name]) => name === "response max");
    sort(byMax < 0 ? 0 : byMax, byMax < 0 ? 1 : -1);
  };

  // --- one callback: histogram, ECDF, where the time goes, slowest runs ----------------------------
  const axisTicks = (low, high) => {
    const ticks = [];
    for (let e = Math.floor(low); e <= Math.ceil(high); ++e)
      for (const step of high - low < 1.7 ? [1, 2, 5] : [1]) { const at = e + Math.log10(step); if (at >= low && at <= high) ticks.push(at); }
    return ticks;
  };
  const histogram = (c, f) => {
    const W = 640, H = 210, left = 46, right = 40, top = 18, bottom = 34, per = facts.bins_per_decade;
    const first = f.responses[0][0], last = f.responses[f.responses.length - 1][0] + 1;
    const deadline = f.deadline_ns === null ? null : Math.log10(f.deadline_ns);
    const low = Math.min(first / per, deadline ?? Infinity) - .05, high = Math.max(last / per, deadline ?? -Infinity) + .05;
    const x = e => left + (e - low) / (high - low) * (W - left - right);
    const most = Math.max(...f.responses.map(b => b[1])), all = f.responses.reduce((n, b) => n + b[1], 0);
    const y = n => H - bottom - n / most * (H - top - bottom), share = s => H - bottom - s * (H - top - bottom);
    let sum = 0, path = `M${x(first / per)},${share(0)}`;
    for (const [bin, n] of f.responses) { path += `L${x(bin / per)},${share(sum / all)}`; sum += n; path += `L${x((bin + 1) / per)},${share(sum / all)}`; }
    const marks = [["p50", c.response_time_ns.p50, "middle"], ["p99", c.response_time_ns.p99, "end"], ["max", c.response_time_ns.max, "start"]];
    const id = `hist-${report.callbacks.indexOf(c)}`;
    return svg("svg", {viewBox: `0 0 ${W} ${H}`, role: "img", "aria-labelledby": id},
      svg("title", {id}, `Response times of ${title(c)}: ${count(all)} runs, p50 ${time(c.response_time_ns.p50)}, p99 ${time(c.response_time_ns.p99)}, max ${time(c.response_time_ns.max)}`),
      svg("line", {class: "axis", x1: left, x2: W - right, y1: H - bottom, y2: H - bottom}),
      axisTicks(low, high).map(e => [svg("line", {class: "axis", x1: x(e), x2: x(e), y1: top, y2: H - bottom + 4}), svg("text", {class: "soft", x: x(e), y: H - bottom + 16, "text-anchor": "middle"}, time(Math.pow(10, e)).replace(/\.0+(?=\u202f)/, ""))]),
      f.responses.map(([bin, n]) => svg("rect", {class: "f-run", x: x(bin / per) + .3, width: Math.max(x((bin + 1) / per) - x(bin / per) - .6, .8), y: y(n), height: H - bottom - y(n)}, svg("title", {}, `${time(Math.pow(10, bin / per))} to ${time(Math.pow(10, (bin + 1) / per))}: ${plural(n, "run")}`))),
      svg("path", {class: "ecdf", d: path}),
      svg("text", {class: "soft", x: left - 6, y: y(most) + 4, "text-anchor": "end"}, count(most)), svg("text", {class: "soft", x: left - 6, y: H - bottom, "text-anchor": "end"}, "0"),
      svg("text", {class: "soft", x: W - right + 5, y: share(1) + 4}, "100\u202f%"), svg("text", {class: "soft", x: W - right + 5, y: H - bottom}, "0"),
      marks.map(([name, ns, anchor]) => { const at = Math.min(Math.max(x(Math.log10(Math.max(ns, 1))), left), W - right);
        return [svg("line", {class: "axis", x1: at, x2: at, y1: top - 4, y2: H - bottom}), svg("text", {x: at, y: top - 6, "text-anchor": anchor}, name)]; }),
      deadline === null ? null : [svg("line", {class: "mark", x1: x(deadline), x2: x(deadline), y1: top, y2: H - bottom}), svg("text", {x: x(deadline) + 4, y: top + 12}, `deadline ${time(f.deadline_ns)}`)],
      svg("text", {class: "soft", x: (left + W - right) / 2, y: H - 3, "text-anchor": "middle"}, "response time (bars: runs, left; line: share of runs at most as long, right)"));
  };
  const stack = (parts, text) => {
    const all = parts.reduce((sum, part) => sum + part[2], 0);
    let at = 0;
    return el("div", {}, svg("svg", {viewBox: "0 0 640 22", role: "img", "aria-label": `${text}: ${parts.map(p => `${p[0]} ${time(p[2])}`).join(", ")}`},
      parts.map(([what, kind, ns]) => { const w = ns / all * 640, r = svg("rect", {class: `f-${kind}`, x: at, width: w, y: 0, height: 22}, svg("title", {}, `${what}: ${time(ns)}`)); at += w; return r; })),
    el("div", {class: "key"}, parts.map(([what, kind, ns]) => el("span", {}, svg("svg", {width: 11, height: 11, "aria-hidden": "true"}, svg("rect", {class: `f-${kind}`, width: 11, height: 11})), `${what} ${time(ns)} (${percent(ns / all)})`))));
  };
  const meanParts = c => {
    const mean = key => c[key] === null ? 0 : c[key].mean;
    const parts = [["waited to start", "wait", mean("start_latency_ns")]];
    if (c.execution_time_ns === null) parts.push(["ran or was kept from running", "run", mean("duration_ns")]);
    else parts.push(["executed", "run", mean("execution_time_ns")], ["preempted", "preempted", mean("preempted_ns")], ["blocked", "blocked", mean("blocked_ns")], ["waited for a CPU after waking", "wake", mean("wake_delay_ns")]);
    return parts.filter(part => part[2] > 0);
  };
  const choose = (index, scroll) => {
    if (chosen >= 0) rows[chosen].classList.remove("chosen");
    chosen = index;
    rows[index].classList.add("chosen");
    const c = report.callbacks[index], f = facts.callbacks[index], lane = laneOf(index);
    const threads = c.threads.map(t => `${t.name || "thread"} ${t.tid} (${plural(t.instances, "run")})`).join(", ");
    const worst = lane ? slowest(lane, 8) : [], parts = meanParts(c);
    detail.replaceChildren(...[
      el("h3", {id: "detail"}, title(c)),
      el("p", {class: "soft"}, [`${c.kind}${c.source ? ` on ${c.source}` : ""} of ${c.node || "no node"}`, c.period_ns === null ? null : `period ${time(c.period_ns)}`, c.symbol || null, threads ? `threads: ${threads}` : null].filter(Boolean).join("; ")),
      el("div", {class: "two"},
        el("div", {}, c.response_time_ns === null || !f.responses.length ? el("p", {}, "Its response times are not known exactly: the trace does not say when its runs were released.") : histogram(c, f)),
        el("div", {}, parts.length ? [el("p", {}, "Where the time goes, on average:"), stack(parts, "Where the time goes")] : null,
          f.preempted_by.length ? el("p", {}, "Preempted by: ", f.preempted_by.slice(0, 4).map(p => `${p.name || "thread"} ${p.tid} ${time(p.ns)}`).join(", "), " (all runs)") : null,
          c.execution_time_ns === null ? el("p", {class: "soft"}, "Who ran meanwhile is not known: record with cie record --kernel=yes.") : null)),
      worst.length ? el("div", {class: "scroll"}, el("table", {}, el("caption", {}, "Slowest runs"), el("thead", {}, el("tr", {}, ["run", "response", "waited", "ran for", "executed", "preempted", "blocked", "thread", ""].map(h => el("th", {scope: "col"}, h)))),
        el("tbody", {}, worst.map(i => el("tr", {}, el("td", {}, `#${count(lane.seq[i])}`), [lane.response(i), lane.wait[i], lane.duration[i], lane.execution[i], lane.preempted[i], lane.blocked[i]].map((ns, at) => el("td", {class: at === 0 && lane.isLate(i) ? "fail" : null}, Number.isNaN(ns) ? "\u2013" : time(ns))),
          el("td", {}, lane.tid(i)), el("td", {class: "text"}, link("show", () => timeline.show(lane, i)))))))) : null].filter(Boolean));
    if (scroll) detail.scrollIntoView({block: "nearest"});
  };

  // --- which callback ran on which thread -----------------------------------------------------------
  const matrix = () => {
    if (!report.callbacks.length) return;
    const columns = [...new Map(report.callbacks.flatMap(c => c.threads.map(t => [`${c.pid}/${t.tid}`, {pid: c.pid, tid: t.tid, name: t.name}]))).entries()]
      .sort((a, b) => a[1].pid - b[1].pid || a[1].tid - b[1].tid);
    const place = new Map(columns.map(([key], i) => [key, i]));
    const load = columns.map(([key]) => report.callbacks.filter(c => c.threads.some(t => `${c.pid}/${t.tid}` === key)).length);
    const cell = Math.max(4, Math.min(18, Math.floor(760 / Math.max(columns.length, 1)))), row = Math.max(6, Math.min(18, cell));
    const label = row >= 11 ? 300 : 0, W = label + columns.length * cell + 8, H = 16 + report.callbacks.length * row + 4;
    section("matrix", "Which callback ran on which thread",
      el("p", {class: "soft"}, "A row for each callback, a column for each thread. Isolated: one mark in its row, one in its column; red marks are not."),
      el("div", {class: "scroll tall"}, svg("svg", {viewBox: `0 0 ${W} ${H}`, width: W, height: H, class: "wide", role: "img", "aria-label": `Matrix of ${plural(report.callbacks.length, "callback")} and ${plural(columns.length, "thread")}`},
        columns.map((_, i) => i % 5 === 0 ? svg("line", {class: "axis", x1: label + i * cell, x2: label + i * cell, y1: 10, y2: H}) : null),
        report.callbacks.map((c, r) => [
          label ? svg("text", {x: label - 6, y: 16 + r * row + row * .72, "text-anchor": "end"}, title(c).length > 48 ? "\u2026" + title(c).slice(-47) : title(c), svg("title", {}, title(c))) : null,
          label === 0 ? null : svg("line", {class: "axis", x1: label, x2: W - 8, y1: 16 + r * row + row / 2, y2: 16 + r * row + row / 2}),
          c.threads.map(t => { const at = place.get(`${c.pid}/${t.tid}`), isAlone = c.threads.length === 1 && load[at] === 1;
            return svg("rect", {class: isAlone ? "f-run" : "f-fail", x: label + at * cell + 1, y: 16 + r * row + 1, width: cell - 2, height: row - 2, rx: isAlone ? 2 : 0},
              svg("title", {}, `${title(c)} on ${t.name || "thread"} ${t.tid}: ${plural(t.instances, "run")}${isAlone ? "" : ", not isolated"}`)); })]))));
  };

  // --- chains -----------------------------------------------------------------------------------------
  const graph = () => {
    // By process and id, as the report's edges name them.
    const edges = new Map(), nodes = new Map(), key = n => `${n.pid} ${n.logical_id}`;
    for (const edge of facts.edges) {
      if (edge.from === null) continue;
      for (const end of [edge.from, edge.to]) nodes.set(key(end), end);
      edges.set(JSON.stringify([key(edge.from), key(edge.to), edge.topic]), [key(edge.from), key(edge.to), edge.communication_p50_ns, edge]);
    }
    if (!edges.size || nodes.size > 120) return null;
    const level = new Map([...nodes.keys()].map(n => [n, 0]));
    for (let round = 0; round < nodes.size; ++round) {
      let moved = false;
      for (const [from, to] of edges.values()) if (level.get(to) < level.get(from) + 1 && level.get(from) + 1 < nodes.size) { level.set(to, level.get(from) + 1); moved = true; }
      if (!moved) break;
    }
    const columns = [], at = new Map(), w = 214, h = 36, gapX = 84, gapY = 14;
    for (const [n, l] of level) (columns[l] ||= []).push(n);
    const used = columns.filter(Boolean);
    used.forEach((c, i) => {
      const before = n => { const p = [...edges.values()].filter(e => e[1] === n).map(e => at.get(e[0])?.y ?? 0); return p.length ? p.reduce((a, b) => a + b) / p.length : 0; };
      c.map(n => [before(n), n]).sort((a, b) => a[0] - b[0]).forEach(([, n], k) => at.set(n, {x: 4 + i * (w + gapX), y: 4 + k * (h + gapY)}));
    });
    const W = used.length * (w + gapX) - gapX + 8, H = Math.max(...used.map(c => c.length)) * (h + gapY) + 4;
    const cut = text => text.length > 32 ? "\u2026" + text.slice(-31) : text;
    const respondsIn = n => { const c = report.callbacks.find(c => c.pid === n.pid && c.logical_id === n.logical_id); return c && c.response_time_ns ? `: responds within ${time(c.response_time_ns.max)}` : ""; };
    const halves = n => { const i = n.indexOf("@"); return i < 0 ? [n, ""] : [n.slice(0, i), n.slice(i + 1)]; };
    return el("div", {class: "scroll"}, svg("svg", {viewBox: `0 0 ${W} ${H}`, width: W, height: H, class: "wide", role: "img", "aria-label": `Graph of ${plural(nodes.size, "callback")} linked by messages`},
      [...edges.values()].map(([from, to, ns, edge]) => { const a = at.get(from), b = at.get(to), x1 = a.x + w, y1 = a.y + h / 2, x2 = b.x, y2 = b.y + h / 2, m = Math.max(30, Math.abs(x2 - x1) / 2);
        return [svg("path", {d: `M${x1},${y1}C${x1 + m},${y1} ${x2 - m},${y2} ${x2},${y2}`, fill: "none", stroke: "currentColor", "stroke-opacity": .45}, svg("title", {}, `${edge.from.logical_id} to ${edge.to.logical_id} by ${edge.topic}: ${plural(edge.messages, "message")}${ns === null ? "" : `, ${time(ns)} in the middle`}`)),
          svg("text", {class: "soft", x: (x1 + x2) / 2, y: (y1 + y2) / 2 - 3, "text-anchor": "middle"}, ns === null ? "" : time(ns))]; }),
      [...at].map(([n, p]) => svg("g", {}, svg("title", {}, nodes.get(n).logical_id + respondsIn(nodes.get(n))), svg("rect", {class: "box", x: p.x, y: p.y, width: w, height: h, rx: 5}),
        halves(nodes.get(n).logical_id).map((text, line) => svg("text", {class: line ? "soft" : null, x: p.x + 7, y: p.y + 15 + 14 * line}, cut(text)))))));
  };
  const chains = () => {
    if (!report.chains.length) {
      const drawn = graph();
      if (drawn) section("chains", "Who takes whose messages", drawn);
      return;
    }
    // A chain without a name of its own is named by all its callbacks.
    const short = c => c.hops.length > 2 && c.name === c.hops.join(" -> ") ? `${c.hops[0]} \u2026 ${c.hops[c.hops.length - 1]}` : c.name;
    const cells = s => s === null ? ["\u2013", "\u2013", "\u2013"] : [time(s.p50), time(s.p99), time(s.max)];
    const header = names => el("thead", {}, el("tr", {}, names.map(n => el("th", {scope: "col"}, n))));
    section("chains", "Chains of callbacks", graph(),
      el("div", {class: "scroll"}, el("table", {id: "chain-table"}, header(["chain", "hops", "runs", "path latency p50", "p99", "max", "reaction time p50", "p99", "max", "data age p50", "p99", "max"]),
        el("tbody", {}, report.chains.map(c => el("tr", {}, el("td", {class: "name", title: c.name}, short(c)), el("td", {}, c.hops.length), el("td", {}, count(c.instances)), [c.path_latency_ns, c.reaction_time_ns, c.data_age_ns].flatMap(cells).map(t => el("td", {}, t))))))),
      report.chains.slice(0, 60).map(c => el("details", {}, el("summary", {}, `Where ${short(c)} spends its time`), el("div", {class: "scroll"}, el("table", {},
        header(["in", "p50", "p99", "max", "then to the next, p50", "p99", "max"]), el("tbody", {}, c.hop_table.map(hop => el("tr", {}, el("td", {class: "name"}, hop.from), [hop.processing_ns, hop.communication_ns].flatMap(cells).map(t => el("td", {}, t))))))))));
  };

  // --- threads ----------------------------------------------------------------------------------------
  const threads = () => {
    if (!report.threads.length) return;
    const sched = s => s === null ? "\u2013" : [s.policy_name || `policy ${s.policy}`, s.priority ? s.priority : null, s.nice ? `nice ${s.nice}` : null, s.runtime_ns ? `${time(s.runtime_ns)} of ${time(s.period_ns)}, deadline ${time(s.deadline_ns)}` : null, s.error ? `error ${s.error}` : null].filter(x => x !== null).join(" ");
    section("threads", "Threads", el("div", {class: "scroll tall", tabindex: "0", role: "region", "aria-label": "Table of threads"}, el("table", {}, el("thead", {}, el("tr", {}, ["thread", "pid", "tid", "role", "scheduling", "CPUs", "busy", "callbacks"].map((n, i) => el("th", {scope: "col", class: i > 2 && i !== 6 ? "text" : null}, n)))),
      el("tbody", {}, report.threads.map(t => el("tr", {}, el("td", {}, t.name || "\u2013"), el("td", {}, t.pid), el("td", {}, t.tid), el("td", {class: "text"}, t.role || "\u2013"), el("td", {class: "text"}, sched(t.sched)), el("td", {class: "text"}, t.sched === null ? "\u2013" : t.sched.cpus.join(" ")), el("td", {}, time(t.busy_ns)), el("td", {class: "text name"}, t.callbacks.join(", "))))))));
  };

  // --- timeline ---------------------------------------------------------------------------------------
  const timeline = {
    build() {
      if (!lanes.lanes.length) return;
      const kept = lanes.lanes.reduce((n, l) => n + l.count, 0), of = lanes.lanes.reduce((n, l) => n + l.of, 0);
      this.canvas = el("canvas", {tabindex: "0", role: "img", "aria-label": "Timeline of callbacks. Arrow keys move, plus and minus zoom, 0 shows everything."});
      this.tip = el("p", {class: "tip soft", role: "status"}, "Wheel or + and \u2212 zoom, dragging or arrow keys move, 0 shows everything. Point at a run to read it.");
      this.search = el("input", {type: "search", placeholder: "Lanes by name", "aria-label": "Show only lanes with this name", oninput: () => { this.top = 0; this.choose(); this.draw(); }});
      const button = (text, label, action) => el("button", {type: "button", "aria-label": label, onclick: action}, text);
      const colour = (kind, text) => el("span", {}, svg("svg", {width: 11, height: 11, "aria-hidden": "true"}, svg("rect", {class: `f-${kind}`, width: 11, height: 11})), text);
      section("timeline", "Timeline", el("div", {class: "bar"}, this.search, button("+", "Zoom in", () => this.zoom(.5)), button("\u2212", "Zoom out", () => this.zoom(2)), button("\u2190", "Earlier", () => this.pan(-.3)), button("\u2192", "Later", () => this.pan(.3)), button("All", "Show everything", () => this.all()), button("\u25B2", "Lanes above", () => this.scroll(-5)), button("\u25BC", "Lanes below", () => this.scroll(5))),
        this.canvas, this.tip, el("div", {class: "key"}, colour("wait", "released, not started"), colour("run", "runs"), colour("preempted", "preempted meanwhile (its share)"), colour("fail", "beyond its deadline, or never ended")),
        kept < of ? el("p", {class: "soft"}, `${plural(kept, "run")} of ${count(of)} are drawn: an even choice, all that never ended or missed releases, and the slowest of each callback. Tables and histograms count every one.`) : null);
      this.end = Math.max(...lanes.lanes.map(l => { let e = 0; for (let i = 0; i < l.count; ++i) e = Math.max(e, l.start[i] + (l.duration[i] || 0)); return e; }), 1);
      this.begin = Math.min(0, ...lanes.lanes.map(l => l.count ? l.start[0] - (l.wait[0] > 0 ? l.wait[0] : 0) : 0));
      for (const l of lanes.lanes) { l.longest = 0; for (let i = 0; i < l.count; ++i) l.longest = Math.max(l.longest, (l.duration[i] || 0), 0); l.longestWait = 0; for (let i = 0; i < l.count; ++i) if (l.wait[i] > l.longestWait) l.longestWait = l.wait[i]; }
      this.top = 0;
      this.choose();
      this.canvas.addEventListener("wheel", e => { if (!e.ctrlKey && !e.metaKey && Math.abs(e.deltaX) > Math.abs(e.deltaY)) this.pan(Math.sign(e.deltaX) * .1); else if (e.shiftKey) this.scroll(Math.sign(e.deltaY) * 2); else this.zoom(e.deltaY > 0 ? 1.25 : .8, this.timeAt(e.offsetX)); e.preventDefault(); }, {passive: false});
      let from = null;
      this.canvas.addEventListener("pointerdown", e => { from = {x: e.offsetX, from: this.from, to: this.to}; this.canvas.setPointerCapture(e.pointerId); });
      this.canvas.addEventListener("pointerup", () => { from = null; });
      this.canvas.addEventListener("pointermove", e => {
        if (from) { const d = (from.x - e.offsetX) / this.width * (from.to - from.from); this.view(from.from + d, from.to + d); return; }
        this.point(e.offsetX, e.offsetY);
      });
      this.canvas.addEventListener("keydown", e => {
        const action = {"+": () => this.zoom(.5), "=": () => this.zoom(.5), "-": () => this.zoom(2), ArrowLeft: () => this.pan(-.2), ArrowRight: () => this.pan(.2), ArrowUp: () => this.scroll(-1), ArrowDown: () => this.scroll(1), PageUp: () => this.scroll(-10), PageDown: () => this.scroll(10), 0: () => this.all(), Home: () => this.all()}[e.key];
        if (action && !e.ctrlKey && !e.metaKey && !e.altKey) { action(); e.preventDefault(); }
      });
      new ResizeObserver(() => this.draw()).observe(this.canvas);
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
      addEventListener("beforeprint", () => this.paint());
      addEventListener("afterprint", () => this.draw());
      this.all();
    },
    choose() {
      const words = this.search.value.toLowerCase().split(/\s+/).filter(Boolean);
      this.lanes = lanes.lanes.filter(l => words.every(w => l.title.toLowerCase().includes(w)));
    },
    all() { this.view(this.begin, this.end); },
    timeAt(x) { return this.from + Math.max(0, x - this.label) / Math.max(this.width - this.label, 1) * (this.to - this.from); },
    view(from, to) {
      const all = this.end - this.begin, span = Math.min(Math.max(to - from, 100), all);
      this.from = Math.min(Math.max(from, this.begin), this.end - span);
      this.to = this.from + span;
      this.draw();
    },
    zoom(factor, around) {
      const middle = around === undefined ? (this.from + this.to) / 2 : around;
      this.view(middle - (middle - this.from) * factor, middle + (this.to - middle) * factor);
    },
    pan(share) { const d = (this.to - this.from) * share; this.view(this.from + d, this.to + d); },
    scroll(rows) { this.top = Math.max(0, Math.min(this.top + rows, this.lanes.length - this.rows)); this.draw(); },
    show(lane, i) {
      this.search.value = "";
      this.choose();
      const response = lane.wait[i] > 0 ? lane.wait[i] : 0, length = response + (lane.duration[i] || 1000);
      this.marked = {lane, i};
      this.top = Math.max(0, Math.min(this.lanes.indexOf(lane) - 3, this.lanes.length - this.rows));
      this.view(lane.start[i] - response - length, lane.start[i] + length * 2);
      this.tell(lane, i);
      this.canvas.scrollIntoView({block: "center"});
      this.canvas.focus({preventScroll: true});
    },
    tell(lane, i) {
      const parts = [`${lane.title}, run #${count(lane.seq[i])} on thread ${lane.tid(i)}`, `starts ${time(lane.start[i] - this.begin)} into the view`];
      if (!Number.isNaN(lane.response(i))) parts.push(`response ${time(lane.response(i))}`);
      for (const [what, , ns] of partsOf(lane, i)) parts.push(`${what} ${time(ns)}`);
      if (Number.isNaN(lane.duration[i])) parts.push("never ended");
      if (lane.isLate(i)) parts.push(`beyond its deadline of ${time(lane.deadline)}`);
      this.tip.textContent = parts.join("; ");
    },
    // First instance that may reach into the view, by its start.
    firstAt(lane, t) {
      let low = 0, high = lane.count;
      while (low < high) { const m = (low + high) >> 1; if (lane.start[m] < t) low = m + 1; else high = m; }
      return low;
    },
    point(x, y) {
      const row = this.top + Math.floor((y - 20) / this.row), lane = this.lanes[row];
      if (!lane || x < this.label || y < 20) return;
      const t = this.timeAt(x), near = (this.to - this.from) / this.width * 3;
      let best = -1, distance = near;
      for (let i = this.firstAt(lane, t - lane.longest - near); i < lane.count && lane.start[i] - lane.longestWait <= t + near; ++i) {
        const from = lane.start[i] - (lane.wait[i] > 0 ? lane.wait[i] : 0), to = lane.start[i] + (lane.duration[i] || 0);
        const d = t < from ? from - t : t > to ? t - to : 0;
        if (d < distance || d === 0) { best = i; distance = d; }
      }
      if (best >= 0) this.tell(lane, best);
    },
    draw() { if (!this.pending) { this.pending = true; requestAnimationFrame(() => { this.pending = false; this.paint(); }); } },
    paint() {
      const canvas = this.canvas, ratio = devicePixelRatio || 1;
      this.width = canvas.clientWidth || 800;
      this.label = this.width < 600 ? 90 : 240;
      this.row = 18;
      this.rows = Math.max(1, Math.min(this.lanes.length, 26));
      const height = 20 + this.rows * this.row + 4;
      canvas.style.height = `${height}px`;
      canvas.width = Math.round(this.width * ratio);
      canvas.height = Math.round(height * ratio);
      const g = canvas.getContext("2d"), style = getComputedStyle(document.documentElement), colour = name => style.getPropertyValue(`--${name}`).trim();
      g.scale(ratio, ratio);
      g.fillStyle = colour("paper");
      g.fillRect(0, 0, this.width, height);
      const span = this.to - this.from, scale = (this.width - this.label) / span, X = t => this.label + (t - this.from) * scale;
      g.font = "11px system-ui, sans-serif";
      g.strokeStyle = colour("line");
      const step = Math.pow(10, Math.ceil(Math.log10(span / 8)));
      for (const s of [step / 5, step / 2, step]) if (span / s <= 10) { this.step = s; break; }
      g.fillStyle = colour("soft");
      const firstTick = Math.ceil((this.from - this.begin) / this.step) * this.step + this.begin;
      for (let t = firstTick; t <= this.to; t += this.step) {
        g.beginPath(); g.moveTo(X(t), 14); g.lineTo(X(t), height); g.stroke();
        // Four digits would not tell neighbours apart.
        const isFine = this.step < (t - this.begin) / 2000 && t !== firstTick;
        g.fillText(isFine ? `+${time(t - firstTick)}` : time(t - this.begin), X(t) + 2, 11);
      }
      const c = {wait: colour("wait"), run: colour("run"), preempted: colour("preempted"), fail: colour("fail"), ink: colour("ink"), line: colour("line")};
      this.lanes.slice(this.top, this.top + this.rows).forEach((lane, k) => {
        const y = 20 + k * this.row;
        g.save();
        g.beginPath(); g.rect(0, y, this.label - 6, this.row); g.clip();
        g.fillStyle = c.ink; g.textAlign = "right";
        g.fillText(lane.title, this.label - 8, y + 12.5);
        g.restore();
        g.textAlign = "left";
        g.save();
        g.beginPath(); g.rect(this.label, y, this.width - this.label, this.row); g.clip();
        this.paintLane(g, lane, y, X, c);
        g.restore();
      });
      g.fillStyle = c.line;
      if (this.lanes.length > this.rows) g.fillRect(this.width - 4, 20 + this.top / this.lanes.length * (height - 20), 4, this.rows / this.lanes.length * (height - 20));
    },
    paintLane(g, lane, y, X, c) {
      const first = this.firstAt(lane, this.from - lane.longest), last = this.firstAt(lane, this.to + lane.longestWait);
      const height = this.row - 6, perPixel = (last - first) / Math.max(this.width - this.label, 1);
      const bar = (from, to, kind, top, h) => { const x = Math.max(X(from), this.label - 1); g.fillStyle = c[kind]; g.fillRect(x, top, Math.max(Math.min(X(to), this.width) - x, .7), h); };
      if (perPixel > 4) {  // one column for all runs of a pixel: how much of it is busy, and whether one is late
        const columns = Math.ceil(this.width - this.label), busy = new Float32Array(columns), late = new Uint8Array(columns);
        const width = (this.to - this.from) / columns;
        for (let i = first; i < last; ++i) {
          const at = Math.floor((lane.start[i] - this.from) / width);
          if (at < 0 || at >= columns) continue;
          busy[at] += (lane.duration[i] || 0) / width;
          if (lane.isLate(i) || Number.isNaN(lane.duration[i])) late[at] = 1;
        }
        for (let p = 0; p < columns; ++p) {
          if (busy[p] === 0 && !late[p]) continue;
          const h = Math.max(2, Math.min(1, busy[p]) * height);
          g.fillStyle = late[p] ? c.fail : c.run;
          g.fillRect(this.label + p, y + 3 + height - h, 1, h);
        }
        return;
      }
      for (let i = first; i < last; ++i) {
        const start = lane.start[i], open = Number.isNaN(lane.duration[i]), end = open ? this.end : start + lane.duration[i];
        if (lane.wait[i] > 0) bar(start - lane.wait[i], start, "wait", y + 3 + height * .3, height * .4);
        bar(start, end, open || lane.isLate(i) ? "fail" : "run", y + 3, height);
        if (lane.preempted[i] > 0) bar(end - lane.preempted[i], end, "preempted", y + 3 + height * .7, height * .3);
        if (this.marked && this.marked.lane === lane && this.marked.i === i) {
          g.strokeStyle = c.ink; g.lineWidth = 2;
          const x = X(start - (lane.wait[i] > 0 ? lane.wait[i] : 0));
          g.strokeRect(x - 2, y + 1, Math.max(X(end) - x, 1) + 4, this.row - 2);
          g.lineWidth = 1;
        }
      }
    }
  };

  const defects = () => {
    if (!report.defects.length) return;
    section("defects", "What this trace lacks", el("ul", {}, report.defects.map(d => el("li", {}, el("strong", {}, d.kind), ` (${d.severity}, ${count(d.count)}): ${d.advice}`))));
  };

  decode().then(() => {
    head(); inShort(); rules(); callbacks(); timeline.build(); matrix(); chains(); threads(); defects();
    page.append(el("footer", {class: "soft"}, el("p", {}, `Written by cie ${report.tool.version}. Times are of CLOCK_MONOTONIC.`)));
    const worst = worstIndex();
    if (report.callbacks.length) choose(Math.max(worst, 0));
    addEventListener("beforeprint", () => { for (const d of document.querySelectorAll("details")) d.open = true; });
    document.documentElement.dataset.ready = "yes";
  }).catch(error => { page.prepend(el("p", {class: "fail", role: "alert"}, `This page cannot be drawn: ${error.message}`)); document.documentElement.dataset.ready = "failed"; });
})();
