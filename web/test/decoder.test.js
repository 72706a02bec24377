// The WebAssembly decoder gives what the native one gives. Needs the native programs of build/release.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {readFile} from 'node:fs/promises';
import {tmpdir} from 'node:os';
import path from 'node:path';
import {after, test} from 'node:test';

import {compileDecoder, Decoder, DecoderFile} from '../src/decoder.js';
import {decode, ErrorCode, MailleError, MeshFile, ready, setDecoder} from '../src/maille.js';
import {instancesOf} from '../src/nodes.js';
import {Session} from '../src/session.js';
import {boundaryOf, nodesOfType} from './boundary.js';
import {checksumOf} from './checksum.js';
import {bear, bunny, can, cheese, coloured, painted, pathOf, quads, root, scan, streams, textured} from './meshes.js';
import {times, withSteps} from './steps.js';

const build = process.env.MAILLE_BUILD ?? path.join(root, 'build/release');
const maille = path.join(build, 'tool/maille');
const folder = mkdtempSync(path.join(tmpdir(), 'maille-web-'));
after(() => rmSync(folder, {recursive: true}));

const filesBelow = (name, extension) => readdirSync(path.join(root, name), {recursive: true})
  .filter(file => file.endsWith(extension)).map(file => path.join(root, name, file)).sort();

function nativeChecksums(files) {
  const lines = execFileSync(path.join(build, 'tests/maille_mesh_checksums'), files, {encoding: 'utf8'}).trim().split('\n');
  return lines.map(line => line.split(' ', 1)[0]);
}

async function ownChecksum(file) {
  try {
    return checksumOf(await decode(readFileSync(file)));
  } catch (error) {
    assert.ok(error instanceof MailleError, `${file}: ${error.stack}`);
    return `error-${error.code}`;
  }
}

async function expectTheSame(files) {
  const native = nativeChecksums(files);
  for (const [i, file] of files.entries()) {
    const own = await ownChecksum(file);
    // A page holds less than a process: what claims too much may be refused for that.
    if (own !== `error-${ErrorCode.memory}` || !native[i].startsWith('error')) assert.equal(own, native[i], file);
  }
}

function compressed(mesh, ...options) {
  const file = path.join(folder, `${path.basename(mesh)}${options.join('')}.maille`);
  execFileSync(maille, ['compress', '-q', '-f', ...options, pathOf(mesh), file]);
  return file;
}

test('golden files of all modes decode to the same bytes as natively', () => expectTheSame(filesBelow('tests/golden', '.maille')));

test('damaged files are refused as they are natively', () => expectTheSame(filesBelow('tests/corrupt', '.maille')));

test('real surfaces decode to the same bytes as natively, at all kinds of levels', () => expectTheSame(
  ['-1', '-3', '-5', '-9'].flatMap(level => [compressed(cheese, level), compressed(bear, level, '--bits', '12'),
    compressed(bear, level, '--mode', 'random')])));

test('real volumes decode to the same bytes as natively', () => expectTheSame(
  ['hex', 'tet', 'mixed'].flatMap(kind => readdirSync(path.join(root, 'build/data', kind)).sort().slice(0, 3)
    .map(name => compressed(`${kind}/${name}`)))));

test('charts of level 0 hold every face once', async () => {
  const bytes = readFileSync(compressed(bear, '--mode', 'random'));
  const file = await MeshFile.open(bytes), whole = await file.decode();
  let faces = 0;
  for (const chart of await file.select({level: 0})) faces += (await file.decodeNode(chart)).triangles.length / 3;
  assert.equal(faces, whole.blocks[0].connectivity.length / 3);
  assert.equal(faces, file.levels[0].faces);
  file.close();
});

test('charts are the same from the decoder of charts and from that of all modes', async () => {
  for (const level of ['-1', '-2', '-5']) {
    const bytes = readFileSync(compressed(bear, level, '--mode', 'random', '--bits', '12'));
    const [charts, full] = await Promise.all([ready(), ready({full: true})].map(async module => {
      const file = new DecoderFile(await Decoder.create(await module), bytes.length, 'x');
      file.give(0, bytes);
      file.open();
      return file;
    }));
    for (const {group, chart} of [0, 1, 2].flatMap(fine => full.select({level: fine}))) {
      const own = charts.chart(group, chart);
      assert.ok(own.triangles instanceof Uint16Array && own.triangles.length > 0);
      assert.deepEqual(own, full.chart(group, chart));
    }
  }
});

