// Numbers for people.

export function count(n) {
  return Math.round(n).toLocaleString('en').replaceAll(',', ' ');
}
/** '1 face', '2 faces'. */
export function counted(n, noun) {
  return `${count(n)} ${noun}${n === 1 ? '' : 's'}`;
}
export function bytesText(n) {
  for (const [unit, size] of [['GB', 1e9], ['MB', 1e6], ['kB', 1e3]]) {
    if (n >= size) return `${(n / size).toPrecision(3)} ${unit}`;
  }
  return `${n} bytes`;
}

/** So many a second, of the last seconds in which there were any. */
export class Rate {
  constructor() {
    this.times = [];
  }
  add(n) {
    this.times.push([performance.now(), n]);
  }
  /** Null: not known. */
  get value() {
    const {times} = this, now = performance.now();
    while (times.length > 0 && now - times[0][0] > 3000) times.shift();
    if (times.length < 2) return null;
    const time = times.at(-1)[0] - times[0][0];
    return time > 0 ? times.slice(1).reduce((sum, [, n]) => sum + n, 0) / time * 1000 : null;
  }
}
export function rateText(n) {
  return n >= 1e6 ? `${(n / 1e6).toPrecision(3)} M/s` : `${Math.round(n / 1e3)} k/s`;
}

export function number(x) {
  if (Number.isInteger(x) && Math.abs(x) < 1e6) return String(x);
  return Math.abs(x) >= 1e5 || Math.abs(x) < 1e-3 ? x.toExponential(2) : String(Number(x.toPrecision(4)));
}

/** An error's message, with a full stop, and a capital letter where it does not begin with an address or a file's name. */
export function sentence({message}) {
  const text = String(message).trim(), isName = /^\S*[/.:]/.test(text);
  return (isName ? text : text.charAt(0).toUpperCase() + text.slice(1)) + (/[.!?]$/.test(text) ? '' : '.');
}
