// What a library of materials (.mtl) says, and which files beside a mesh may be asked for.

/** A file in the folder of another or below it; null: it lies elsewhere, and is not asked for. */
export function beside(name, address) {
  if (!address) return null;
  const path = name.trim().replaceAll('\\', '/').replace(/^(\.\/)+/, '');
  if (path === '' || /^\/|^[a-z][a-z0-9+.-]*:|(^|\/)\.\.(\/|$)/i.test(path)) return null;
  return new URL(path.split('/').map(encodeURIComponent).join('/'), address);
}

/** By name {colour, opacity, picture}; what else there is in it is not drawn. */
export function parseLibrary(text) {
  const all = new Map();
  let one = null;
  for (const line of text.split(/\r?\n/)) {
    const [, word, rest] = /^\s*(\S+)\s+(.*?)\s*$/.exec(line) ?? [], numbers = rest?.split(/\s+/).map(Number) ?? [];
    if (word === 'newmtl') all.set(rest, one = {});
    else if (!one) continue;
    else if (word === 'Kd' && numbers.length >= 3 && numbers.every(Number.isFinite)) one.colour = numbers.slice(0, 3);
    else if (word === 'd' && Number.isFinite(numbers[0])) one.opacity = numbers[0];
    else if (word === 'Tr' && Number.isFinite(numbers[0])) one.opacity = 1 - numbers[0];
    // Its options (-s 1 1 1) come before its name.
    else if (word === 'map_Kd') one.picture = rest.replace(/^(-\S+\s+((on|off|-?[\d.]+)\s+)+)+/, '');
  }
  return all;
}