test('numbers of points and cells that are their places are there when they are asked for', async () => {
  const file = await MeshFile.open(readFileSync(compressed(bear, '--mode', 'random')));
  const {positions, triangles, points, cells} = await file.decodeNode((await file.select())[0]);
  assert.deepEqual(points, Uint32Array.from({length: positions.length / 3}, (_, i) => i));
  assert.deepEqual(cells, Uint32Array.from({length: triangles.length / 3}, (_, i) => i));
  file.close();
});

test('a file loads the decoder that it needs, and a larger one when it asks for it', async () => {
  const dist = new URL('../dist/', import.meta.url), own = globalThis.fetch;
  let asked = [], missing = [];
  globalThis.fetch = async url => {
    const name = url.pathname.slice(1);
    asked.push(name);
    return missing.includes(name) ? new Response(null, {status: 404}) : new Response(readFileSync(new URL(name, dist)));
  };
  const loaded = async (file, call) => {
    asked = [];
    await setDecoder('http://localhost/maille.wasm');
    const open = await MeshFile.open(readFileSync(file));
    await call(open);
    open.close();
    return asked.map(name => name.replace(/maille-?|\.wasm/g, '') || 'small');
  };
  const chart = async file => file.decodeNode((await file.select())[0]);
  const ofBear = (...options) => compressed(bear, ...options);
  try {
    assert.deepEqual(await loaded(ofBear('--mode', 'random'), chart), ['charts']);
    assert.deepEqual(await loaded(ofBear('--mode', 'random'), file => file.pick([0, 0, 1e3], [0, 0, -1])), ['charts']);
    assert.deepEqual(await loaded(ofBear('--mode', 'random'), file => file.decode()), ['charts', 'small']);
    assert.deepEqual(await loaded(ofBear('--mode', 'random', '-9'), chart), ['charts', 'full']);
    assert.deepEqual(await loaded(ofBear('-5'), file => file.decode()), ['charts', 'small']);
    assert.deepEqual(await loaded(ofBear('-9'), file => file.decode()), ['charts', 'small', 'full']);
    missing = ['maille-charts.wasm'];
    assert.deepEqual(await loaded(ofBear('--mode', 'random'), chart), ['charts', 'small']);
  } finally {
    globalThis.fetch = own;
    await setDecoder(new URL('maille.wasm', dist));
  }
});

test('a decoder that is not there is an error of the library', async () => {
  const absent = readFile(new URL('../nowhere/maille.wasm', import.meta.url));
  await assert.rejects(compileDecoder(absent), error => error instanceof MailleError && error.code === ErrorCode.network &&
    /ENOENT.*; setDecoder\(\) tells/.test(error.message));
});

test('what a renderer asks for within a frame comes later where it takes another decoder', async () => {
  const bytes = readFileSync(compressed(bear, '--mode', 'random')), asked = [];
  const other = async kind => { asked.push(kind); return {module: await ready({mode: 'single'}), kind}; };
  const read = async ranges => ranges.map(({offset, size}) => bytes.subarray(offset, offset + size));
  const session = new Session({kind: 'charts', other}, {size: bytes.length, name: 'x', mode: 'random'}, read);
  const refuse = () => { throw new MailleError(1003, 'left out'); };
  Object.assign(session, {opened: Promise.resolve(), file: {select: refuse, forgetBehind() {}, close() {}}});
  assert.equal(session.now('select', {}), null);
  assert.equal(session.now('select', {}), null);
  while (session.pending) await session.pending;
  assert.deepEqual(asked, ['small']);
  assert.ok(session.now('select', {}).length > 0);
  session.close();
});

test('a ray meets the original where the whole mesh has its nearest triangle', async () => {
  const file = await MeshFile.open(readFileSync(compressed(bear, '--mode', 'random')));
  const whole = await file.decode(), {centre, radius} = file.sphere;
  const origin = [centre[0] - 3 * radius, centre[1], centre[2]], direction = [1, 0, 0];
  const hit = await file.pick(origin, direction);
  assert.ok(Math.abs(hit.distance - nearestHit(whole, origin, direction)) <= 1e-12 * radius);
  assert.equal(await file.pick(origin, [-1, 0, 0]), null);
  file.close();
});

