// MailleLoader and MailleObject in a real browser: what they show is without cracks at every moment, as fine as asked for,
// within their memory, and what they tell of is exact.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import path from 'node:path';
import {after, before, test} from 'node:test';

import {bear, can, painted, pathOf, quads, scan} from '../meshes.js';
import {chromium, launch, maille, newPage, root, screenshot, serve} from './browser.js';

const skip = chromium ? false : 'chromium is missing: scripts/setup web';
const folder = path.join(root, 'build/web');
let browser, server, page;

before(async () => {
  if (skip) return;
  mkdirSync(folder, {recursive: true});
  for (const [mesh, name, ...options] of [[scan, 'armadillo', '--mode', 'random', '--bits', '14'], [bear, 'bear'], [quads, 'quads', '--mode', 'random'], [painted, 'textured'],
    [can.mesh, 'can']])
    execFileSync(maille, ['compress', '-q', '-f', ...options, pathOf(mesh), path.join(folder, `${name}.maille`)]);
  browser = await launch();
  server = await serve('serve', '--quiet', '--port', '0', root);
  page = await newPage(browser, {width: 640, height: 480});
  await page.goto(`${server.address}web/test/browser/page.html`);
  await page.waitForFunction(() => window.maille);
});
after(async () => {
  await browser?.close();
  await server?.stop();
});

function complaints() {
  return page.complaints.splice(0);
}

test('the loader gives geometry of every mode, with progress', {skip}, async () => {
  const loaded = await page.evaluate(async () => {
    const loader = new maille.MailleLoader().setPath('/build/web/').setWorkerLimit(1).preload(), found = {};
    for (const name of ['bear', 'armadillo', 'can', 'textured']) {
      const events = [];
      const geometry = await loader.loadAsync(`${name}.maille`, event => events.push(event));
      found[name] = {
        triangles: geometry.index.count / 3, attributes: Object.keys(geometry.attributes).sort(), size: events.at(-1).total,
        loaded: events.at(-1).loaded, inside: geometry.index.array.every(i => i < geometry.getAttribute('position').count),
      };
    }
    return found;
  });
  const [, faces] = readFileSync(pathOf(bear), 'utf8').split('\n')[1].split(' ').map(Number);
  assert.equal(loaded.bear.triangles, faces);
  for (const {triangles, inside, size} of Object.values(loaded)) assert.ok(triangles > 0 && inside && size > 1000);
  assert.ok(loaded.textured.attributes.includes('uv'), String(loaded.textured.attributes));
  assert.deepEqual(complaints(), []);
});

/** A triangle that two nodes of three use, and one of the third, far away. */
function threeNodes() {
  const numbers = new Float32Array([0, 0, 0, 1, 0, 0, 0, 2, 0, 5, 5, 5, 6, 5, 5, 5, 6, 5]), bytes = Buffer.from(numbers.buffer);
  const mesh = accessor => ({primitives: [{attributes: {POSITION: accessor}}]});
  const accessor = (byteOffset, min, max) => ({bufferView: 0, byteOffset, componentType: 5126, count: 3, type: 'VEC3', min, max});
  return JSON.stringify({
    asset: {version: '2.0'}, scene: 0, scenes: [{nodes: [0, 1, 2]}], meshes: [mesh(0), mesh(1)],
    nodes: [{name: 'large', mesh: 0, scale: [2, 2, 2]}, {name: 'far', mesh: 1}, {name: 'moved', mesh: 0, translation: [0, 0, 9]}],
    accessors: [accessor(0, [0, 0, 0], [1, 2, 0]), accessor(36, [5, 5, 5], [6, 6, 5])], bufferViews: [{buffer: 0, byteLength: 72}],
    buffers: [{byteLength: 72, uri: `data:application/octet-stream;base64,${bytes.toString('base64')}`}],
  });
}

