// The page of `maille view` and `maille serve`, as people use it.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {existsSync, mkdirSync, readFileSync, statSync, writeFileSync} from 'node:fs';
import path from 'node:path';
import {after, before, test} from 'node:test';

import {bear, can, cloth, flow, painted, pathOf, quads, scan, textured, trianglesOfScene} from '../meshes.js';
import {withSteps} from '../steps.js';
import {chromium, drawn, launch, maille, newPage, root, screenshot, serve, settle} from './browser.js';

const built = path.join(root, 'web/dist/viewer/index.html');
const skip = !chromium ? 'chromium is missing: scripts/setup web' : !existsSync(built) ? 'the viewer was not built: scripts/build-viewer' : false;
const folder = path.join(root, 'build/web/files');
const meshes = {
  armadillo: [scan, '--mode', 'random', '--bits', '14'], bear: [bear], can: [can.mesh],
  combustor: [flow.mesh], coloured: [painted, '--mode', 'random'],
  quads: [quads, '--mode', 'random'], pieces: [flow.mesh, '--pieces', String(flow.pieces)],
};
const points = 'property float x\nproperty float y\nproperty float z\n';
const odd = {
  cloud: `element vertex 3\n${points}end_header\n0 0 0\n1 0 0\n0 1 0\n`,
  holes: `element vertex 4\n${points}element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\nnan 1 inf\n3 0 1 2\n3 1 3 2\n`,
};
let browser, server;

before(async () => {
  if (skip) return;
  mkdirSync(folder, {recursive: true});
  for (const [name, [mesh, ...options]] of Object.entries(meshes))
    execFileSync(maille, ['compress', '-q', '-f', ...options, pathOf(mesh), path.join(folder, `${name}.maille`)]);
  withSteps(maille, folder, 12);
  execFileSync(maille, ['compress', '-q', '-f', pathOf(cloth), path.join(folder, 'cloth.maille.glb')]);
  // Two materials: one with a picture, one red; and the picture that the coloured mesh names.
  const picture = Buffer.from('iVBORw0KGgoAAAANSUhEUgAAAAQAAAAECAIAAAAmkwkpAAAAGElEQVR4nGOwieq5syAKQjLAWUCSAacMAGtiF8Hw/q++AAAAAElFTkSuQmCC', 'base64');
  for (const name of ['cow.png', 'TextureDouble_A.png']) writeFileSync(path.join(folder, name), picture);
  writeFileSync(path.join(folder, 'spot.mtl'), 'newmtl cow\nmap_Kd cow.png\nnewmtl paint\nKd 1 0 0\n');
  const lines = readFileSync(pathOf(textured), 'utf8').split('\n'), first = lines.findIndex(line => line.startsWith('f '));
  lines.splice(first + 2000, 0, 'usemtl paint');
  lines.splice(first, 0, 'mtllib spot.mtl', 'usemtl cow');
  writeFileSync(path.join(folder, 'spot.obj'), lines.join('\n'));
  execFileSync(maille, ['compress', '-q', '-f', path.join(folder, 'spot.obj')]);
  for (const [name, text] of Object.entries(odd)) {
    writeFileSync(path.join(folder, `${name}.ply`), `ply\nformat ascii 1.0\n${text}`);
    execFileSync(maille, ['compress', '-q', '-f', path.join(folder, `${name}.ply`)]);
  }
  browser = await launch();
  server = await serve('serve', '--quiet', '--port', '0', folder);
});
after(async () => {
  await browser?.close();
  await server?.stop();
});

async function openViewer(file, more = {}) {
  const page = await newPage(browser, more);
  await page.goto(`${server.address}.viewer/${file ? `?file=/${file}` : ''}`);
  await page.waitForFunction(() => window.viewer);
  if (file) await settle(page);
  return page;
}
/** Is closed at first. */
const openPanel = page => page.click('#panel-button');
const statistics = page => page.evaluate(() => ({triangles: viewer.model.triangles, error: viewer.model.object.error, fetched: viewer.model.count.fetched}));

