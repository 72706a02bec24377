// GLTFLoader of three.js with our plug-in in a real browser: the same picture as of the original.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {copyFileSync, mkdirSync} from 'node:fs';
import path from 'node:path';
import {after, before, test} from 'node:test';

import {models, pathOf} from '../meshes.js';
import {chromium, launch, maille, newPage, root, screenshot, serve} from './browser.js';

const skip = chromium ? false : 'chromium is missing: scripts/setup web';
const folder = path.join(root, 'build/web');
let browser, server, page;

before(async () => {
  if (skip) return;
  mkdirSync(folder, {recursive: true});
  for (const model of models) {
    const original = pathOf(model), name = path.basename(model, '.glb');
    copyFileSync(original, path.join(folder, `${name}.glb`));
    execFileSync(maille, ['compress', '-q', '-f', original, path.join(folder, `${name}.maille.glb`)]);
    execFileSync(maille, ['compress', '-q', '-f', '-9', '--for', 'web', original, path.join(folder, `${name}.lossy.maille.glb`)]);
  }
  browser = await launch();
  server = await serve('serve', '--quiet', '--port', '0', root);
  page = await newPage(browser, {width: 400, height: 300});
  await page.goto(`${server.address}web/test/browser/gltf.html`);
  await page.waitForFunction(() => window.show);
});
after(async () => {
  await browser?.close();
  await server?.stop();
});

const show = url => page.evaluate(url => window.show(url), url);

/** Parts of the picture that differ by more than 2 of 255. */
function different(a, b) {
  let count = 0;
  for (let i = 0; i < a.length; i += 4) count += [0, 1, 2].some(k => Math.abs(a[i + k] - b[i + k]) > 2);
  return count / (a.length / 4);
}

for (const name of models.map(model => path.basename(model, '.glb'))) {
  test(`${name}: the same scene and picture`, {skip}, async () => {
    const original = await show(`/build/web/${name}.glb`), exact = await show(`/build/web/${name}.maille.glb`);
    await screenshot(page, `gltf-${name}`);
    assert.deepEqual(exact.meshes, original.meshes);
    assert.ok(new Set(original.pixels).size > 20, 'there is something to see');
    const exactly = different(original.pixels, exact.pixels);
    const lossy = await show(`/build/web/${name}.lossy.maille.glb`), loosely = different(original.pixels, lossy.pixels);
    console.log(`${name}: ${100 * exactly} % of pixels differ, with loss ${100 * loosely} %`);
    assert.equal(exactly, 0);
    assert.ok(loosely <= 0.001);
    assert.deepEqual(page.complaints.splice(0), []);
  });
}