test('blocks are where the nodes of the scene put them, with vertices of their own', {skip}, async () => {
  const gltf = path.join(folder, 'nodes.gltf');
  writeFileSync(gltf, threeNodes());
  for (const mode of ['single', 'random']) {
    execFileSync(maille, ['compress', '-q', '-f', '--mode', mode, gltf, path.join(folder, 'nodes.maille')]);
    const shown = await page.evaluate(async () => {
      const {MeshFile, THREE, toGeometry, toInstances} = maille, file = await MeshFile.open('/build/web/nodes.maille');
      const geometry = toGeometry(await file.decode({drawn: true})), group = toInstances(geometry, await file.readInstances());
      const all = toInstances(geometry, []);
      file.close();
      const box = (object, {boundingBox: {min, max}}) => [min, max].map(p => p.clone().applyMatrix4(object.matrix).toArray().map(x => Math.round(x) + 0));
      return {
        meshes: group.children.map(mesh => [mesh.name, mesh.userData.block, mesh.geometry.index.count, ...box(mesh, mesh.geometry)]),
        shared: group.children.every(mesh => mesh.geometry.attributes.position === geometry.attributes.position),
        all: all.children.map(mesh => box(mesh, mesh.geometry)),
      };
    });
    assert.deepEqual(shown.meshes, [['large', 0, 3, [0, 0, 0], [2, 4, 0]], ['far', 1, 3, [5, 5, 5], [6, 6, 5]], ['moved', 0, 3, [0, 0, 9], [1, 2, 9]]], mode);
    assert.deepEqual(shown.all, [[[0, 0, 0], [1, 2, 0]], [[5, 5, 5], [6, 6, 5]]]);
    assert.ok(shown.shared);
  }
  assert.deepEqual(complaints(), []);
});

test('what cannot be loaded is one error with a sentence', {skip}, async () => {
  const messages = await page.evaluate(async () => {
    const loader = new maille.MailleLoader(), said = [];
    for (const address of ['/build/web/none.maille', '/README.md']) await loader.loadAsync(address).catch(error => said.push(error.message));
    await new Promise(resolve => loader.parse(new Uint8Array(10).buffer, resolve, error => resolve(said.push(error.message))));
    return said;
  });
  assert.equal(messages.length, 3);
  assert.match(messages[0], /404/);
  assert.match(messages[1], /no \.maille file/);
  assert.match(messages[2], /no \.maille file/);
  complaints();  // the browser's own, of the 404
});

test('a closed mesh has no cracks in any frame while it refines along a path', {skip}, async () => {
  const result = await page.evaluate(async () => {
    const {object, lookFrom, settle, cracks} = await maille.open('/build/web/armadillo.maille', {errorTarget: 0.7});
    const frames = [], triangles = new Set(), errors = [];
    for (let i = 0; i <= 12; ++i) {
      const away = i < 7 ? 4 - 0.5 * i : 1 + 0.5 * (i - 7);
      lookFrom(away * Math.sin(0.6 * i), 0.3 * away, away * Math.cos(0.6 * i));
      await settle(() => {
        frames.push(cracks());
        triangles.add(object.triangles);
      });
      errors.push(object.error);
    }
    const levels = new Set(object.meshes.filter(m => m.visible).map(m => m.userData.chart.level));
    object.dispose();
    return {cracked: frames.filter(f => f.found > 0).length, worst: Math.max(...frames.map(f => f.found)), frames: frames.length,
      covered: Math.min(...frames.slice(-5).map(f => f.covered)), cuts: triangles.size, errors, levels: levels.size};
  });
  assert.equal(result.worst, 0, JSON.stringify(result));
  assert.ok(result.covered > 1000 && result.cuts > 5, JSON.stringify(result));
  for (const error of result.errors) assert.ok(error <= 0.7, JSON.stringify(result));
  assert.deepEqual(complaints(), []);
});

test('the inspection finds a chart that is missing', {skip}, async () => {
  const found = await page.evaluate(async () => {
    const {object, lookFrom, settle, cracks} = await maille.open('/build/web/armadillo.maille', {errorTarget: 0.7});
    lookFrom(0, 0, 2.5);
    await settle();
    const nearest = object.meshes.filter(m => m.visible).sort((a, b) => b.userData.chart.sphere.centre[2] - a.userData.chart.sphere.centre[2])[0];
    nearest.geometry.setDrawRange(0, nearest.geometry.index.count - 60);
    const {found} = cracks();
    object.dispose();
    return found;
  });
  assert.ok(found > 0);
});

test('where charts meet their normals are the same, also of two levels', {skip}, async () => {
  const result = await page.evaluate(async () => {
    const {object, lookFrom, settle} = await maille.open('/build/web/armadillo.maille', {errorTarget: 3}), found = [];
    for (const away of [4, 1.1, 3]) {
      lookFrom(0.3 * away, 0.2 * away, away);
      await settle();
      const seen = new Map(), shown = object.meshes.filter(mesh => mesh.visible);
      let shared = 0, apart = 0;
      for (const {geometry} of shown) {
        const positions = geometry.getAttribute('position').array, normals = geometry.getAttribute('normal').array;
        for (let i = 0; i < positions.length; i += 3) {
          const place = positions.slice(i, i + 3).join(), normal = normals.slice(i, i + 3).join();
          if (seen.has(place)) shared += 1, apart += seen.get(place) !== normal;
          else seen.set(place, normal);
        }
      }
      found.push({shared, apart, levels: new Set(shown.map(mesh => mesh.userData.chart.level)).size});
    }
    object.dispose();
    return found;
  });
  for (const {apart} of result) assert.equal(apart, 0, JSON.stringify(result));
  assert.ok(result.some(({shared, levels}) => shared > 100 && levels > 1), JSON.stringify(result));
});