for (const name of Object.keys(meshes)) {
  test(`${name} is shown, without complaints`, {skip}, async () => {
    const page = await openViewer(`${name}.maille`);
    const {triangles} = await statistics(page);
    assert.ok(triangles > 0);
    await screenshot(page, name);
    assert.deepEqual(page.complaints, []);
    await page.close();
  });
}

test('a path that is flown is as fine as asked for at its end, and reads more only where it goes', {skip}, async () => {
  const page = await openViewer('armadillo.maille');
  const before = await statistics(page);
  await page.click('[data-tool="fly"]');
  await page.keyboard.down('w');
  await page.waitForFunction(distance => viewer.stage.camera.position.distanceTo(viewer.stage.sphere.center) < distance * viewer.stage.sphere.radius, 1.3, {timeout: 180_000});
  await page.keyboard.up('w');
  await settle(page);
  const near = await statistics(page);
  assert.ok(near.error <= 0.75 && before.error <= 0.75, JSON.stringify({before, near}));
  assert.ok(near.fetched >= before.fetched && near.triangles > 0);
  await screenshot(page, 'flown');
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('a click tells the exact face, its corners and values', {skip}, async () => {
  const page = await openViewer('coloured.maille');
  await page.click('[data-tool="pick"]');
  await page.mouse.click(480, 330);
  await page.waitForSelector('#picked:not([hidden])');
  const hit = await page.evaluate(() => viewer.picking.last);
  const whole = await page.evaluate(async ({number}) => {
    const mesh = await viewer.model.file.decode(), [block] = mesh.blocks;
    const corners = [...block.connectivity.subarray(3 * number, 3 * number + 3)];
    return corners.map(corner => [...mesh.positions.subarray(3 * corner, 3 * corner + 3)]);
  }, hit);
  // Drawn in single precision, the same corners all the same.
  const radius = await page.evaluate(() => viewer.model.sphere.radius);
  const near = (a, b) => Math.hypot(...a.map((x, k) => x - b[k])) < 1e-6 * radius;
  for (const corner of whole) assert.ok(hit.corners.some(other => near(corner, other)), JSON.stringify({hit, whole}));
  assert.ok((await page.textContent('#picked')).includes('Face'));
  await screenshot(page, 'picked');
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('a region is what `maille extract` gives', {skip}, async () => {
  const page = await openViewer('armadillo.maille');
  await page.click('[data-tool="box"]');
  await page.mouse.move(420, 180);
  await page.mouse.down();
  await page.mouse.move(560, 300, {steps: 4});
  await page.mouse.up();
  await page.waitForSelector('#region:not([hidden])');
  await screenshot(page, 'region');
  const [download] = await Promise.all([page.waitForEvent('download'), page.click('#region .main')]);
  const own = path.join(folder, 'region.ply'), native = path.join(folder, 'native.ply');
  await download.saveAs(own);
  const box = (await page.textContent('#region pre')).match(/--box=(\S+)/)[1];
  execFileSync(maille, ['extract', '-q', '-f', path.join(folder, 'armadillo.maille'), native, `--box=${box}`]);
  assert.ok(statSync(own).size > 1000);
  assert.ok(readFileSync(native).equals(readFileSync(own)));
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('colours, levels, spheres, wireframe and cuts change the picture', {skip}, async () => {
  const page = await openViewer('armadillo.maille');
  const seen = new Set();
  const look = async name => {
    await settle(page);
    await drawn(page);
    seen.add((await page.locator('#canvas').screenshot({timeout: 180_000})).toString('base64'));
    await screenshot(page, name);
  };
  await look('plain');
  await openPanel(page);
  await page.selectOption('#colour', 'level');
  await look('levels');
  assert.match(await page.textContent('#legend'), /Level.*△/);
  await page.selectOption('#colour', 'chart');
  await page.check('#spheres');
  await look('spheres');
  await page.uncheck('#spheres');
  await page.selectOption('#colour', 'plain');
  await page.keyboard.press('m');
  await look('wireframe');
  await page.keyboard.press('m');
  await page.keyboard.press('z');
  await look('cut');
  await page.check('#light');
  await look('light');
  assert.equal(seen.size, 6);
  await page.keyboard.press('?');
  await page.waitForSelector('#help[open]');
  await screenshot(page, 'help');
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('fields of points and cells of a volume are coloured, with a legend', {skip}, async () => {
  const page = await openViewer('combustor.maille');
  await openPanel(page);
  await page.selectOption('#colour', `point ${flow.scalar}`);
  await page.waitForFunction(name => document.querySelector('#legend:not([hidden]) h3')?.textContent.includes(name), flow.scalar);
  await drawn(page);
  await screenshot(page, 'field');
  const fields = await page.evaluate(() => [...viewer.model.fields.keys()]);
  assert.ok(fields.includes(`point ${flow.vector}`), fields.join());
  await page.selectOption('#colour', `point ${flow.vector}`);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('a volume opens with its first field and flat faces, a scan in one colour and smooth', {skip}, async () => {
  const looks = async (file, more) => {
    const page = await openViewer(file, more);
    const seen = await page.evaluate(() => ({colour: document.querySelector('#colour').value, flat: document.querySelector('#flat').checked, drawnFlat: viewer.colouring.plain.flatShading}));
    await page.close();
    return seen;
  };
  assert.deepEqual(await looks('combustor.maille'), {colour: `point ${flow.scalar}`, flat: true, drawnFlat: true});
  assert.deepEqual(await looks('bear.maille'), {colour: 'plain', flat: false, drawnFlat: false});
});

test('steps of time are chosen, played and paused: the colours follow, the camera stays', {skip}, async () => {
  const page = await openViewer('steps12.maille');
  await page.waitForSelector('#timeline:not([hidden])');
  const look = async () => {
    await drawn(page);
    return (await page.locator('#canvas').screenshot({timeout: 180_000})).toString('base64');
  };
  const seen = () => page.evaluate(() => ({step: viewer.model.step, range: [...viewer.colouring.range], camera: viewer.stage.camera.matrixWorld.toArray()}));
  const shows = step => page.waitForFunction(wanted => viewer.model.step === wanted && document.querySelector('#timeline').ariaBusy !== 'true', step);
  const pictures = [await look()], begin = await seen();
  assert.equal(begin.step, 0);
  await page.fill('#step', '2');
  await shows(2);
  pictures.push(await look());
  await screenshot(page, 'steps');
  assert.deepEqual([await page.textContent('#step-time'), await page.textContent('#step-number')], ['time 1', '2 of 3']);
  await page.keyboard.press('.');
  await shows(3);
  pictures.push(await look());
  assert.equal(new Set(pictures).size, 3);
  // From 0 to 0.2 above the step: what was seen stays in the range.
  const {range, camera} = await seen();
  assert.deepEqual(camera, begin.camera);
  assert.ok(range[0] < 0.2 && range[1] > 4 && range[0] === begin.range[0], `${range}`);
  // The newest choice wins.
  const outcomes = await page.evaluate(() => Promise.all([1, 2, 0].map(step => viewer.timeline.choose(step))));
  assert.deepEqual(outcomes, [false, false, true]);
  assert.equal((await seen()).step, 0);
  await page.keyboard.press(' ');
  await shows(1);
  await shows(3);
  await page.keyboard.press(' ');
  assert.equal(await page.getAttribute('#play', 'aria-pressed'), 'false');
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('a small screen has the steps of time, too', {skip}, async () => {
  const page = await openViewer('steps12.maille', {width: 390, height: 844, hasTouch: true, isMobile: true});
  await page.tap('#play');
  await page.waitForFunction(() => viewer.model.step === 2);
  await page.tap('#play');
  await screenshot(page, 'phone-steps');
  const inside = await page.evaluate(() => {
    const {left, right, bottom} = document.querySelector('#timeline').getBoundingClientRect();
    return left >= 0 && right <= innerWidth && bottom <= document.querySelector('.tools').getBoundingClientRect().top;
  });
  assert.ok(inside);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('a cut through a volume shows the field on it, out of the pieces that the plane meets', {skip}, async () => {
  const page = await openViewer('pieces.maille');
  const seen = () => page.evaluate(async () => {
    const {model} = viewer, cuts = model.cut.meshes, [{normal, constant}] = model.cut.planes;
    const away = mesh => Math.max(...Array.from({length: mesh.geometry.getAttribute('position').count}, (_, i) =>
      Math.abs(normal.dot(mesh.position.clone().add(mesh.position.clone().fromBufferAttribute(mesh.geometry.getAttribute('position'), i))) + constant)));
    const slice = await model.file.slice({normal: normal.toArray(), offset: constant});
    return {
      triangles: model.cut.triangles, wanted: slice.triangles.length / 3, pieces: cuts.length, away: Math.max(...cuts.map(away)) / model.sphere.radius,
      scalars: cuts.every(mesh => mesh.geometry.getAttribute('scalar').array.every(Number.isFinite)), unlit: cuts.every(mesh => mesh.material.isMeshBasicMaterial),
    };
  });
  await openPanel(page);
  await page.click('[data-axis="y"]');
  const cuts = [];
  for (const place of ['0.5', '0.3', '0.9']) {
    await page.evaluate(value => { const slider = document.querySelector('[data-cut="y"]'); slider.value = value; slider.oninput(); }, place);
    await page.waitForFunction(() => !viewer.model.cut.running);
    const cut = await seen();
    assert.ok(cut.triangles > 0 && cut.triangles === cut.wanted && cut.pieces < 11, JSON.stringify(cut));
    assert.ok(cut.away < 1e-6 && cut.scalars && cut.unlit, JSON.stringify(cut));
    cuts.push(cut.triangles);
  }
  assert.equal(new Set(cuts).size, 3);
  await page.keyboard.press('m');
  await screenshot(page, 'cut');
  await page.click('#panel-button');
  await page.click('[data-tool="pick"]');
  await page.evaluate(() => viewer.navigation.place(viewer.model.sphere.center.clone().add({x: 0, y: 3 * viewer.model.sphere.radius, z: 0.01}), viewer.model.sphere.center));
  await page.mouse.click(480, 320);
  await page.waitForSelector('#picked:not([hidden])');
  assert.ok((await page.textContent('#picked')).includes(flow.scalar));
  await page.keyboard.press('x');
  await page.waitForFunction(() => !viewer.model.cut.running && viewer.model.cut.all.length === 2 && viewer.model.cut.all.every(cut => cut.triangles > 0));
  await page.keyboard.press('x');
  await page.keyboard.press('y');
  assert.equal(await page.evaluate(() => viewer.model.cut.triangles), 0);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('a link shows the same view, and a picture is saved', {skip}, async () => {
  const page = await openViewer('pieces.maille');
  await page.evaluate(() => {
    viewer.settings.setUp('z');
    viewer.settings.setMap('magma');
    const oblique = viewer.stage.camera.position.clone().set(0.6, 0, 0.8);
    viewer.cuts.set([{name: 'x', flipped: true, share: 0.3}, {name: 'view', normal: oblique, share: 0.6}]);
    viewer.navigation.turn(0.4, 0.2);
  });
  const state = other => other.evaluate(() => ({
    camera: viewer.stage.camera.position.toArray().map(x => x.toPrecision(5)), colour: document.querySelector('#colour').value,
    map: viewer.colouring.map, cuts: viewer.cuts.text, clips: viewer.stage.clips.map(clip => clip.constant.toPrecision(5)).join(), up: viewer.settings.up,
  }));
  const link = await page.evaluate(() => viewer.copyLink()), expected = await state(page);
  const [download] = await Promise.all([page.waitForEvent('download'), page.keyboard.press('p')]);
  await download.saveAs(path.join(folder, 'picture.png'));
  assert.ok(statSync(path.join(folder, 'picture.png')).size > 5000);
  assert.equal(download.suggestedFilename(), 'pieces.png');
  const other = await newPage(browser);
  await other.goto(link);
  await settle(other);
  await other.waitForFunction(() => viewer.cuts.all.length === 2);
  assert.deepEqual(await state(other), expected);
  assert.deepEqual([...page.complaints, ...other.complaints], []);
  await other.close();
  await page.close();
});

test('the surface of a volume in pieces is the one of the volume', {skip}, async () => {
  const triangles = [];
  for (const file of ['combustor.maille', 'pieces.maille']) {
    const page = await openViewer(file);
    triangles.push(await page.evaluate(() => viewer.model.triangles));
    assert.deepEqual(page.complaints, []);
    await page.close();
  }
  assert.equal(triangles[1], triangles[0]);
});

test('what cannot be drawn is told, and the rest is drawn', {skip}, async () => {
  const said = async file => {
    const page = await openViewer(file);
    await page.waitForSelector('.message');
    const seen = {text: await page.textContent('.message p'), radius: await page.evaluate(() => viewer.model.sphere.radius)};
    assert.deepEqual(page.complaints, []);
    await page.close();
    return seen;
  };
  assert.match((await said('cloud.maille')).text, /no faces/);
  const {text, radius} = await said('holes.maille');
  assert.match(text, /^1 triangle not drawn/);
  assert.ok(radius > 0.5 && radius < 2, `${radius}`);
});

test('what colouring by cells takes is counted as memory, and given back', {skip}, async () => {
  const page = await openViewer('coloured.maille');
  const held = () => page.evaluate(() => viewer.model.object.heldBytes);
  const before = await held();
  await openPanel(page);
  await page.selectOption('#colour', 'cell colour');
  await page.waitForSelector('#legend:not([hidden])');
  assert.ok(await held() > 1.5 * before);
  assert.ok(await page.isVisible('#map'));
  await page.selectOption('#colour', 'plain');
  assert.equal(await held(), before);
  assert.ok(!await page.isVisible('#map'));
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('when the camera rests the picture is as fine as a fifth of a pixel', {skip}, async () => {
  const page = await openViewer('armadillo.maille');
  await page.evaluate(() => viewer.settings.setTarget(8));
  await page.evaluate(() => viewer.navigation.approach(0.99));
  await page.waitForFunction(() => viewer.model.object.resting === false || viewer.done);
  await settle(page);
  assert.ok((await statistics(page)).error <= 0.2);
  await page.close();
});

test('colours of a field are those of the legend, whatever the lamps do', {skip}, async () => {
  const page = await openViewer('can.maille');
  const seen = await page.evaluate(async () => {
    const {stage, colouring, model} = viewer, gl = stage.renderer.getContext(), box = stage.canvas.getBoundingClientRect(), found = [];
    stage.shades = false;
    for (const [x, y] of [[480, 260], [430, 330], [560, 300]]) {
      const hit = await viewer.picking.at(model, {clientX: x, clientY: y});
      if (!hit) continue;
      // Straight from before the face, so near that there is nothing else.
      const [a, b, c] = hit.corners.map(corner => stage.camera.position.clone().fromArray(corner)), normal = b.clone().sub(a).cross(c.clone().sub(a)).normalize();
      const middle = a.clone().add(b).add(c).divideScalar(3), side = Math.sign(stage.camera.position.clone().sub(middle).dot(normal));
      const before = [stage.camera.position.clone(), viewer.navigation.orbit.target.clone()];
      viewer.navigation.place(middle.clone().addScaledVector(normal, side * 0.3 * a.distanceTo(b)), middle);
      stage.draw();
      const place = stage.placeOf(middle), scale = stage.renderer.getPixelRatio(), pixel = new Uint8Array(4);
      gl.readPixels(Math.round(place.x * scale), Math.round((box.height - place.y) * scale), 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
      // Something else may lie between.
      const {drawn, triangle, weights} = await viewer.picking.at(model, {clientX: place.x, clientY: place.y});
      const [low, high] = colouring.range, array = drawn.arrays.find(({name}) => name === colouring.field.name);
      const value = weights.reduce((sum, weight, k) => {
        const vertex = drawn.triangles[3 * triangle + k];
        return sum + weight * Math.hypot(...array.values.slice(array.components * vertex, array.components * (vertex + 1)));
      }, 0);
      const share = (value - low) / (high - low), {data, width} = colouring.uniforms.colourMap.value.image;
      const at = 4 * Math.round(share * (width - 1));
      found.push({pixel: [...pixel.slice(0, 3)], wanted: [...data.slice(at, at + 3)]});
      viewer.navigation.place(...before);
    }
    return found;
  });
  assert.ok(seen.length >= 2, JSON.stringify(seen));
  for (const {pixel, wanted} of seen) assert.ok(pixel.every((x, k) => Math.abs(x - wanted[k]) <= 6), JSON.stringify(seen));
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('materials of a library beside the file are drawn, with their pictures', {skip}, async () => {
  const page = await openViewer('spot.maille');
  await page.waitForFunction(() => document.querySelector('#colour').value === 'materials');
  const drawn = await page.evaluate(() => [viewer.model.mesh.material].flat().map(({map, color}) => ({picture: map?.image.width, colour: color.getHex()})));
  assert.deepEqual(drawn, [{picture: 4, colour: 0xffffff}, {picture: undefined, colour: 0xff0000}]);
  await screenshot(page, 'materials');
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('a scene of glTF is drawn with its own materials and pictures', {skip}, async () => {
  const page = await openViewer('cloth.maille.glb');
  const seen = await page.evaluate(() => {
    const {model, stage, colouring} = viewer, [{material}] = model.meshes, gl = stage.renderer.getContext(), pixel = new Uint8Array(4);
    stage.draw();
    gl.readPixels(gl.drawingBufferWidth / 2, gl.drawingBufferHeight / 2, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return {mode: colouring.mode, pictures: ['map', 'normalMap', 'roughnessMap', 'aoMap'].map(name => material[name]?.image.width > 0),
      triangles: model.triangles, mirrors: stage.scene.environment !== null, pixel: [...pixel]};
  });
  assert.deepEqual({...seen, pixel: undefined}, {mode: 'materials', pictures: [true, true, true, true], triangles: trianglesOfScene(pathOf(cloth)), mirrors: true, pixel: undefined});
  assert.ok(seen.pixel[2] > 1.3 * seen.pixel[0], `it is blue: ${seen.pixel}`);
  await screenshot(page, 'scene');
  await page.click('[data-tool="pick"]');
  await page.mouse.click(480, 330);
  await page.waitForSelector('#picked:not([hidden])');
  const {position, corners} = await page.evaluate(() => viewer.picking.last), size = await page.evaluate(() => viewer.model.sphere.radius);
  assert.ok(corners.every(corner => Math.hypot(...corner.map((x, k) => x - position[k])) < 0.1 * size), JSON.stringify({position, corners}));
  await openPanel(page);
  await page.selectOption('#colour', 'plain');
  await page.selectOption('#colour', 'point normal\n1');
  await page.waitForSelector('#legend:not([hidden])');
  // A scan has the light that it had before.
  await page.evaluate(() => viewer.open('/bear.maille'));
  await settle(page);
  assert.deepEqual(await page.evaluate(() => [viewer.stage.scene.environment, viewer.colouring.mode]), [null, 'plain']);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('a scene of glTF has files read in its folder only, and what is wrong with it is told', {skip}, async () => {
  const corners = Buffer.from(new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0]).buffer).toString('base64');
  mkdirSync(path.join(folder, 'deep'), {recursive: true});
  const scene = uri => JSON.stringify({
    asset: {version: '2.0'}, scene: 0, scenes: [{nodes: [0]}], nodes: [{mesh: 0, translation: [5, 0, 0]}],
    meshes: [{primitives: [{attributes: {POSITION: 0}, material: 0}]}], materials: [{pbrMetallicRoughness: {baseColorTexture: {index: 0}}}],
    textures: [{source: 0}], images: [{uri}], buffers: [{byteLength: 36, uri: `data:application/octet-stream;base64,${corners}`}],
    bufferViews: [{buffer: 0, byteLength: 36}], accessors: [{bufferView: 0, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0]}],
  });
  for (const [name, uri] of [['near', 'cow.png'], ['far', 'http://127.0.0.1:9/far.png'], ['deep/above', '../above.png']]) writeFileSync(path.join(folder, `${name}.gltf`), scene(uri));
  const whole = readFileSync(path.join(folder, 'cloth.maille.glb'));
  writeFileSync(path.join(folder, 'cut.maille.glb'), whole.subarray(0, whole.length / 2));
  for (const name of ['near', 'far', 'deep/above']) {
    const page = await newPage(browser), asked = [];
    page.on('request', request => asked.push(request.url()));
    await page.goto(`${server.address}.viewer/?file=/${name}.gltf`);
    await settle(page);
    const {pictures, centre} = await page.evaluate(() => ({pictures: viewer.model.meshes.filter(mesh => mesh.material.map).length, centre: viewer.model.sphere.center.x}));
    assert.deepEqual({pictures, centre}, {pictures: name === 'near' ? 1 : 0, centre: 5.5});
    if (name !== 'near') assert.match(await page.textContent('.message.bad'), /^1 picture of this scene could not be read/);
    assert.ok(!asked.some(url => /far\.png|above\.png/.test(url)), asked.join());
    await page.close();
  }
  const page = await newPage(browser);
  await page.goto(`${server.address}.viewer/?file=/cut.maille.glb`);
  await page.waitForSelector('.message.bad');
  assert.match(await page.textContent('.message.bad'), /cut\.maille\.glb: is cut off/);
  await page.evaluate(() => viewer.open('/bear.maille'));
  await settle(page);
  await page.close();
});

test('two points are measured, exactly', {skip}, async () => {
  const page = await openViewer('armadillo.maille');
  await page.click('[data-tool="measure"]');
  const points = [];
  for (const [x, y] of [[480, 300], [500, 240]]) {
    points.push(await page.evaluate(([clientX, clientY]) => viewer.picking.at(viewer.model, {clientX, clientY}).then(hit => hit.position), [x, y]));
    await page.mouse.click(x, y);
    await page.waitForFunction(count => viewer.measure.points.length === count, points.length);
  }
  const wanted = Math.hypot(...points[0].map((x, k) => x - points[1][k])), {distance, text} = await page.evaluate(() => ({distance: viewer.measure.distance, text: document.querySelector('#distance').textContent}));
  assert.ok(Math.abs(distance - wanted) < 1e-6 * wanted && text.startsWith(String(Number(wanted.toPrecision(4)))), `${distance} ${wanted} ${text}`);
  await screenshot(page, 'measure');
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('another level, or another file, is seen side by side', {skip}, async () => {
  const page = await openViewer('armadillo.maille');
  await openPanel(page);
  await page.selectOption('#beside', '2');
  await page.waitForFunction(() => viewer.compare.model && viewer.done);
  const {level, finest, wanted} = await page.evaluate(() => ({level: viewer.compare.model.triangles, finest: viewer.model.triangles, wanted: viewer.model.file.levels[2].faces}));
  assert.ok(level === wanted && finest > level, JSON.stringify({level, finest, wanted}));
  await screenshot(page, 'beside');
  await page.selectOption('#beside', 'file');
  await page.evaluate(() => viewer.open('/bear.maille'));
  await page.waitForFunction(() => viewer.compare.model?.file.name.endsWith('bear.maille') && viewer.done);
  await page.selectOption('#beside', '');
  assert.equal(await page.evaluate(() => viewer.stage.panes.length), 1);
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('a small screen with touch', {skip}, async () => {
  const page = await openViewer('armadillo.maille', {width: 390, height: 844, hasTouch: true, isMobile: true});
  await screenshot(page, 'phone');
  await page.tap('#panel-button');
  await screenshot(page, 'phone-panel');
  assert.deepEqual(page.complaints, []);
  await page.close();
});

test('what is wrong with a file is a sentence in the page, which stays usable', {skip}, async () => {
  const good = readFileSync(path.join(folder, 'bear.maille'));
  writeFileSync(path.join(folder, 'later.maille'), readFileSync(path.join(root, 'tests/cli/data/newer_format.bin')));
  writeFileSync(path.join(folder, 'text.maille'), 'this is a text and no mesh at all');
  writeFileSync(path.join(folder, 'bytes.maille'), Buffer.concat([good.subarray(0, 2000), Buffer.alloc(500, 255), good.subarray(2500)]));
  for (const [name, sentence] of [['none', /404/], ['text', /no \.maille file/], ['later', /newer maille/], ['bytes', /damaged|checksum/]]) {
    const page = await newPage(browser);
    await page.goto(`${server.address}.viewer/?file=/${name}.maille`);
    await page.waitForSelector('.message.bad');
    assert.match(await page.textContent('.message.bad'), sentence, name);
    await screenshot(page, `error-${name}`);
    await page.evaluate(() => viewer.open('/bear.maille'));
    await settle(page);
    assert.ok((await statistics(page)).triangles > 0);
    await page.close();
  }
});

test('a chart that is damaged is named, and all else is shown', {skip}, async () => {
  const bytes = readFileSync(path.join(folder, 'armadillo.maille'));
  bytes.fill(255, Math.floor(0.8 * bytes.length), Math.floor(0.8 * bytes.length) + 100);
  writeFileSync(path.join(folder, 'hurt.maille'), bytes);
  const page = await newPage(browser);
  await page.goto(`${server.address}.viewer/?file=/hurt.maille`);
  await page.waitForFunction(() => window.viewer?.model);
  await page.evaluate(() => viewer.settings.setTarget(0.01));
  await page.waitForSelector('.message.bad');
  await settle(page);
  assert.match(await page.textContent('.message.bad'), /chart \d+ of group \d+ .*damaged/);
  const {shown, all} = await page.evaluate(() => ({shown: viewer.model.triangles, all: viewer.model.file.levels[0].faces}));
  assert.ok(shown > 0.3 * all && shown < all, JSON.stringify({shown, all}));
  await screenshot(page, 'error-chart');
  await page.close();
});

test('without WebGL the page says so', {skip}, async () => {
  const page = await newPage(browser);
  await page.addInitScript(() => { HTMLCanvasElement.prototype.getContext = () => null; });
  await page.goto(`${server.address}.viewer/?file=/bear.maille`);
  await page.waitForSelector('.message.bad');
  assert.match(await page.textContent('.message.bad'), /WebGL/);
  await page.close();
});

test('`maille view` gives the page of one file', {skip}, async () => {
  const view = await serve('view', '--quiet', '--no-browser', path.join(folder, 'bear.maille'));
  const page = await newPage(browser);
  await page.goto(view.address);
  await settle(page);
  assert.equal(await page.textContent('#file-name'), 'bear.maille');
  assert.deepEqual(page.complaints, []);
  await page.close();
  await view.stop();
});
