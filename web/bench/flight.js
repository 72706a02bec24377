// A flight over a mesh without drawing it: what it fetches and holds in node.
import {MeshFile} from '../src/maille.js';

/** Six planes of a perspective view from `eye` to `at`; they look inwards. */
function frustum(eye, at, aspect, angle, near, far) {
  const sub = (a, b) => a.map((x, k) => x - b[k]), dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const unit = a => a.map(x => x / Math.sqrt(dot(a, a)));
  const forward = unit(sub(at, eye)), right = unit(cross(forward, [0.1, 1, 0.2])), up = cross(right, forward);
  const t = Math.tan(angle / 2), through = (normal, point) => ({normal: unit(normal), offset: -dot(unit(normal), point)});
  const side = (axis, width) => [1, -1].map(sign => through(forward.map((x, k) => x * width + sign * axis[k]), eye));
  const along = distance => eye.map((x, k) => x + forward[k] * distance);
  return [...side(right, t * aspect), ...side(up, t), through(forward, along(near)), through(forward.map(x => -x), along(far))];
}

/** Memory of JavaScript and WebAssembly, in bytes: all of the reader's, this benchmark's, and some of node's. */
function held(file) {
  const {heapUsed, arrayBuffers} = process.memoryUsage();
  return heapUsed + arrayBuffers + file.usage.decoderBytes;
}

/**
 * Flies close above a part of the model, as MailleObject does: charts of every view are fetched and kept up to a budget, the
 * ones not seen for longest go. Errors of so many pixels in 1080 lines, or as many faces as `maxFaces` in each view.
 */
export async function fly(address, {budget, share, pixels = 1.5, maxFaces}) {
  const file = await MeshFile.open(address, {cacheBytes: budget / 32}), {centre, radius} = file.sphere;
  const kept = new Map(), seen = new Set();
  let keptBytes = 0, most = 0, live = 0, decoded = 0;
  const faces = file.levels[0].faces;
  for (let step = 0; step < 200; ++step) {
    const angle = step / 200 * share, at = [Math.cos(angle), 0.2, Math.sin(angle)].map((x, k) => centre[k] + 0.5 * radius * x);
    const eye = at.map((x, k) => centre[k] + (x - centre[k]) * 1.6), lines = 1080, fov = Math.PI / 4;
    const planes = frustum(eye, at, 16 / 9, fov, radius * 1e-3, radius * 0.6);
    const view = {eye, pixelsPerRadian: lines / (2 * Math.tan(fov / 2)), pixels};
    const charts = await file.select({planes, view, maxFaces});
    await Promise.all(charts.map(async chart => {
      const key = `${chart.group}/${chart.chart}`, known = kept.get(key);
      if (chart.level === 0) seen.add(key);
      kept.delete(key);
      const drawn = known ?? await file.decodeNode(chart, {lean: true});
      kept.set(key, drawn);
      if (known) return;
      ++decoded;
      keptBytes += sizeOf(drawn);
      for (const [oldest, old] of kept) {
        if (keptBytes <= budget) break;
        kept.delete(oldest);
        keptBytes -= sizeOf(old);
        for (const array of arraysOf(old)) array.buffer.transfer?.(0);
      }
      if (decoded % 32 === 0) most = Math.max(most, held(file));
    }));
    if (step % 20 !== 19) continue;
    globalThis.gc?.();
    live = Math.max(live, held(file));
  }
  const all = await file.select({level: 0});
  const seenFaces = all.filter(({group, chart}) => seen.has(`${group}/${chart}`)).reduce((sum, chart) => sum + chart.faces, 0);
  const {fetchedBytes, requests} = file.usage;
  const {size} = file;
  file.close();
  return {seen: seenFaces / faces, fetched: fetchedBytes / size, requests, decoded, most: Math.max(most, live), live};
}
function arraysOf({positions, triangles, points, cells, arrays}) {
  return [positions, triangles, points, cells, ...arrays.map(({values}) => values)].filter(array => array !== null);
}
function sizeOf(drawn) {
  return arraysOf(drawn).reduce((sum, array) => sum + array.byteLength, 0);
}