/** Moeller and Trumbore 1997, over all triangles. */
function nearestHit({positions, blocks}, origin, direction) {
  const sub = (a, b) => a.map((x, k) => x - b[k]), dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const at = point => [...positions.subarray(3 * point, 3 * point + 3)];
  let nearest = Infinity;
  for (const {connectivity} of blocks) {
    for (let i = 0; i < connectivity.length; i += 3) {
      const [a, b, c] = [at(connectivity[i]), at(connectivity[i + 1]), at(connectivity[i + 2])];
      const ab = sub(b, a), ac = sub(c, a), p = cross(direction, ac), s = sub(origin, a), q = cross(s, ab), scale = 1 / dot(ab, p);
      const u = scale * dot(s, p), v = scale * dot(direction, q), distance = scale * dot(ac, q);
      if (u >= 0 && v >= 0 && u + v <= 1 && distance >= 0) nearest = Math.min(nearest, distance);
    }
  }
  return nearest;
}

test('a region extracted is that part of the original', async () => {
  const file = await MeshFile.open(readFileSync(compressed(bear, '--mode', 'random')));
  const whole = await file.decode(), {centre, radius} = file.sphere;
  const box = {low: centre.map(x => x - radius / 3), high: centre.map(x => x + radius / 3)};
  const part = await file.extract({box});
  const facesOf = ({positions, blocks}, wanted) => blocks.flatMap(({connectivity}) => {
    const faces = [];
    for (let i = 0; i < connectivity.length; i += 3) {
      const points = [...connectivity.subarray(i, i + 3)].map(p => [...positions.subarray(3 * p, 3 * p + 3)]);
      if (points.some(point => point.every((x, k) => wanted.low[k] <= x && x <= wanted.high[k]))) faces.push(points.join(' '));
    }
    return faces.sort();
  });
  const expected = facesOf(whole, box);
  assert.ok(expected.length > 100);
  assert.deepEqual(facesOf(part, box), expected);
  file.close();
});

test('a region is saved as the PLY file that `maille extract` writes, with arrays of points, corners and cells', async () => {
  for (const mesh of [bear, quads, painted, coloured, textured]) {
    const packed = compressed(mesh, '--mode', 'random'), native = path.join(folder, 'region.ply');
    const file = await MeshFile.open(readFileSync(packed)), {centre, radius} = file.sphere;
    const box = {low: centre.map(x => x - radius / 2), high: centre.map(x => x + 0.6 * radius)};
    execFileSync(maille, ['extract', '-q', '-f', packed, native, `--box=${[...box.low, ...box.high]}`]);
    const {bytes, points, faces} = await file.extractPly({box});
    assert.ok(points > 0 && faces > 0, mesh);
    assert.ok(readFileSync(native).equals(bytes), `${mesh}: ${bytes.length} bytes`);
    const header = Buffer.from(bytes.subarray(0, 2000)).toString('latin1').split('end_header')[0];
    if (mesh === textured) assert.match(header, /property list \w+ \w+ texcoord/);
    // The decoder that writes files still gives charts.
    const [chart] = await file.select();
    assert.ok((await file.decodeNode(chart)).triangles.length > 0);
    file.close();
  }
});

test('without a region, what is extracted is in the order of the input, as `maille extract` has it', async () => {
  const packed = compressed(bear, '--mode', 'random', '--keep-order'), native = path.join(folder, 'whole.ply');
  execFileSync(maille, ['extract', '-q', '-f', packed, native]);
  const file = await MeshFile.open(readFileSync(packed));
  assert.ok(readFileSync(native).equals((await file.extractPly()).bytes));
  const input = readFileSync(pathOf(bear), 'utf8').split(/\s+/).slice(4).map(Number);
  const {positions} = await file.extract();
  assert.deepEqual([...positions.subarray(0, 300)], [...Float32Array.from(input.slice(0, 300))]);
  file.close();
});

