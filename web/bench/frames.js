// How long the main thread works for each frame of a flight close above a mesh, charts arriving all the while, from Chromium's
// trace: time of the thread's processor, since a machine that draws with its processor is busy. frames.js [FILE.maille]
import path from 'node:path';

import {chromium, launch, newPage, root, serve} from '../test/browser/browser.js';
import {compressed, table} from './support.js';

/** Of 60 frames a second half is left to the browser and to other programs of the page. */
const ALLOWED_MS = 8;
const CATEGORIES = ['toplevel', 'devtools.timeline', 'disabled-by-default-devtools.timeline', '__metadata'];

/** By frame: ms that tasks of the page's main thread took from its animation frame to the next one. */
function frameTimes(events) {
  const marks = events.filter(({name}) => name === 'FireAnimationFrame'), {pid, tid} = marks[0];
  const ofThread = events.filter(event => event.pid === pid && event.tid === tid);
  const begins = marks.filter(mark => mark.pid === pid).map(({ts}) => ts).sort((a, b) => a - b);
  const tasks = ofThread.filter(({name, ph}) => name === 'RunTask' && ph === 'X');
  const times = new Array(begins.length).fill(0);
  for (const {ts, dur, tdur} of tasks) {
    // The task that calls for a frame begins before it.
    const frame = begins.findLastIndex(begin => begin <= ts + dur);
    if (frame >= 0) times[frame] += (tdur ?? dur) / 1000;
  }
  // The first ones compile shaders and programs.
  return {times: times.slice(10), ofProcessor: tasks.every(({tdur}) => tdur !== undefined)};
}

async function flight(browser, address, file, options) {
  const page = await newPage(browser);
  await page.goto(`${address}web/bench/page.html`);
  await page.waitForFunction(() => window.ready);
  await browser.startTracing(page, {categories: CATEGORIES});
  await page.evaluate(([file, options]) => window.fly(file, options), [file, options]);
  const {traceEvents} = JSON.parse((await browser.stopTracing()).toString());
  const state = await page.evaluate(() => window.flight);
  if (page.complaints.length > 0) console.error(page.complaints.slice(0, 3).join('\n'));
  await page.close();
  return {...frameTimes(traceEvents), state};
}

if (!chromium) throw new Error('chromium is missing: scripts/setup web');
const file = process.argv[2] ? path.resolve(process.argv[2]) : compressed('tri/stanford_dragon_vrip.ply', '--mode', 'random', '-2', '--bits', '14');
const files = await serve('serve', '--quiet', '--port', '0', path.dirname(file)), address = files.address + encodeURIComponent(path.basename(file));
const browser = await launch(), pages = await serve('serve', '--quiet', '--port', '0', root), rows = [];
let all = true;
for (const pixels of [1.5, 0.75]) {
  const {times, ofProcessor, state} = await flight(browser, pages.address, address, {budget: 256e6, pixels, views: 400, frames: 0, drawn: true});
  all &&= ofProcessor;
  times.sort((a, b) => a - b);
  const within = times.filter(ms => ms <= ALLOWED_MS).length / times.length, at = share => times[Math.min(times.length - 1, Math.floor(share * times.length))].toFixed(1);
  rows.push([`errors of ${pixels} pixels`, times.length, (state.triangles / 1e6).toFixed(2), state.charts, at(0.5), at(0.95), at(0.99), at(1), `${(100 * within).toFixed(1)} %`]);
}
await browser.close();
await Promise.all([pages.stop(), files.stop()]);
table(`Main thread, ms a frame while flying over ${path.basename(file)}, ${all ? 'time of its processor' : 'time on the clock'}`,
  ['', 'frames', 'million triangles drawn', 'charts held', 'median', '95 %', '99 %', 'most', `within ${ALLOWED_MS} ms`], rows);
process.exit(0);
