// The viewer with servers that fail: no ranges, busy, slow, cut off, changed.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {existsSync, mkdirSync, readFileSync} from 'node:fs';
import {createServer} from 'node:http';
import path from 'node:path';
import {after, before, test} from 'node:test';

import {pathOf, scan} from '../meshes.js';
import {chromium, drawn, launch, maille, newPage, PATIENCE, root, screenshot, settle} from './browser.js';

const viewer = path.join(root, 'web/dist/viewer');
const skip = !chromium ? 'chromium is missing: scripts/setup web' : !existsSync(viewer) ? 'the viewer was not built: scripts/build-viewer' : false;
const types = {'.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.wasm': 'application/wasm', '.svg': 'image/svg+xml'};
let browser, server, address, mesh, behave;

before(async () => {
  if (skip) return;
  mkdirSync(path.join(root, 'build/web'), {recursive: true});
  const file = path.join(root, 'build/web/faults.maille');
  execFileSync(maille, ['compress', '-q', '-f', '--mode', 'random', '--bits', '16', pathOf(scan), file]);
  mesh = readFileSync(file);
  server = createServer((request, response) => {
    const name = new URL(request.url, 'http://here').pathname;
    if (name !== '/mesh.maille') return giveFile(path.join(viewer, name === '/' ? 'index.html' : name), response);
    if (!behave?.(request, response)) giveRange(request, response);
  });
  await new Promise(resolve => server.listen(0, '127.0.0.1', resolve));
  address = `http://127.0.0.1:${server.address().port}`;
  browser = await launch();
});
after(async () => {
  await browser?.close();
  server?.close();
  server?.closeAllConnections();
});

function giveFile(file, response) {
  if (!existsSync(file)) return response.writeHead(404).end();
  response.writeHead(200, {'Content-Type': types[path.extname(file)] ?? 'application/octet-stream'}).end(readFileSync(file));
}
function rangeOf(request) {
  const [, first, last] = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range).map(Number);
  return [first, Math.min(last + 1, mesh.length)];
}
function giveRange(request, response, etag = '"one"') {
  const [begin, end] = rangeOf(request);
  response.writeHead(206, {'Content-Range': `bytes ${begin}-${end - 1}/${mesh.length}`, 'Content-Length': end - begin, ETag: etag});
  response.end(mesh.subarray(begin, end));
}
const isFront = request => request.headers.range?.startsWith('bytes=0-');

async function openWith(behaviour) {
  behave = behaviour;
  const page = await newPage(browser);
  await page.goto(`${address}/?file=/mesh.maille`);
  return page;
}
/** More than the front of the file has. */
async function wantAll(page) {
  await page.waitForFunction(() => window.viewer?.model?.triangles > 0);
  await page.evaluate(() => viewer.settings.setTarget(0.01));
}
const trianglesOf = page => page.evaluate(() => viewer.model?.triangles ?? 0);