test('a lean chart is the same, without numbers that say nothing', async () => {
  for (const mesh of [bear, textured]) {
    const file = await MeshFile.open(readFileSync(compressed(mesh, '--mode', 'random')));
    for (const chart of (await file.select({level: 0})).slice(0, 3)) {
      const full = await file.decodeNode(chart), lean = await file.decodeNode(chart, {lean: true});
      const {points, cells, triangles} = lean;
      assert.deepEqual([...triangles], [...full.triangles]);
      if (mesh === bear) assert.deepEqual([triangles.BYTES_PER_ELEMENT, points, cells], [2, null, null]);
      for (const [name, numbers] of Object.entries({points, cells}))
        assert.deepEqual(numbers ?? Uint32Array.from(full[name], (_, i) => i), full[name], `${mesh}: ${name}`);
      assert.deepEqual({...lean, points, cells, triangles}, {...full, points, cells, triangles});
    }
    file.close();
  }
});

test('what is no .maille file is named', async () => {
  await assert.rejects(MeshFile.open(new Uint8Array(100)), {name: 'MailleError', code: 6, message: /is no \.maille file/});
  await assert.rejects(MeshFile.open(new Uint8Array(3)), {code: 6});
  await assert.rejects(MeshFile.open(42), {code: 2});
});

test('a file of a newer version is refused with a sentence', async () => {
  const newer = readFileSync(path.join(root, 'tests/cli/data/newer_format.bin'));
  await assert.rejects(decode(newer), {name: 'MailleError', code: ErrorCode.unsupported, message: /newer maille/});
});

const twoMaterials = `# made by hand
mtllib things of it.mtl
v 0 0 0
v 1 0 0
v 0 1 0
v 1 1 0
usemtl red
f 1 2 3
usemtl brass, polished
f 2 4 3
`;

test('labels have their names and the file its metadata, in all modes and forms', async () => {
  const obj = path.join(folder, 'materials.obj');
  writeFileSync(obj, twoMaterials);
  for (const mode of ['single', 'stream', 'random']) {
    const packed = path.join(folder, `materials.${mode}.maille`);
    execFileSync(maille, ['compress', '-q', '-f', '--mode', mode, obj, packed]);
    const file = await MeshFile.open(readFileSync(packed), {workers: 0});
    assert.deepEqual(await file.readMetadata(), [['comment', 'made by hand'], ['mtllib', 'things of it.mtl']], mode);
    const forms = [await file.decode(), await file.surface()];
    if (mode === 'random') forms.push(await file.extract(), await file.decodeNode((await file.select({level: 0}))[0]));
    for (const {arrays} of forms) {
      const {labels, values} = arrays.find(({name}) => name === 'material');
      assert.deepEqual([...values].map(value => labels[value]), ['red', 'brass, polished'], mode);
    }
    file.close();
  }
});

/** A glTF scene of one triangle, which two nodes show: half as large, turned and moved within another node, and as it is. */
function twoInstances() {
  const half = Math.SQRT1_2, positions = Buffer.from(new Float32Array([0, 0, 0, 1, 0, 0, 0, 2, 0]).buffer);
  return JSON.stringify({
    asset: {version: '2.0'}, scene: 0, scenes: [{nodes: [0, 2]}],
    nodes: [{name: 'group', translation: [10, 0, 0], children: [1]}, {name: 'small', mesh: 0, rotation: [0, 0, half, half], scale: [0.5, 0.5, 0.5]},
      {name: 'plain', mesh: 0}],
    meshes: [{name: 'triangle', primitives: [{attributes: {POSITION: 0}}]}],
    accessors: [{bufferView: 0, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 2, 0]}],
    bufferViews: [{buffer: 0, byteLength: 36}],
    buffers: [{byteLength: 36, uri: `data:application/octet-stream;base64,${positions.toString('base64')}`}],
  });
}