test('coarser targets take fewer triangles, and the finest is the mesh itself', {skip}, async () => {
  const counts = await page.evaluate(async () => {
    const {object, lookFrom, settle} = await maille.open('/build/web/armadillo.maille'), counts = [];
    lookFrom(0, 0, 3);
    for (const target of [16, 4, 1, 1e-6]) {
      object.errorTarget = target;
      await settle();
      counts.push(object.triangles);
    }
    const all = object.file.levels[0].faces;
    object.dispose();
    return {counts, all};
  });
  for (let i = 1; i < counts.counts.length; ++i) assert.ok(counts.counts[i] >= counts.counts[i - 1], JSON.stringify(counts));
  assert.equal(counts.counts.at(-1), counts.all);
});

test('memory stays within the budget, and the view does with less', {skip}, async () => {
  const result = await page.evaluate(async () => {
    const {object, camera, lookFrom} = await maille.open('/build/web/armadillo.maille', {errorTarget: 1e-6, maxBytes: 1_000_000});
    let most = 0;
    for (let i = 0; i < 6; ++i) {
      lookFrom(3 * Math.sin(i), 0, 3 * Math.cos(i));
      for (let frame = 0; frame < 40; ++frame) {
        object.update(camera, maille.renderer);
        await maille.nextFrame();
        most = Math.max(most, object.heldBytes);
      }
    }
    const largest = Math.max(...[...object.charts.values()].map(chart => chart.bytes)), {triangles} = object;
    object.dispose();
    return {most, largest, triangles};
  });
  assert.ok(result.triangles > 0, JSON.stringify(result));
  // What was asked for before the budget was reached still comes.
  assert.ok(result.most <= 1_000_000 + 16 * result.largest, JSON.stringify(result));
});

test('a ray meets the face of the original that the whole mesh has there', {skip}, async () => {
  const result = await page.evaluate(async () => {
    const {THREE} = maille, {object, camera, lookFrom, settle} = await maille.open('/build/web/armadillo.maille', {errorTarget: 8});
    lookFrom(0.5, 0.4, 2.5);
    await settle();
    const whole = await object.file.decode({drawn: true}), found = [];
    const geometry = new THREE.BufferGeometry().setAttribute('position', new THREE.BufferAttribute(whole.positions, 3));
    geometry.setIndex(new THREE.BufferAttribute(whole.triangles, 1));
    const mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({side: THREE.DoubleSide}));
    mesh.position.fromArray(whole.origin);
    mesh.updateMatrixWorld();
    const charts = await object.file.select({level: 0});
    for (const [x, y] of [[0, 0], [0.05, 0.1], [-0.1, 0.05], [0.1, -0.05]]) {
      const raycaster = new THREE.Raycaster();
      raycaster.setFromCamera(new THREE.Vector2(x, y), camera);
      const hit = await object.pick(raycaster), [wanted] = raycaster.intersectObject(mesh);
      let number = hit?.face ?? null;
      for (const chart of charts) {
        if (hit === null || (chart.group === hit.group && chart.chart === hit.chart)) break;
        number += chart.faces;
      }
      found.push([number, wanted ? whole.cells[wanted.faceIndex] : null]);
    }
    object.dispose();
    return found;
  });
  assert.ok(result.some(([number]) => number !== null), JSON.stringify(result));
  for (const [number, wanted] of result) assert.equal(number, wanted, JSON.stringify(result));
});

test('the example page of three.js shows a mesh without a network, and says in the page what is wrong', {skip}, async () => {
  const example = await newPage(browser, {width: 640, height: 480});
  await example.route(address => !address.href.startsWith(server.address), route => route.abort());
  await example.goto(`${server.address}examples/web/three.html?file=/build/web/quads.maille`);
  await example.waitForFunction(() => document.title === 'maille: all there');
  await screenshot(example, 'example');
  assert.deepEqual(example.complaints, []);
  await example.goto(`${server.address}examples/web/three.html?file=/README.md`);
  await example.waitForFunction(() => document.querySelector('#says').textContent.includes('no .maille file'));
  await example.close();
});
