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