test('instances are where the scene of the command has them', async () => {
  const gltf = path.join(folder, 'two.gltf'), scene = path.join(folder, 'scene.maille');
  writeFileSync(gltf, twoInstances());
  execFileSync(maille, ['convert', '-q', gltf, path.join(folder, 'scene.ply')]);
  execFileSync(maille, ['compress', '-q', '-f', '--mode', 'single', path.join(folder, 'scene.ply'), scene]);
  const shown = await decode(readFileSync(scene));
  for (const mode of ['single', 'random']) {
    const packed = path.join(folder, `two.${mode}.maille`);
    execFileSync(maille, ['compress', '-q', '-f', '--mode', mode, gltf, packed]);
    const file = await MeshFile.open(readFileSync(packed), {workers: 0}), {positions, blocks} = await file.decode();
    const instances = await file.readInstances();
    assert.deepEqual(instances.map(({name, blocks}) => [name, blocks]), [['small', [0]], ['plain', [0]]], mode);
    const text = place => place.map(x => Math.round(1e5 * x) / 1e5 + 0).join(' '), at = (values, point) => [...values.subarray(3 * point, 3 * point + 3)];
    const placed = instances.flatMap(({matrix: m, blocks: [b]}) => [...blocks[b].connectivity].map(point => {
      const [x, y, z] = at(positions, point);
      return text([0, 1, 2].map(k => m[k] * x + m[4 + k] * y + m[8 + k] * z + m[12 + k]));
    }));
    const wanted = shown.blocks.flatMap(block => [...block.connectivity]).map(point => text(at(shown.positions, point)));
    assert.deepEqual(placed.sort(), wanted.sort(), mode);
    file.close();
  }
});

test('instances of metadata that anybody may have written end, and are none where it says nothing', () => {
  const of = (nodes, scene, meshes) => instancesOf([['gltf.nodes', nodes], ['gltf.scene', scene], ['gltf.meshes', meshes]]);
  assert.deepEqual(instancesOf([]), []);
  assert.deepEqual(of('[', '{}', 'null'), []);
  assert.deepEqual(of('[null, {"children": 3}, {"mesh": 7}]', '[0, 1, 2, 9, -1, "x"]', '[[0]]'), []);
  assert.equal(of('[{"children": [1]}, {"mesh": 0, "children": [0, 1]}]', '[0, 1]', '[[0]]').length, 1);
  assert.equal(of('[{"mesh": 0, "matrix": [1, 2]}]', '[0]', '[[0]]')[0].matrix[5], 1);
});

test('metadata of a large file is read without its mesh', async () => {
  const bytes = readFileSync(compressed(can.mesh)), reads = [];
  const input = {size: bytes.length, readAt: async (offset, size) => (reads.push(size), bytes.subarray(offset, offset + size))};
  const file = await MeshFile.open(input, {workers: 0});
  assert.ok(Array.isArray(await file.readMetadata()));
  assert.ok(reads.reduce((sum, size) => sum + size, 0) < Math.max(200e3, bytes.length), String(reads));
  file.close();
});

test('an aborted call is rejected, and the file stays usable', async () => {
  const file = await MeshFile.open(readFileSync(compressed(bear, '--mode', 'random')));
  const [chart] = await file.select({level: 0});
  await assert.rejects(file.decodeNode(chart, {signal: AbortSignal.abort()}), {name: 'AbortError'});
  assert.ok((await file.decodeNode(chart)).triangles.length > 0);
  file.close();
});

const rising = numbers => [...numbers].sort((a, b) => a - b);

test('the surface of a volume is the faces that one solid has, with the values of points and cells', async () => {
  for (const [volume, ...options] of streams) {
    const file = await MeshFile.open(readFileSync(compressed(volume, ...options)));
    const whole = await file.decode(), surface = await file.surface(), boundary = boundaryOf(whole);
    const cells = boundary.flatMap(({points, cell}) => Array(points.length - 2).fill(cell));
    assert.deepEqual(rising(surface.cells), rising(cells), volume);
    assert.deepEqual(rising(surface.points), rising(new Set(boundary.flatMap(({points}) => points))), volume);
    assert.equal(surface.triangles.length, 3 * surface.cells.length);
    const corners = surface.triangles.reduce((sum, vertex) => sum + surface.points[vertex], 0);
    const expected = boundary.flatMap(({points}) => points.slice(2).flatMap((_, i) => [points[0], points[i + 1], points[i + 2]]));
    assert.equal(corners, expected.reduce((sum, point) => sum + point, 0), volume);
    for (const [i, point] of surface.points.entries()) {
      for (let k = 0; k < 3; ++k)
        assert.equal(surface.positions[3 * i + k], Math.fround(whole.positions[3 * point + k] - surface.origin[k]), volume);
    }
    for (const {name, domain, components, values} of whole.arrays) {
      if (domain !== 'point' && domain !== 'cell') continue;
      const drawn = surface.arrays.find(array => array.name === name && array.domain === (domain === 'cell' ? 'triangle' : 'point'));
      const from = domain === 'cell' ? surface.cells : surface.points;
      assert.equal(drawn.values.length, from.length * components, `${volume} ${name}`);
      assert.deepEqual(drawn.values, drawn.values.map((_, i) => values[from[Math.floor(i / components)] * components + i % components]), `${volume} ${name}`);
    }
    file.close();
  }
});

