// What a viewer waits for, fetches and holds: the first picture over a slow line, and a flight over a part of the model.
import path from 'node:path';

import {MeshFile, ready} from '../src/maille.js';
import {serve} from './server.js';
import {compressed, read, table} from './support.js';

const mesh = process.argv[2] ?? 'tri/stanford_dragon_vrip.ply';
const bytes = read(compressed(mesh, '--mode', 'random', '-2', '--bits', '14'));
await ready();

/** Until the coarsest level of the file is decoded, in ms: the line takes 102 of them for 64 KiB. */
async function firstPicture(options) {
  const server = await serve(bytes, {bitsPerSecond: 10e6, delay: 50, ...options});
  const begin = performance.now(), cpu = process.cpuUsage();
  const file = await MeshFile.open(server.url, {maxWhole: Infinity});
  let triangles = 0;
  for (const chart of await file.select()) triangles += (await file.decodeNode(chart)).triangles.length / 3;
  const ms = performance.now() - begin, {user, system} = process.cpuUsage(cpu), {fetchedBytes} = file.usage;
  file.close();
  server.close();
  return [ms.toFixed(0), ((user + system) / 1000).toFixed(0), triangles, fetchedBytes];
}
const rows = [];
for (const [name, options] of [
  [`${path.basename(mesh)}, ${(bytes.length / 1e6).toFixed(1)} MB`, {}],
  ['the same, filled up to 100 MB', {size: 100e6}],
  ['the same from a server without ranges', {size: 100e6, ranges: false}],
]) rows.push([name, ...await firstPicture(options)]);
table('First picture over 10 Mbit/s with 50 ms, from open() on', ['file', 'ms', 'CPU ms, with the server', 'triangles', 'bytes'], rows);

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

/** Memory of JavaScript and WebAssembly, in bytes: all of the page's, this benchmark's, and some of node's. */
function held(file) {
  globalThis.gc?.();
  const {heapUsed, arrayBuffers} = process.memoryUsage();
  return heapUsed + arrayBuffers + file.usage.decoderBytes;
}

/**
 * Flies close above a part of the model, as MailleObject does: charts of every view are fetched and kept up to a budget, the
 * ones not seen for longest go. Pixels: errors of one and a half in 1080 lines.
 */
async function fly(budget, share) {
  const server = await serve(bytes);
  const file = await MeshFile.open(server.url), {centre, radius} = file.sphere;
  const kept = new Map(), seen = new Set();
  let keptBytes = 0, most = 0, decoded = 0;
  const faces = file.levels[0].faces;
  for (let step = 0; step < 200; ++step) {
    const angle = step / 200 * share, at = [Math.cos(angle), 0.2, Math.sin(angle)].map((x, k) => centre[k] + 0.5 * radius * x);
    const eye = at.map((x, k) => centre[k] + (x - centre[k]) * 1.6), lines = 1080, fov = Math.PI / 4;
    const planes = frustum(eye, at, 16 / 9, fov, radius * 1e-3, radius * 0.6);
    const charts = await file.select({planes, view: {eye, pixelsPerRadian: lines / (2 * Math.tan(fov / 2)), pixels: 1.5}});
    await Promise.all(charts.map(async chart => {
      const key = `${chart.group}/${chart.chart}`, known = kept.get(key);
      if (chart.level === 0) seen.add(key);
      kept.delete(key);
      const drawn = known ?? await file.decodeNode(chart);
      kept.set(key, drawn);
      if (known) return;
      ++decoded;
      keptBytes += sizeOf(drawn);
    }));
    for (const [key, drawn] of kept) {
      if (keptBytes <= budget) break;
      kept.delete(key);
      keptBytes -= sizeOf(drawn);
    }
    if (step % 20 === 19) most = Math.max(most, held(file));
  }
  const all = await file.select({level: 0});
  const seenFaces = all.filter(({group, chart}) => seen.has(`${group}/${chart}`)).reduce((sum, chart) => sum + chart.faces, 0);
  const {fetchedBytes, requests} = file.usage;
  file.close();
  server.close();
  return {seen: seenFaces / faces, fetched: fetchedBytes / bytes.length, requests, decoded, most, keptBytes};
}
function sizeOf(drawn) {
  return drawn.positions.byteLength + drawn.triangles.byteLength + drawn.points.byteLength + drawn.cells.byteLength +
    drawn.arrays.reduce((sum, array) => sum + array.values.byteLength, 0);
}
const percent = x => `${(100 * x).toFixed(1)} %`, mb = x => (x / 1e6).toFixed(1);
const flights = [];
for (const [budget, share] of [[256e6, 0.5], [8e6, 6.28]]) {
  const {seen, fetched, requests, decoded, most} = await fly(budget, share);
  flights.push([mb(budget), percent(seen), percent(fetched), requests, decoded, mb(most), mb(Math.max(0, most - budget))]);
}
table(`Flying over ${path.basename(mesh)}, 200 views`,
  ['budget, MB', 'charts of the mesh itself that were seen', 'fetched of the file', 'requests', 'charts decoded', 'most held, MB', 'beyond the budget, MB'],
  flights);
process.exit(0);
