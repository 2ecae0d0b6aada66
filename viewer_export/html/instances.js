// What the timeline knows: columns of numbers per lane.
// Unknown is NaN. Times are relative to lanes.base_ns, those of several hosts on one clock.
import {lanes, name, report} from "./recording.js";

// Of runs whose end is not recorded: by when they had ended at the latest, because a later run of the callback began on
// their thread. NaN: nothing shows that it ended.
export const findLimits = lane => {
  const limits = new Map();
  const next = new Map(); // by thread
  lane.hasLostEnd = false;
  for (let i = lane.count - 1; i >= 0; --i) {
    const tid = lane.tid(i);
    if (Number.isNaN(lane.duration[i])) {
      limits.set(i, next.get(tid) ?? Number.NaN);
      lane.hasLostEnd ||= next.has(tid);
    }
    next.set(tid, lane.start[i]);
  }
  lane.notAfter = i => limits.get(i) ?? Number.NaN;
  lane.isOpen = i => Number.isNaN(lane.duration[i]) && Number.isNaN(lane.notAfter(i));
};

export const decode = async () => {
  const packed = Uint8Array.from(atob(lanes.columns), c => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  let at = 0;
  const number = () => {
    let value = 0;
    let scale = 1;
    let byte;
    do {
      byte = bytes[at++];
      value += (byte & 127) * scale;
      scale *= 128;
    } while (byte & 128);
    return value;
  };
  const signed = value => (value % 2 ? -(value + 1) / 2 : value / 2);
  const optional = () => {
    const value = number();
    return value === 0 ? Number.NaN : signed(value - 1);
  };
  for (const lane of lanes.lanes) {
    const column = read => {
      const c = new Float64Array(lane.count);
      for (let i = 0; i < c.length; ++i) c[i] = read(i);
      return c;
    };
    let before = 0;
    lane.start = column(() => {
      before += signed(number());
      return before;
    });
    lane.wait = column(optional); // what it is at least, if the release is not known exactly
    lane.duration = column(optional);
    lane.execution = column(optional);
    lane.preempted = column(optional);
    lane.blocked = column(optional);
    lane.wake = column(optional);
    let seq = 0;
    lane.seq = column(() => {
      seq += signed(number());
      return seq;
    });
    const place = column(number);
    lane.tid = i => lane.tids[Math.floor(place[i] / 2)];
    // Where the report has no response time, no release was proved in the end.
    lane.isExact = i => place[i] % 2 === 1 && lane.callbackReport.response_time_ns !== null;
    lane.response = i => (lane.isExact(i) ? lane.wait[i] + lane.duration[i] : Number.NaN);
    // A response time, or what it is at least.
    lane.least = i => (lane.wait[i] > 0 ? lane.wait[i] : 0) + lane.duration[i];
    lane.callbackReport = report.callbacks[lane.callback];
    lane.title = name(lane.callbackReport);
    lane.deadline = lane.callbackReport.response_deadline_ns;
    findLimits(lane);
    lane.isLate = i => lane.deadline !== null && lane.response(i) > lane.deadline;
  }
};
export const laneOf = callback => lanes.lanes.find(lane => lane.callback === callback);
// Numbers of a lane's instances that ended, slowest first, by what is certain of their response times.
export const slowest = (lane, n) => {
  const ended = [];
  for (let i = 0; i < lane.count; ++i) if (!Number.isNaN(lane.least(i))) ended.push(i);
  ended.sort((a, b) => lane.least(b) - lane.least(a) || a - b);
  return ended.slice(0, n);
};
// The number of the slowest; undefined: there is none.
export const worstRun = lane => slowest(lane, 1)[0];
// Whom an instance waited for: runs of others, or earlier ones of its own callback, on its thread between its release
// and its start, longest in sum first: [lane, ns]. Of runs that are not drawn nothing is known.
export const waitedFor = (lane, i) => {
  if (!(lane.wait[i] > 0)) return [];
  const tid = lane.tid(i);
  const to = lane.start[i];
  const from = to - lane.wait[i];
  const found = [];
  for (const other of lanes.lanes) {
    if (other.callbackReport.process !== lane.callbackReport.process || !other.tids.includes(tid)) continue;
    let sum = 0;
    for (let k = 0; k < other.count; ++k) {
      if (other.tid(k) !== tid || other.start[k] >= to || Number.isNaN(other.duration[k])) continue;
      sum += Math.max(0, Math.min(other.start[k] + other.duration[k], to) - Math.max(other.start[k], from));
    }
    if (sum > 0) found.push([other, sum]);
  }
  return found.sort((a, b) => b[1] - a[1]);
};
// Whether waitedFor() knows all that its thread ran meanwhile: every run of its process is drawn, on a thread that is
// known, and none whose end is not recorded may have reached into the wait.
export const knowsWhomItWaitedFor = (lane, i) => {
  const {process} = lane.callbackReport;
  const isWhole = c => c.isolation !== null && c.cut + c.runs_not_seen === 0;
  const tid = lane.tid(i);
  const to = lane.start[i];
  const from = to - lane.wait[i];
  const mayReach = (other, k) =>
    Number.isNaN(other.duration[k]) && other.tid(k) === tid && other.start[k] < to && !(other.notAfter(k) <= from);
  return (
    report.callbacks.every(c => c.process !== process || isWhole(c)) &&
    lanes.lanes
      .filter(other => other.callbackReport.process === process)
      .every(other => other.count === other.of && !other.start.some((_, k) => mayReach(other, k)))
  );
};
// Where an instance's response time went: [what, its class, ns]. The parts add up to it.
export const partsOf = (lane, i) => {
  const parts = [["start latency", "wait", lane.wait[i]]];
  if (Number.isNaN(lane.execution[i])) {
    parts.push(["duration", "run", lane.duration[i]]);
  } else {
    parts.push(
      ["execution time", "run", lane.execution[i]],
      ["preempted", "preempted", lane.preempted[i]],
      ["blocked", "blocked", lane.blocked[i]],
      ["wake delay", "wake", lane.wake[i]],
    );
  }
  return parts.filter(part => part[2] > 0);
};
