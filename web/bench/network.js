// What a viewer waits for, fetches and holds: the first picture over a slow line, and a flight over a part of the model.
import path from 'node:path';

import {MeshFile, ready} from '../src/maille.js';
import {fly} from './flight.js';
import {serve} from './server.js';
import {compressed, read, table} from './support.js';

const mesh = process.argv[2] ?? 'tri/stanford_dragon_vrip.ply';
const bytes = read(compressed(mesh, '--mode', 'random', '-2', '--bits', '14')), exact = read(compressed(mesh, '--mode', 'random', '-2'));
await ready();

/** Until the coarsest level of the file is decoded, in ms: the line takes 102 of them for 64 KiB. */
async function firstPicture(bytes, options) {
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
const megabytes = ({length}) => `${(length / 1e6).toFixed(1)} MB`;
for (const [name, file, options] of [
  [`${path.basename(mesh)}, 14 bits, ${megabytes(bytes)}`, bytes, {}],
  ['the same, filled up to 100 MB', bytes, {size: 100e6}],
  ['the same from a server without ranges', bytes, {size: 100e6, ranges: false}],
  [`${path.basename(mesh)}, lossless, ${megabytes(exact)}, filled up to 100 MB`, exact, {size: 100e6}],
]) rows.push([name, ...await firstPicture(file, options)]);
table('First picture over 10 Mbit/s with 50 ms, from open() on', ['file', 'ms', 'CPU ms, with the server', 'triangles', 'bytes'], rows);

const percent = x => `${(100 * x).toFixed(1)} %`, mb = x => (x / 1e6).toFixed(1);
const flights = [];
for (const [budget, share] of [[256e6, 0.5], [8e6, 6.28]]) {
  const server = await serve(bytes);
  const {seen, fetched, requests, decoded, live} = await fly(server.url, {budget, share});
  server.close();
  flights.push([mb(budget), percent(seen), percent(fetched), requests, decoded, mb(live), mb(Math.max(0, live - budget))]);
}
table(`Flying over ${path.basename(mesh)}, 200 views`,
  ['budget, MB', 'charts of the mesh itself that were seen', 'fetched of the file', 'requests', 'charts decoded', 'most held, MB', 'beyond the budget, MB'],
  flights);
process.exit(0);
