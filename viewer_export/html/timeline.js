// The timeline: a lane for each callback, drawn on a canvas.
import {colour, el} from "./dom.js";
import {partsOf} from "./instances.js";
import {isCalled, lanes, section, wordsIn} from "./recording.js";
import {count, plural, roundTime, time} from "./words.js";

const MOST_ROWS = 26;
// As much of a text as fits.
const fit = (g, text, width) => {
  let length = text.length;
  while (length > 1 && g.measureText(`${text.slice(0, length)}\u2026`).width > width) --length;
  return `${text.slice(0, length)}\u2026`;
};

export const timeline = {
  build() {
    if (!lanes.lanes.length) return;
    const kept = lanes.lanes.reduce((n, l) => n + l.count, 0);
    const of = lanes.lanes.reduce((n, l) => n + l.of, 0);
    this.canvas = el("canvas", {
      tabindex: "0",
      role: "img",
      "aria-label":
        "Timeline of callbacks. Arrow keys move, plus and minus zoom, 0 shows everything, n and p go to the lane's next and previous instance.",
    });
    this.tip = el(
      "p",
      {class: "tip soft", role: "status"},
      "Wheel or + and \u2212 zoom, dragging or arrow keys move, 0 shows everything, n and p go from instance to instance. Point at one to read it.",
    );
    this.search = el("input", {
      type: "search",
      placeholder: "Lanes by name",
      "aria-label": "Show only lanes with this name",
      oninput: () => {
        this.top = 0;
        this.choose();
        this.draw();
      },
    });
    const button = (text, label, action) => el("button", {type: "button", "aria-label": label, onclick: action}, text);
    section(
      "timeline",
      "Timeline",
      el(
        "div",
        {class: "bar"},
        this.search,
        button("+", "Zoom in", () => this.zoom(0.5)),
        button("\u2212", "Zoom out", () => this.zoom(2)),
        button("\u2190", "Earlier", () => this.pan(-0.3)),
        button("\u2192", "Later", () => this.pan(0.3)),
        button("All", "Show everything", () => this.all()),
        button("\u25B2", "Lanes above", () => this.scroll(-5)),
        button("\u25BC", "Lanes below", () => this.scroll(5)),
      ),
      this.canvas,
      this.tip,
      el(
        "div",
        {class: "key"},
        colour("wait", "released, not started"),
        colour("run", "instances"),
        colour("preempted", "preempted meanwhile (its share)"),
        colour("fail", "tall: beyond its deadline, or nothing shows that it ended"),
        lanes.lanes.some(l => l.hasLostEnd)
          ? colour("lost", "tall outline: its end is not recorded; it ended before the outline does")
          : null,
      ),
      kept < of
        ? el(
            "p",
            {class: "soft"},
            `${plural(kept, "instance")} of ${count(of)} are drawn: an even choice, all that never ended or missed releases, and the slowest of each callback. Tables and histograms count every one.`,
          )
        : null,
    );
    this.end = Math.max(
      ...lanes.lanes.map(l => {
        let e = 0;
        for (let i = 0; i < l.count; ++i) e = Math.max(e, l.start[i] + (l.duration[i] || 0));
        return e;
      }),
      1,
    );
    this.zero = (lanes.begin_ns ?? lanes.base_ns) - lanes.base_ns; // also of a report of a window
    this.begin = Math.min(0, ...lanes.lanes.map(l => (l.count ? l.start[0] - (l.wait[0] > 0 ? l.wait[0] : 0) : 0)));
    for (const l of lanes.lanes) {
      l.longest = 0;
      for (let i = 0; i < l.count; ++i) l.longest = Math.max(l.longest, l.duration[i] || 0, 0);
      l.longestWait = 0;
      for (let i = 0; i < l.count; ++i) if (l.wait[i] > l.longestWait) l.longestWait = l.wait[i];
    }
    this.top = 0;
    this.choose();
    this.canvas.addEventListener(
      "wheel",
      e => {
        if (!e.ctrlKey && !e.metaKey && Math.abs(e.deltaX) > Math.abs(e.deltaY)) this.pan(Math.sign(e.deltaX) * 0.1);
        else if (e.shiftKey) this.scroll(Math.sign(e.deltaY) * 2);
        else this.zoom(e.deltaY > 0 ? 1.25 : 0.8, this.timeAt(e.offsetX));
        e.preventDefault();
      },
      {passive: false},
    );
    let from = null;
    this.canvas.addEventListener("pointerdown", e => {
      from = {x: e.offsetX, from: this.from, to: this.to};
      this.canvas.setPointerCapture(e.pointerId);
    });
    this.canvas.addEventListener("pointerup", () => {
      from = null;
    });
    this.canvas.addEventListener("pointermove", e => {
      if (from) {
        const d = ((from.x - e.offsetX) / this.width) * (from.to - from.from);
        this.view(from.from + d, from.to + d);
        return;
      }
      this.point(e.offsetX, e.offsetY);
    });
    this.canvas.addEventListener("keydown", e => {
      const action = {
        "+": () => this.zoom(0.5),
        "=": () => this.zoom(0.5),
        "-": () => this.zoom(2),
        ArrowLeft: () => this.pan(-0.2),
        ArrowRight: () => this.pan(0.2),
        ArrowUp: () => this.scroll(-1),
        ArrowDown: () => this.scroll(1),
        PageUp: () => this.scroll(-10),
        PageDown: () => this.scroll(10),
        0: () => this.all(),
        Home: () => this.all(),
        n: () => this.toNeighbour(1),
        p: () => this.toNeighbour(-1),
      }[e.key];
      if (action && !e.ctrlKey && !e.metaKey && !e.altKey) {
        action();
        e.preventDefault();
      }
    });
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
    addEventListener("beforeprint", () => this.paint());
    addEventListener("afterprint", () => this.draw());
    this.all();
  },
  choose() {
    const words = wordsIn(this.search.value);
    this.lanes = lanes.lanes.filter(l => isCalled(l.callbackReport, words));
  },
  all() {
    this.view(this.begin, this.end);
  },
  timeAt(x) {
    return this.from + (Math.max(0, x - this.label) / Math.max(this.width - this.label, 1)) * (this.to - this.from);
  },
  view(from, to) {
    const all = this.end - this.begin;
    const span = Math.min(Math.max(to - from, 100), all);
    this.from = Math.min(Math.max(from, this.begin), this.end - span);
    this.to = this.from + span;
    this.draw();
  },
  zoom(factor, around) {
    const middle = around === undefined ? (this.from + this.to) / 2 : around;
    this.view(middle - (middle - this.from) * factor, middle + (this.to - middle) * factor);
  },
  pan(share) {
    const d = (this.to - this.from) * share;
    this.view(this.from + d, this.to + d);
  },
  scroll(rows) {
    this.top = Math.max(0, Math.min(this.top + rows, this.lanes.length - this.rows));
    this.draw();
  },
  show(lane, i) {
    this.lookAt(lane, i);
    this.canvas.scrollIntoView({block: "center"});
    this.canvas.focus({preventScroll: true});
  },
  // A run in the middle, with as much before and behind it as it takes itself.
  lookAt(lane, i) {
    this.search.value = "";
    this.choose();
    const response = lane.wait[i] > 0 ? lane.wait[i] : 0;
    const length = response + (lane.duration[i] || 1000);
    this.marked = {lane, i};
    this.rows = Math.min(this.lanes.length, MOST_ROWS);
    this.top = Math.max(0, Math.min(this.lanes.indexOf(lane) - 3, this.lanes.length - this.rows));
    this.view(lane.start[i] - response - length, lane.start[i] - response + length * 2);
    this.tell(lane, i);
  },
  // To the marked run's neighbour.
  toNeighbour(by) {
    if (!this.marked) return;
    const {lane, i} = this.marked;
    const next = i + by;
    if (next >= 0 && next < lane.count) this.lookAt(lane, next);
  },
  tell(lane, i) {
    const parts = [
      `${lane.title}, instance #${count(lane.seq[i])} on thread ${lane.tid(i)}`,
      `starts ${time(lane.start[i] - this.zero)} into the recording`,
    ];
    if (!Number.isNaN(lane.response(i))) parts.push(`response ${time(lane.response(i))}`);
    for (const [what, , ns] of partsOf(lane, i)) parts.push(`${what} ${time(ns)}`);
    if (Number.isNaN(lane.duration[i]))
      parts.push(
        Number.isNaN(lane.notAfter(i))
          ? "nothing shows that it ended"
          : `its end is not recorded; it took at most ${time(lane.notAfter(i) - lane.start[i])}`,
      );
    if (lane.isLate(i)) parts.push(`beyond its deadline of ${time(lane.deadline)}`);
    this.tip.textContent = parts.join("; ");
  },
  // First instance that may reach into the view, by its start.
  firstAt(lane, t) {
    let low = 0;
    let high = lane.count;
    while (low < high) {
      const m = (low + high) >> 1;
      if (lane.start[m] < t) low = m + 1;
      else high = m;
    }
    return low;
  },
  point(x, y) {
    const row = this.top + Math.floor((y - 20) / this.row);
    const lane = this.lanes[row];
    if (!lane || x < this.label || y < 20) return;
    const t = this.timeAt(x);
    const near = ((this.to - this.from) / this.width) * 3;
    let best = -1;
    let distance = near;
    for (
      let i = this.firstAt(lane, t - lane.longest - near);
      i < lane.count && lane.start[i] - lane.longestWait <= t + near;
      ++i
    ) {
      const from = lane.start[i] - (lane.wait[i] > 0 ? lane.wait[i] : 0);
      const to = lane.start[i] + (lane.duration[i] || 0);
      const d = t < from ? from - t : t > to ? t - to : 0;
      if (d < distance || d === 0) {
        best = i;
        distance = d;
      }
    }
    if (best >= 0) this.tell(lane, best);
  },
  draw() {
    if (!this.pending) {
      this.pending = true;
      requestAnimationFrame(() => {
        this.pending = false;
        this.paint();
      });
    }
  },
  paint() {
    const canvas = this.canvas;
    const ratio = devicePixelRatio || 1;
    this.width = canvas.clientWidth || 800;
    this.row = 18;
    this.rows = Math.max(1, Math.min(this.lanes.length, MOST_ROWS));
    const height = 20 + this.rows * this.row + 4;
    canvas.style.height = `${height}px`;
    canvas.width = Math.round(this.width * ratio);
    canvas.height = Math.round(height * ratio);
    const g = canvas.getContext("2d");
    const font = "12px system-ui, sans-serif";
    g.font = font;
    for (const lane of this.lanes) lane.titleWidth ??= g.measureText(lane.title).width;
    const longest = this.lanes.reduce((most, lane) => Math.max(most, lane.titleWidth), 0);
    this.label = Math.min(Math.ceil(longest) + 14, Math.round(this.width * 0.42));
    const style = getComputedStyle(document.documentElement);
    const colour = name => style.getPropertyValue(`--${name}`).trim();
    g.scale(ratio, ratio);
    g.fillStyle = colour("paper");
    g.fillRect(0, 0, this.width, height);
    const span = this.to - this.from;
    const scale = (this.width - this.label) / span;
    const X = t => this.label + (t - this.from) * scale;
    g.font = font;
    g.strokeStyle = colour("line");
    const most = Math.max(2, Math.floor((this.width - this.label) / 80));
    const least = 10 ** Math.floor(Math.log10(span / most));
    this.step = [1, 2, 5, 10].map(n => n * least).find(s => span / s <= most);
    g.fillStyle = colour("soft");
    const firstTick = Math.ceil((this.from - this.zero) / this.step) * this.step + this.zero;
    for (let t = firstTick; t <= this.to; t += this.step) {
      g.beginPath();
      g.moveTo(X(t), 14);
      g.lineTo(X(t), height);
      g.stroke();
      // Four digits would not tell neighbours apart.
      const isFine = this.step < (t - this.zero) / 2000 && t !== firstTick;
      const text = roundTime(isFine ? t - firstTick : t - this.zero);
      const shown = isFine ? `+${text}` : text;
      if (X(t) + 2 + g.measureText(shown).width <= this.width) g.fillText(shown, X(t) + 2, 11);
    }
    const c = {
      wait: colour("wait"),
      run: colour("run"),
      preempted: colour("preempted"),
      fail: colour("fail"),
      ink: colour("ink"),
      line: colour("line"),
      soft: colour("soft"),
    };
    this.lanes.slice(this.top, this.top + this.rows).forEach((lane, k) => {
      const y = 20 + k * this.row;
      g.fillStyle = c.ink;
      const room = this.label - 10;
      g.fillText(lane.titleWidth <= room ? lane.title : fit(g, lane.title, room), 4, y + 13);
      g.save();
      g.beginPath();
      g.rect(this.label, y, this.width - this.label, this.row);
      g.clip();
      this.paintLane(g, lane, y, X, c);
      g.restore();
    });
    g.fillStyle = c.line;
    if (this.lanes.length > this.rows)
      g.fillRect(
        this.width - 4,
        20 + (this.top / this.lanes.length) * (height - 20),
        4,
        (this.rows / this.lanes.length) * (height - 20),
      );
  },
  paintLane(g, lane, y, X, c) {
    const first = this.firstAt(lane, this.from - lane.longest);
    const last = this.firstAt(lane, this.to + lane.longestWait);
    const height = this.row - 6;
    const perPixel = (last - first) / Math.max(this.width - this.label, 1);
    const bar = (from, to, kind, top, h) => {
      const x = Math.max(X(from), this.label - 1);
      g.fillStyle = c[kind];
      g.fillRect(x, top, Math.max(Math.min(X(to), this.width) - x, 0.7), h);
    };
    const outline = (from, to, top, h) => {
      const x = X(from);
      g.strokeStyle = c.soft;
      g.strokeRect(x + 0.5, top + 0.5, Math.max(X(to) - x - 1, 1), h - 1);
    };
    if (perPixel > 4) {
      // one column for all runs of a pixel: how much of it is busy, and whether one is late
      const columns = Math.ceil(this.width - this.label);
      const busy = new Float32Array(columns);
      const late = new Uint8Array(columns);
      const width = (this.to - this.from) / columns;
      for (let i = first; i < last; ++i) {
        const at = Math.floor((lane.start[i] - this.from) / width);
        if (at < 0 || at >= columns) continue;
        busy[at] += (lane.duration[i] || 0) / width;
        if (lane.isLate(i) || lane.isOpen(i)) late[at] = 1;
      }
      for (let p = 0; p < columns; ++p) {
        if (busy[p] === 0 && !late[p]) continue;
        const h = late[p] ? this.row : Math.max(2, Math.min(1, busy[p]) * height);
        g.fillStyle = late[p] ? c.fail : c.run;
        g.fillRect(this.label + p, late[p] ? y : y + 3 + height - h, 1, h);
      }
      return;
    }
    for (let i = first; i < last; ++i) {
      const start = lane.start[i];
      const isOpen = lane.isOpen(i);
      const isLost = !isOpen && Number.isNaN(lane.duration[i]);
      const end = isOpen ? this.end : isLost ? lane.notAfter(i) : start + lane.duration[i];
      if (lane.wait[i] > 0) bar(start - lane.wait[i], start, "wait", y + 3 + height * 0.3, height * 0.4);
      if (isLost) outline(start, end, y + 1, this.row - 2);
      else if (isOpen || lane.isLate(i)) bar(start, end, "fail", y + 1, this.row - 2);
      else bar(start, end, "run", y + 3, height);
      if (lane.preempted[i] > 0) bar(end - lane.preempted[i], end, "preempted", y + 3 + height * 0.7, height * 0.3);
      if (this.marked && this.marked.lane === lane && this.marked.i === i) {
        g.strokeStyle = c.ink;
        g.lineWidth = 2;
        const x = X(start - (lane.wait[i] > 0 ? lane.wait[i] : 0));
        g.strokeRect(x - 2, y + 1, Math.max(X(end) - x, 1) + 4, this.row - 2);
        g.lineWidth = 1;
      }
    }
  },
};
