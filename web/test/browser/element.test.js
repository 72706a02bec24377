// <maille-viewer> in pages of a static host: as the package has it, and from another origin.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {existsSync, mkdirSync, writeFileSync} from 'node:fs';
import path from 'node:path';
import {after, before, test} from 'node:test';

import {bear, cloth, flow, pathOf, scan, trianglesOfScene} from '../meshes.js';
import {count} from '../../viewer/src/text.js';
import {chromium, drawn, launch, maille, newPage, PATIENCE, root, screenshot, serve} from './browser.js';

const built = path.join(root, 'web/dist/element/maille-viewer.js');
const skip = !chromium ? 'chromium is missing: scripts/setup web' : !existsSync(built) ? 'the element was not built: scripts/build-viewer' : false;
const folder = path.join(root, 'build/web/element');
let browser, server, other;

/** The ten lines of docs/viewer.md. */
const pageWith = (script, attributes) => `<!doctype html>
<html lang="en">
<meta charset="utf-8">
<title>A page</title>
<link rel="icon" href="data:,">
<h1>A scan</h1>
<script type="module" src="${script}"></script>
<maille-viewer ${attributes}></maille-viewer>
</html>
`;

before(async () => {
  if (skip) return;
  mkdirSync(folder, {recursive: true});
  for (const [mesh, name, ...options] of [[scan, 'armadillo', '--mode', 'random', '--bits', '14'], [bear, 'bear'], [flow.mesh, 'pieces', '--pieces', String(flow.pieces)], [cloth, 'cloth.maille.glb']])
    execFileSync(maille, ['compress', '-q', '-f', ...options, pathOf(mesh), path.join(folder, name.includes('.') ? name : `${name}.maille`)]);
  browser = await launch();
  server = await serve('serve', '--quiet', '--port', '0', root);
  other = await serve('serve', '--quiet', '--port', '0', path.join(root, 'web'));
});
after(async () => {
  await browser?.close();
  await server?.stop();
  await other?.stop();
});

async function openPage(name, attributes, script = '../../../web/dist/element/maille-viewer.js') {
  writeFileSync(path.join(folder, `${name}.html`), pageWith(script, attributes));
  const page = await newPage(browser, {width: 640, height: 520});
  await page.goto(`${server.address}build/web/element/${name}.html`);
  await page.waitForFunction(() => customElements.get('maille-viewer'));
  return page;
}
const settled = page => page.waitForFunction(() => document.querySelector('maille-viewer').settled, null, {timeout: PATIENCE, polling: 100});

const facesOf = file => JSON.parse(execFileSync(maille, ['info', '--json', file], {encoding: 'utf8'})).cells;
for (const [name, about] of [['armadillo', () => `${count(facesOf(path.join(folder, 'armadillo.maille')))} faces`], ['bear', () => 'triangles shown'], ['pieces', () => '11 pieces'],
  ['cloth.maille.glb', () => `${count(trianglesOfScene(pathOf(cloth)))} triangles · 1 material`]]) {
  test(`${name} is shown by the element, with a label that tells what it is`, {skip}, async () => {
    const page = await openPage(name, `src="${name.includes('.') ? name : `${name}.maille`}" alt="A thing of clay."`);
    await settled(page);
    const label = await page.evaluate(() => document.querySelector('maille-viewer').shadowRoot.querySelector('canvas').ariaLabel ??
      document.querySelector('maille-viewer').shadowRoot.querySelector('canvas').getAttribute('aria-label'));
    assert.match(label, /^A thing of clay\. /);
    assert.ok(label.includes(about()), `${label} ${about()}`);
    await drawn(page);
    await screenshot(page, `element-${name}`);
    assert.deepEqual(page.complaints, []);
    await page.close();
  });
}

test('keys turn, move and approach a mesh, and Home shows all of it again', {skip}, async () => {
  const page = await openPage('keys', 'src="bear.maille"');
  await settled(page);
  const eye = () => page.evaluate(() => document.querySelector('maille-viewer').stage.camera.position.toArray().map(x => x.toPrecision(4)).join());
  await page.evaluate(() => document.querySelector('maille-viewer').fit());
  const places = [await eye()];
  await page.keyboard.press('Tab');
  for (const key of ['ArrowRight', 'ArrowUp', 'Shift+ArrowLeft', '+']) {
    await page.keyboard.press(key);
    places.push(await eye());
  }
  assert.equal(new Set(places).size, 5, places.join(' '));
  await page.keyboard.press('Home');
  assert.equal(await eye(), places[0]);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('the module may come from another origin, as from a network that delivers packages', {skip}, async () => {
  const page = await openPage('elsewhere', 'src="armadillo.maille" theme="light" colour="none"', `${other.address}dist/element/maille-viewer.js`);
  await settled(page);
  assert.ok(await page.evaluate(() => document.querySelector('maille-viewer').model.triangles > 1000));
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('attributes may change, and what is gone from the page is given back', {skip}, async () => {
  const page = await openPage('changes', 'src="bear.maille" theme="none" auto-rotate');
  await settled(page);
  const said = await page.evaluate(async scalar => {
    const element = document.querySelector('maille-viewer'), gl = element.stage.renderer.getContext(), corner = new Uint8Array(4);
    element.stage.draw();
    gl.readPixels(2, 2, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, corner);
    const loaded = new Promise(resolve => element.addEventListener('load', ({detail}) => resolve(detail.about), {once: true}));
    element.setAttribute('src', 'pieces.maille');
    const about = await loaded, picture = await element.toBlob();
    element.setAttribute('colour', scalar);
    const {field} = element.colouring;
    element.setAttribute('up', 'z');
    element.remove();
    await new Promise(resolve => setTimeout(resolve));
    return {about, picture: picture.size, field: field.name, stage: element.stage, behind: corner[3]};
  }, flow.scalar);
  assert.match(said.about, /11 pieces/);
  assert.ok(said.picture > 1000 && said.field === flow.scalar && said.stage === null && said.behind === 0, JSON.stringify(said));
  await page.close();
});

test('what cannot be shown is a sentence in its place, and an event', {skip}, async () => {
  const page = await openPage('wrong', 'src="none.maille"');
  await page.waitForFunction(() => document.querySelector('maille-viewer').shadowRoot.querySelector('.says').textContent.includes('404'));
  const message = await page.evaluate(() => new Promise(resolve => {
    const element = document.querySelector('maille-viewer');
    element.addEventListener('error', ({detail}) => resolve(detail.message));
    element.open(new Blob(['this is no mesh at all, only a text']));
  }));
  assert.match(message, /no \.maille file/);
  await page.close();
});

test('the example page shows a mesh without a network', {skip}, async () => {
  const page = await newPage(browser, {width: 640, height: 480});
  await page.route(address => !address.href.startsWith(server.address), route => route.abort());
  await page.goto(`${server.address}examples/web/?file=/build/web/element/armadillo.maille`);
  await page.waitForFunction(() => document.querySelector('maille-viewer').settled);
  await screenshot(page, 'example-element');
  assert.deepEqual(page.complaints.filter(text => !text.includes('favicon')), []);
  await page.close();
});
