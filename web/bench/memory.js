// What a flight close above a large mesh holds: JavaScript and WebAssembly, in Chromium those of the page and of its workers,
// while it flies. memory.js [FILE.maille]: of mode random; the larger the better.
import path from 'node:path';

import {chromium, launch, newPage, root, serve} from '../test/browser/browser.js';
import {fly} from './flight.js';
import {compressed, table} from './support.js';

const BUDGET = 256e6, ALLOWED = 64e6;

/** Heaps of a page and its workers, as DevTools sees them: of objects, and of what they have outside the heap. */
class Heaps {
  static async of(page) {
    const heaps = new Heaps();
    Object.assign(heaps, {session: await page.context().newCDPSession(page), workers: new Set(), asked: new Map(), number: 0});
    heaps.session.on('Target.attachedToTarget', ({sessionId, targetInfo}) => { if (targetInfo.type === 'worker') heaps.workers.add(sessionId); });
    heaps.session.on('Target.detachedFromTarget', ({sessionId}) => heaps.workers.delete(sessionId));
    heaps.session.on('Target.receivedMessageFromTarget', ({message}) => {
      const {id, result} = JSON.parse(message);
      heaps.asked.get(id)?.(result);
      heaps.asked.delete(id);
    });
    await heaps.session.send('Target.setAutoAttach', {autoAttach: true, waitForDebuggerOnStart: false, flatten: false});
    return heaps;
  }
  async #ofWorkers(method) {
    return Promise.all([...this.workers].map(sessionId => new Promise((resolve, reject) => {
      const id = ++this.number;
      this.asked.set(id, resolve);
      this.session.send('Target.sendMessageToTarget', {sessionId, message: JSON.stringify({id, method})}).catch(reject);
    })));
  }
  async collectGarbage() {
    await this.session.send('HeapProfiler.collectGarbage');
    await this.#ofWorkers('HeapProfiler.collectGarbage');
  }
  /** {objects, buffers, workers}, in bytes; the first two of the page. */
  async sizes() {
    const sum = heap => heap.usedSize + heap.backingStorageSize;
    const page = await this.session.send('Runtime.getHeapUsage');
    const workers = (await this.#ofWorkers('Runtime.getHeapUsage')).reduce((total, heap) => total + sum(heap), 0);
    return {objects: page.usedSize, buffers: page.backingStorageSize, workers};
  }
}

async function flight(browser, address, file, options) {
  const page = await newPage(browser), heaps = await Heaps.of(page);
  await page.goto(`${address}web/bench/page.html`);
  await page.waitForFunction(() => window.ready);
  const flown = page.evaluate(([file, options]) => window.fly(file, options), [file, options]);
  const most = {all: 0}, live = {all: 0};
  const look = async to => {
    const {objects, buffers, workers} = await heaps.sizes(), state = await page.evaluate(() => window.flight);
    if (!state) return state;
    const {decoderBytes: wasm, cacheBytes: cache} = state.usage, all = objects + buffers + workers + wasm;
    if (process.env.TRACE) console.error(JSON.stringify({all, objects, buffers, workers, wasm, cache, step: state.step, held: state.held, charts: state.charts, triangles: state.triangles}));
    if (all > to.all) Object.assign(to, {all, objects, buffers, workers, wasm, cache, held: state.held});
    return state;
  };
  let state = null;
  for (let i = 1; !state?.over; ++i) {
    await new Promise(resolve => setTimeout(resolve, 100));
    state = await look(most);
    // What is in use, without what waits for being collected.
    if (i % 20 === 0 || state?.over) {
      await heaps.collectGarbage();
      await look(live);
    }
  }
  await flown;
  if (page.complaints.length > 0) console.error(page.complaints.slice(0, 3).join('\n'));
  await page.close();
  return {most, live, state};
}

const file = process.argv[2] ? path.resolve(process.argv[2]) : compressed('tri/stanford_dragon_vrip.ply', '--mode', 'random', '-2', '--bits', '14');
const files = await serve('serve', '--quiet', '--port', '0', path.dirname(file)), address = files.address + encodeURIComponent(path.basename(file));
const mb = x => (x / 1e6).toFixed(0), verdict = most => `${most <= BUDGET + ALLOWED ? 'within' : 'beyond'} ${mb(BUDGET + ALLOWED)}`;
const title = `while flying over ${path.basename(file)}, budget ${mb(BUDGET)} MB, in MB`;

const inNode = [];
for (const [name, options] of [['errors of 0.75 pixels', {pixels: 0.75}], ['4 million triangles in each view', {maxFaces: 4e6}]]) {
  const {most, live, decoded, seen} = await fly(address, {budget: BUDGET, share: 3, ...options});
  inNode.push([name, decoded, `${(100 * seen).toFixed(0)} %`, mb(most), mb(live), verdict(most)]);
}
table(`Memory in node ${title}`, ['', 'charts decoded', 'of the mesh itself seen', 'at most', 'at most, without garbage', ''], inNode);

if (!chromium) throw new Error('chromium is missing: scripts/setup web');
const browser = await launch(), pages = await serve('serve', '--quiet', '--port', '0', root), rows = [];
for (const [name, options] of [['errors of 0.75 pixels', {pixels: 0.75}], ['the mesh itself wherever it is seen', {pixels: 1e-9}]]) {
  const {most, live, state} = await flight(browser, pages.address, address, {budget: BUDGET, views: 200, frames: 30, ...options});
  rows.push([name, (state.triangles / 1e6).toFixed(1), mb(most.held), mb(most.objects), mb(most.buffers), mb(most.workers), mb(most.wasm), mb(most.all), mb(live.all),
    verdict(most.all)]);
}
await browser.close();
await Promise.all([pages.stop(), files.stop()]);
table(`Memory in Chromium, of a page with four workers, ${title}`,
  ['', 'million triangles drawn', 'counted by maxBytes', 'page: objects', 'page: buffers', 'workers', 'WebAssembly', 'at most', 'at most, without garbage', ''], rows);
process.exit(0);
