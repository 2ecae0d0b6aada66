// Numbers, times and verdicts for people.

export const count = n => n.toLocaleString("en-US").replaceAll(",", "\u202f");
export const plural = (n, one, many) => `${count(n)} ${n === 1 ? one : many || `${one}s`}`;
export const percent = x =>
  x >= 0.995 || x < 0.0005 ? `${Math.round(100 * x)}\u202f%` : `${+(100 * x).toPrecision(2)}\u202f%`;
// Nanoseconds for people: four digits, as the text report has them. From 999.95 on they round to the next unit.
export const time = ns => {
  if (ns === null || ns === undefined) return "\u2013";
  const size = Math.abs(Math.round(ns));
  if (size < 1000) return `${Math.round(ns)}\u202fns`;
  const [unit, name] = size < 999.95e3 ? [1e3, "us"] : size < 999.95e6 ? [1e6, "ms"] : [1e9, "s"];
  const value = ns / unit;
  return `${Math.abs(value) < 1000 ? value.toPrecision(4) : value.toFixed(0)}\u202f${name}`;
};
// Without the zeros that say how exact it is.
export const roundTime = ns =>
  time(ns)
    .replace(/(\.\d*?)0+(?=\u202f)/, "$1")
    .replace(/\.(?=\u202f)/, "");
export const SIGN = {PASS: "\u2713", FAIL: "\u2717", INCONCLUSIVE: "?", NOT_APPLICABLE: "\u2013"};
export const COLOUR = {PASS: "pass", FAIL: "fail", INCONCLUSIVE: "open", NOT_APPLICABLE: "soft"};
export const WORD = {
  PASS: "holds",
  FAIL: "is violated",
  INCONCLUSIVE: "cannot be decided",
  NOT_APPLICABLE: "does not apply",
};

// What a browser obeys or hides instead of showing it, as the text report writes it.
const HIDDEN = [
  [0xad, 0xad],
  [0x61c, 0x61c],
  [0x200b, 0x200f],
  [0x2028, 0x202e],
  [0x2060, 0x206f],
  [0xfeff, 0xfeff],
  [0xfff9, 0xfffb],
  [0xe0000, 0xe0fff],
];
export const printable = text =>
  [...text]
    .map(c => {
      const code = c.codePointAt(0);
      const hex = code.toString(16);
      if (code < 0x20 || (code >= 0x7f && code < 0xa0)) return `\\x${hex.padStart(2, "0")}`;
      return HIDDEN.some(([first, last]) => code >= first && code <= last) ? `\\u{${hex}}` : c;
    })
    .join("");

// With "…" where it is longer.
export const cut = (text, most) => (text.length > most ? `${text.slice(0, most - 1)}\u2026` : text);