test('steps of time are those that the command tells, and the surface has the values that it gives for each', async () => {
  const packed = withSteps(maille, folder, 40), bytes = readFileSync(packed);
  const told = JSON.parse(execFileSync(maille, ['info', '--json', packed], {encoding: 'utf8'})).steps.map(step => step.time);
  assert.deepEqual(told, times);
  // Nothing is kept between reads: what a step needs lies megabytes from one another.
  const file = await MeshFile.open(slowFile(bytes), {cacheBytes: 0});
  assert.equal(file.info.steps, undefined);
  assert.deepEqual(await file.readSteps(), times.map((time, i) => ({step: i + 1, time})));
  assert.deepEqual(file.info.steps, await file.readSteps());
  const mesh = path.join(folder, 'step.vtk'), own = path.join(folder, 'step.maille'), first = await file.surface();
  for (const step of [0, 1, 2, 3]) {
    execFileSync(maille, ['decompress', '-q', '-f', '--step', String(step), packed, mesh]);
    execFileSync(maille, ['compress', '-q', '-f', mesh, own]);
    const whole = await decode(readFileSync(own)), surface = await file.surface({step});
    for (const same of ['positions', 'triangles', 'points', 'cells']) assert.deepEqual(surface[same], first[same]);
    for (const [name, from] of [['p', surface.points], ['q', surface.points], ['id', surface.cells]]) {
      const values = whole.arrays.find(array => array.name === name).values, drawn = surface.arrays.find(array => array.name === name).values;
      assert.deepEqual([...drawn], Array.from(from, i => values[i]), `${name} at step ${step}`);
    }
  }
  await assert.rejects(file.surface({step: 4}), {code: ErrorCode.usage, message: /no step 4/});
  file.close();
});

test('steps are read from the ends of the mesh and of each step, and where the end is damaged nothing is looked for', async () => {
  const bytes = readFileSync(withSteps(maille, folder, 40)), source = slowFile(bytes);
  const file = await MeshFile.open(source), before = source.reads.length, {rounds} = source;
  await file.readSteps();
  assert.ok(source.rounds - rounds <= times.length + 5, `${source.rounds - rounds} rounds`);
  const read = source.reads.slice(before).reduce((sum, [, count]) => sum + count, 0);
  // 64 KiB for the end and the header of each.
  assert.ok(read <= (2 * times.length + 2) * 65536, `${read} of ${bytes.length} bytes`);
  file.close();
  const cut = slowFile(bytes.subarray(0, bytes.length - 1000)), hurt = await MeshFile.open(cut);
  await assert.rejects(hurt.readSteps(), {code: ErrorCode.corrupt, message: /end is damaged/});
  assert.ok((await hurt.surface()).triangles.length > 0);
  hurt.close();
});

test('files without steps have none', async () => {
  for (const [mesh, ...options] of [[can.mesh], [bear], [bear, '--mode', 'random']]) {
    const file = await MeshFile.open(readFileSync(compressed(mesh, ...options)));
    assert.deepEqual(await file.readSteps(), [], mesh);
    file.close();
  }
});

