// Millions of triangles a second in one worker of a page in Chromium: charts of maille beside Draco, the same mesh on the same
// lattice. CPU time of the worker's thread, where the system tells it (Linux), else time on the clock.
import {existsSync, readdirSync, readFileSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import path from 'node:path';

import {decode} from '../src/maille.js';
import {chromium, launch, newPage, root, serve} from '../test/browser/browser.js';
import {compressed, dracoOf, read, table} from './support.js';

const ROUNDS = 7, LEAST_MS = 300;

/** CPU time of all workers of these processes so far, in ms; null: not known here. */
function cpuOfWorkers(processes) {
  const workers = processes.map(id => `/proc/${id}/task`).filter(existsSync)
    .flatMap(tasks => readdirSync(tasks).map(task => `${tasks}/${task}`))
    .filter(task => readFileSync(`${task}/comm`, 'utf8').startsWith('DedicatedWorker'));
  if (workers.length === 0) return null;
  return workers.reduce((sum, task) => sum + Number(readFileSync(`${task}/schedstat`, 'utf8').split(' ')[0]), 0) / 1e6;
}

/** A worker that decodes: run(times) gives {triangles, ms}, ms of its CPU if that is known. */
async function workerOf(page, processes, task) {
  const handle = await page.evaluateHandle(() => new Worker('/web/bench/decoding_worker.js', {type: 'module'}));
  return async times => {
    const before = cpuOfWorkers(processes);
    const answer = await handle.evaluate((worker, task) => new Promise((resolve, reject) => {
      worker.onmessage = ({data}) => (data.failed ? reject(new Error(data.failed)) : resolve(data));
      worker.onerror = event => reject(new Error(event.message));
      worker.postMessage(task);
    }), {...task, times});
    const after = cpuOfWorkers(processes);
    return {...answer, ms: after === null || !(after > before) ? answer.ms : after - before, isCpu: after > before};
  };
}

const mesh = process.argv[2] ?? 'tri/stanford_dragon_vrip.ply';
const file = compressed(mesh, '--mode', 'random', '-2', '--bits', '14'), drawn = `${file}.drc`;
if (!existsSync(drawn)) {
  const peers = createRequire(process.env.MAILLE_PEERS ? path.join(process.env.MAILLE_PEERS, 'x.js') : import.meta.url);
  writeFileSync(drawn, await dracoOf(peers, await decode(read(file)), 14));
}
if (!chromium) throw new Error('chromium is missing: scripts/setup web');
const browser = await launch(), pages = await serve('serve', '--quiet', '--port', '0', root), files = await serve('serve', '--quiet', '--port', '0', path.dirname(file));
const page = await newPage(browser);
await page.goto(`${pages.address}web/bench/page.html`);
const {processInfo} = await (await browser.newBrowserCDPSession()).send('SystemInfo.getProcessInfo');
const processes = processInfo.filter(({type}) => type === 'renderer').map(({id}) => id);
const address = name => files.address + encodeURIComponent(path.basename(name));
const tasks = {
  'maille, charts to typed arrays': {what: 'maille', address: address(file)},
  'Draco of three.js, level 7, as DRACOLoader': {what: 'draco', address: address(drawn), library: '/web/viewer/node_modules/three/examples/jsm/libs/draco/'},
};
const names = Object.keys(tasks), workers = {}, times = {}, most = {};
for (const name of names) {
  workers[name] = await workerOf(page, processes, tasks[name]);
  const {triangles, ms} = await workers[name](1);  // and compiles
  most[name] = 0;
  times[name] = triangles > 0 ? Math.max(1, Math.ceil(LEAST_MS / ms)) : 1;
}
let isCpu = true;
// In turns: what disturbs one disturbs the other.
for (let round = 0; round < ROUNDS; ++round) {
  for (const name of names) {
    const run = await workers[name](times[name]);
    isCpu &&= run.isCpu;
    most[name] = Math.max(most[name], run.triangles / run.ms / 1000);
  }
}
await browser.close();
await Promise.all([pages.stop(), files.stop()]);
const [own, peer] = names.map(name => most[name]);
table(`Decoding ${path.basename(mesh)} in Chromium, one worker, 14 bits, ${isCpu ? 'CPU time' : 'time on the clock'}`, ['', 'M triangles/s', 'bytes'],
  [...names.map((name, i) => [name, most[name].toFixed(1), read([file, drawn][i]).length]), ['maille over Draco', `${(own / peer).toFixed(1)} x`, '']]);
process.exit(0);