test('without ranges the whole file is read, and shown while it comes', {skip}, async () => {
  let release, sent;
  const halfSent = new Promise(resolve => { sent = resolve; });
  const page = await openWith((request, response) => {
    response.writeHead(200, {'Content-Length': mesh.length});
    response.write(mesh.subarray(0, 70_000), sent);
    release = () => response.end(mesh.subarray(70_000));
    return true;
  });
  await halfSent;
  await page.waitForFunction(() => window.viewer?.model?.triangles > 0);
  const early = await trianglesOf(page);
  release();
  await settle(page);
  assert.ok(await trianglesOf(page) >= early && early > 0);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('a server that is busy is asked again', {skip}, async () => {
  let refused = 0;
  const page = await openWith((request, response) => {
    if (refused++ > 1) return false;
    response.writeHead(500).end();
    return true;
  });
  await settle(page);
  assert.ok(await trianglesOf(page) > 0 && refused > 2);
  await page.close();
});

test('while a server stands still the page shows what it has, and goes on afterwards', {skip}, async () => {
  const waiting = [];
  const page = await openWith((request, response) => !isFront(request) && waiting.push([request, response]) > 0);
  await wantAll(page);
  while (waiting.length === 0) await page.waitForTimeout(50);
  const early = await trianglesOf(page);
  await page.mouse.move(300, 300);
  await page.mouse.down();
  await page.mouse.move(340, 320, {steps: 3});
  await page.mouse.up();
  assert.ok(await trianglesOf(page) > 0);
  behave = null;
  for (const [request, response] of waiting) giveRange(request, response);
  await settle(page);
  assert.ok(await trianglesOf(page) > early);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('bodies that are cut off, and a network that is lost, are a sentence; trying again helps', {skip}, async () => {
  for (const fail of [
    (request, response) => {
      const [begin, end] = rangeOf(request);
      response.writeHead(206, {'Content-Range': `bytes ${begin}-${end - 1}/${mesh.length}`, 'Content-Length': end - begin, ETag: '"one"'});
      response.write(mesh.subarray(begin, begin + 10), () => response.destroy());
    },
    (request, response) => response.destroy(),
  ]) {
    const page = await openWith((request, response) => {
      if (isFront(request)) return false;
      fail(request, response);
      return true;
    });
    await wantAll(page);
    await page.waitForSelector('.message.bad', {timeout: PATIENCE});
    assert.ok(await trianglesOf(page) > 0);
    await screenshot(page, 'network-lost');
    behave = null;
    await page.click('.message.bad button:not([title])');
    await settle(page);
    await page.waitForFunction(() => viewer.model.object.error <= viewer.target);
    await page.close();
  }
});

test('a file that changed on the server is noticed', {skip}, async () => {
  const page = await openWith((request, response) => {
    giveRange(request, response, isFront(request) ? '"one"' : '"two"');
    return true;
  });
  await wantAll(page);
  await page.waitForSelector('.message.bad');
  assert.match(await page.textContent('.message.bad'), /changed/);
  await page.close();
});

test('a server that lies about the size of a file is a sentence, or does no harm', {skip}, async () => {
  for (const size of [70_000, mesh.length - 1, mesh.length + 1, 1000 * mesh.length, 9e15]) {
    const page = await openWith((request, response) => {
      const [begin, end] = rangeOf(request);
      if (begin >= mesh.length) return response.writeHead(416).end();
      response.writeHead(206, {'Content-Range': `bytes ${begin}-${end - 1}/${size}`, 'Content-Length': end - begin, ETag: `"${size}"`});
      return response.end(mesh.subarray(begin, end));
    });
    const told = page.waitForSelector('.message.bad'), shown = wantAll(page).then(() => settle(page));
    await Promise.race([told, shown]);
    behave = null;
    assert.equal(await page.evaluate(() => viewer.open('/mesh.maille')), true);
    await page.waitForFunction(() => viewer.model.triangles > 0 && viewer.done);
    told.catch(() => {});
    await page.close();
    await shown.catch(() => {});
  }
});

test('what the graphics card has lost is drawn again', {skip}, async () => {
  const page = await openWith(null);
  await settle(page);
  await drawn(page);
  const before = await page.evaluate(async () => {
    const {stage} = viewer, gl = stage.renderer.getContext(), lost = gl.getExtension('WEBGL_lose_context');
    window.picture = () => {
      const pixels = new Uint8Array(4 * 100 * 100);
      stage.draw();
      gl.readPixels(gl.drawingBufferWidth / 2 - 50, gl.drawingBufferHeight / 2 - 50, 100, 100, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
      return pixels.join();
    };
    // What is lost can be given back once all have been told of it.
    const told = event => new Promise(resolve => stage.canvas.addEventListener(event, () => setTimeout(resolve), {once: true}));
    const first = picture(), gone = told('webglcontextlost'), restored = told('webglcontextrestored');
    lost.loseContext();
    await gone;
    lost.restoreContext();
    await restored;
    return first;
  });
  assert.ok(new Set(before.split(',')).size > 20, 'there is something to see');
  await page.waitForFunction(first => picture() === first, before, {timeout: PATIENCE, polling: 200});
  await page.close();
});

test('a page that is hidden while it loads shows the mesh when it is seen', {skip}, async () => {
  const page = await newPage(browser);
  behave = null;
  // Browsers give hidden pages no frames.
  await page.addInitScript(() => {
    const give = requestAnimationFrame.bind(window), waiting = [];
    window.requestAnimationFrame = call => (waiting.seen ? give(call) : waiting.push(call));
    window.becomeSeen = () => {
      waiting.seen = true;
      for (const call of waiting.splice(0)) give(call);
    };
  });
  await page.goto(`${address}/?file=/mesh.maille`);
  await page.waitForFunction(() => window.viewer?.model, null, {polling: 100});
  await page.waitForTimeout(1500);  // for what should not come; a slow machine makes this say less, not fail
  assert.equal(await trianglesOf(page), 0);
  await page.evaluate(() => becomeSeen());
  await settle(page);
  assert.ok(await trianglesOf(page) > 0);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('a server that allows no pages of others is named as that', {skip}, async () => {
  const closed = createServer((request, response) => response.writeHead(200).end('no header allows this'));
  await new Promise(resolve => closed.listen(0, '127.0.0.1', resolve));
  const page = await newPage(browser);
  await page.goto(`${address}/?file=http://127.0.0.1:${closed.address().port}/mesh.maille`);
  await page.waitForSelector('.message.bad');
  assert.match(await page.textContent('.message.bad'), /^http:.*CORS/);
  behave = null;
  assert.equal(await page.evaluate(() => viewer.open('/mesh.maille')), true);
  await settle(page);
  assert.ok(await trianglesOf(page) > 0);
  await page.close();
  closed.close();
});

test('a chart that is damaged is an event of the object, and a rejected promise of the file', {skip}, async () => {
  behave = null;
  const whole = mesh;
  mesh = Buffer.from(whole);
  mesh.fill(255, Math.floor(0.8 * mesh.length), Math.floor(0.8 * mesh.length) + 100);
  const page = await newPage(browser);
  await page.goto(`${address}/?file=/mesh.maille`);
  await page.waitForFunction(() => window.viewer?.model);
  const {said, rejected} = await page.evaluate(async () => {
    const {object, file} = viewer.model;
    const event = new Promise(resolve => object.addEventListener('error', resolve));
    viewer.settings.setTarget(0.01);
    const {error, chart} = await event;
    return {said: error.message, rejected: await file.decodeNode(chart).then(() => '', ({code, message}) => `${code} ${message}`)};
  });
  assert.match(said, /chart \d+ of group \d+ .*damaged/);
  assert.equal(rejected, `6 ${said}`);
  await page.close();
  mesh = whole;
});

test('a file dropped onto the page is opened; of another one the page says what it is not', {skip}, async () => {
  const page = await newPage(browser);
  await page.goto(address);
  await page.waitForSelector('#start:not([hidden])');
  const drop = (name, bytes) => page.evaluate(([name, numbers]) => {
    const transfer = new DataTransfer();
    transfer.items.add(new File([new Uint8Array(numbers)], name));
    dispatchEvent(new DragEvent('drop', {dataTransfer: transfer, cancelable: true}));
  }, [name, [...bytes]]);
  await drop('photo.jpg', Buffer.from('not a mesh, but longer than a header'));
  await page.waitForSelector('.message.bad');
  assert.match(await page.textContent('.message.bad'), /^photo\.jpg: is no \.maille file/);
  assert.ok(await page.isVisible('#start'));
  await drop('dropped.maille', mesh);
  await settle(page);
  assert.equal(await page.textContent('#file-name'), 'dropped.maille');
  assert.ok(await trianglesOf(page) > 0);
  assert.ok(!await page.isVisible('.message.bad'));
  assert.deepEqual(page.complaints, []);
  await page.close();
});