test('pieces of a volume are the volume', async () => {
  for (const [volume, ...options] of streams) {
    const file = await MeshFile.open(readFileSync(compressed(volume, ...options)));
    const whole = await file.decode(), positions = new whole.positions.constructor(whole.positions.length);
    const types = [], connectivity = [];
    let points = 0;
    for await (const piece of file.pieces()) {
      assert.equal(piece.firstCell, types.length);
      for (const type of piece.types) types.push(type);
      for (const point of piece.connectivity) connectivity.push(point);
      for (const [i, point] of piece.points.entries()) positions.set(piece.positions.subarray(3 * i, 3 * i + 3), 3 * point);
      assert.ok(piece.slots.every(slot => slot < piece.slotCount));
      for (const {domain, components, values} of piece.arrays)
        assert.equal(values.length, components * (domain === 'cell' ? piece.types.length : piece.points.length));
      points += piece.points.length;
    }
    assert.deepEqual(connectivity, whole.blocks.flatMap(block => [...block.connectivity]), volume);
    const typesOf = ({cellType, types, connectivity}) => cellType === 255 ? [...types] : Array(connectivity.length / nodesOfType[cellType]).fill(cellType);
    assert.deepEqual(types, whole.blocks.flatMap(typesOf), volume);
    assert.deepEqual(positions, whole.positions, volume);
    assert.equal(points, whole.positions.length / 3);
    file.close();
  }
});

/** A file of which every read takes a turn; `rounds` counts turns with reads. */
function slowFile(bytes, size = bytes.length) {
  const reads = [];
  let turn = null;
  const source = {
    size, reads, rounds: 0,
    async readAt(offset, count) {
      reads.push([offset, count]);
      turn ??= new Promise(resolve => setTimeout(() => { turn = null; ++source.rounds; resolve(); }, 1));
      await turn;
      const part = new Uint8Array(count);
      if (offset < bytes.length) part.set(bytes.subarray(offset, Math.min(bytes.length, offset + count)));
      return part;
    },
  };
  return source;
}

test('all charts of a region are asked for at once', async () => {
  const source = slowFile(readFileSync(compressed(bunny, '--mode', 'random')));
  const file = await MeshFile.open(source), {centre, radius} = file.sphere;
  const before = source.rounds, reads = source.reads.length;
  await file.extract({box: {low: centre.map(x => x - radius), high: centre}});
  assert.ok(source.reads.length - reads > 2);
  // The front for the decoder of the pool, then all the charts.
  assert.ok(source.rounds - before <= 2, `${source.rounds - before} rounds`);
  file.close();
});

test('a volume is read a part at a time, each part once', async () => {
  const bytes = readFileSync(compressed(can.mesh));
  const source = slowFile(bytes), file = await MeshFile.open(source, {cacheBytes: 0});
  await file.surface();
  const sorted = source.reads.slice(2).sort((a, b) => a[0] - b[0]);
  for (let i = 1; i < sorted.length; ++i) assert.ok(sorted[i][0] >= sorted[i - 1][0] + sorted[i - 1][1], `${sorted}`);
  assert.ok(sorted.every(([, count]) => count <= 1 << 20));
  file.close();
});

test('a file far above 4 GB opens, and places in it are exact', async () => {
  const size = 6 * 2 ** 40 + 12345;
  const random = slowFile(readFileSync(compressed(bear, '--mode', 'random')), size);
  const file = await MeshFile.open(random), [chart] = await file.select();
  assert.ok((await file.decodeNode(chart)).triangles.length > 0);
  file.close();
  // Of a file of mode single the end is read first, if it is no small one, packed.
  const single = slowFile(readFileSync(compressed(scan)), size), controller = new AbortController();
  const whole = await MeshFile.open(single);
  const asked = new Promise(resolve => {
    const {readAt} = single;
    single.readAt = (offset, count) => {
      if (offset < 2 ** 32) return readAt(offset, count);
      resolve([offset, count]);
      return new Promise((_, reject) => controller.signal.addEventListener('abort', () => reject(controller.signal.reason)));
    };
  });
  const decoding = assert.rejects(whole.decode({signal: controller.signal}), {name: 'AbortError'});
  const [offset, count] = await asked;
  assert.equal(offset + count, size);
  controller.abort();
  await decoding;
  whole.close();
});

test('what takes more memory than allowed is refused', async () => {
  const file = await MeshFile.open(readFileSync(compressed(bear)), {meshBytes: 1000});
  await assert.rejects(file.decode(), {code: ErrorCode.memory});
  file.close();
});

test('the small decoder hands over to the other one where a file needs it', async () => {
  for (const options of [['-9'], ['-9', '--mode', 'random']]) {
    const file = await MeshFile.open(readFileSync(compressed(bear, ...options)));
    assert.ok((await file.decode()).blocks[0].connectivity.length > 0);
    file.close();
  }
});
