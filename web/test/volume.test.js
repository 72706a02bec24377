// Parts of volumes are those that the command gives of the same file. Needs the native programs of build/release.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import path from 'node:path';
import {after, test} from 'node:test';

import {boundaryOf} from './boundary.js';
import {bear, can, hasTwins, long, manyMixed, pathOf, root, volumes} from './meshes.js';
import {decode, ErrorCode, MeshFile} from '../src/maille.js';

const build = process.env.MAILLE_BUILD ?? path.join(root, 'build/release');
const maille = path.join(build, 'tool/maille');
const folder = mkdtempSync(path.join(tmpdir(), 'maille-volume-'));
after(() => rmSync(folder, {recursive: true}));

function compressed(mesh, ...options) {
  const file = path.join(folder, `${path.basename(mesh)}${options.join('')}.maille`);
  execFileSync(maille, ['compress', '-q', '-f', ...options, pathOf(mesh), file]);
  return file;
}
/** What a verb of the command writes, as a mesh. */
async function native(verb, file, ...options) {
  const mesh = path.join(folder, 'native.vtk'), own = path.join(folder, 'native.maille');
  execFileSync(maille, [verb, '-q', '-f', file, mesh, ...options]);
  execFileSync(maille, ['compress', '-q', '-f', '--keep-order', mesh, own]);
  return decode(readFileSync(own));
}
const middleOf = ({low, high}) => low.map((x, k) => (x + high[k]) / 2);
const sorted = list => [...list].sort();
/** Values of tuple i. */
const tuple = ({values, components}, i) => [...values.subarray(i * components, (i + 1) * components)].join(' ');
const ofElements = arrays => arrays.filter(({domain}) => domain !== 'mesh');

/** Triangles around the first corner of each polygon, with all values, as `slice()` draws them. */
function trianglesOf({positions, blocks, arrays}, origin) {
  const triangles = [];
  let cell = 0;
  for (const {cellType, types, offsets, connectivity} of blocks) {
    const size = {5: 3, 9: 4}[cellType], count = size ? connectivity.length / size : offsets.length - 1;
    for (let i = 0; i < count; ++i, ++cell) {
      const corners = connectivity.subarray(size ? i * size : offsets[i], size ? (i + 1) * size : offsets[i + 1]);
      for (let k = 2; k < corners.length; ++k) triangles.push([corners[0], corners[k - 1], corners[k], cell]);
    }
  }
  const place = point => origin.map((x, k) => Math.fround(positions[3 * point + k] - x)).join(' ');
  const text = ([a, b, c, cell]) => [a, b, c].map(place).join(' ') +
    ofElements(arrays).map(array => `${array.name}: ${(array.domain === 'point' ? [a, b, c] : [cell]).map(i => tuple(array, i))}`).join();
  return sorted(triangles.map(text));
}
function drawnTriangles({positions, triangles, arrays}) {
  const all = [];
  for (let i = 0; i < triangles.length; i += 3) {
    const corners = [...triangles.subarray(i, i + 3)];
    all.push(corners.map(vertex => [...positions.subarray(3 * vertex, 3 * vertex + 3)].join(' ')).join(' ') +
      arrays.map(array => `${array.name}: ${(array.domain === 'point' ? corners : [i / 3]).map(k => tuple(array, k))}`).join());
  }
  return sorted(all);
}

const canInPieces = () => compressed(can.mesh, '--pieces', String(can.pieces));

test('a slice is what `maille slice` gives of the same file, in pieces or not', async () => {
  for (const [mesh, cells] of volumes) {
    for (const pieces of [String(cells), 'off']) {
      const packed = compressed(mesh, '--pieces', pieces), file = await MeshFile.open(readFileSync(packed));
      const box = (await MeshFile.open(readFileSync(compressed(mesh, '--pieces', String(cells))))).info.volume.box;
      for (const axis of [0, 2]) {
        const normal = [0, 1, 2].map(k => Number(k === axis)), middle = middleOf(box);
        const own = await file.slice({normal, offset: -middle[axis]});
        const expected = await native('slice', packed, `--plane=${[...middle, ...normal]}`);
        assert.ok(own.triangles.length > 0);
        assert.deepEqual(own.problems, []);
        assert.deepEqual(drawnTriangles(own), trianglesOf(expected, own.origin), `${mesh} ${pieces} ${axis}`);
      }
      file.close();
    }
  }
});

test('a slice has the numbers of its cells, and the arrays that are asked for', async () => {
  const file = await MeshFile.open(readFileSync(canInPieces()));
  const whole = await file.decode(), offset = -middleOf(file.info.volume.box)[1];
  const own = await file.slice({normal: [0, 1, 0], offset}, {arrays: [can.scalar]});
  assert.deepEqual(own.arrays.map(({name}) => name), [can.scalar]);
  const {values} = whole.arrays.find(({name}) => name === can.scalar);
  assert.deepEqual([...own.arrays[0].values], Array.from(own.cells, cell => values[cell]));
  await assert.rejects(file.slice({normal: [0, 1, 0], offset}, {arrays: ['none']}), {code: ErrorCode.usage, message: /no array named "none"/});
  file.close();
});

test('cells of a query are those that `maille extract` gives, bit for bit', async () => {
  const packed = canInPieces(), file = await MeshFile.open(readFileSync(packed));
  const {box: {low, high}} = file.info.volume, middle = middleOf({low, high}), {scalar, least, vector, most, reach, other} = can;
  for (const [request, ...options] of [
    [{box: {low, high: middle}}, `--box=${[...low, ...middle]}`],
    [{where: [{array: scalar, low: least}]}, '--where', `${scalar} >= ${least}`],
    [{where: [{array: vector, component: 2, high: most}], sphere: {centre: middle, radius: reach}}, '--where', `${vector}[2] <= ${most}`, `--sphere=${[...middle, reach]}`],
    [{plane: {normal: [1, 0, 0], offset: -middle[0]}, arrays: [other]}, `--plane=${[...middle, 1, 0, 0]}`, '--arrays', other],
    [{cells: [1000, 1200]}, '--cells', '1000:1200'],
  ]) {
    const own = await file.extract(request), expected = await native('extract', packed, ...options), what = JSON.stringify(request);
    assert.deepEqual(own.positions, expected.positions, what);
    assert.deepEqual(own.blocks.map(({connectivity}) => connectivity), expected.blocks.map(({connectivity}) => connectivity), what);
    assert.deepEqual(ofElements(own.arrays).map(({values}) => values), ofElements(expected.arrays).map(({values}) => values), what);
    assert.equal(own.cellNumbers.length * 8, own.blocks[0].connectivity.length);
    assert.ok(own.cellNumbers.length > 0, what);
    const selected = await file.select(request);
    assert.equal(own.pieces, selected.length);
    assert.equal(own.cellsRead, selected.reduce((sum, {cells}) => sum + cells, 0));
  }
  await assert.rejects(file.extract({where: [{array: 'T', low: 1}]}), {code: ErrorCode.usage, message: /no array named "T"/});
  file.close();
});

/** Triangles by numbers of points and cells of the input, wherever they begin. */
function numbered(triangles) {
  return sorted(triangles.map(([cell, ...points]) => {
    const first = points.indexOf(Math.min(...points));
    return `${cell}: ${[0, 1, 2].map(k => points[(first + k) % 3])}`;
  }));
}

test('the surface of a volume in pieces is the faces that one solid has, with the values of points and cells', async () => {
  for (const [mesh, cells] of [...volumes.slice(0, 3), manyMixed]) {
    const file = await MeshFile.open(readFileSync(compressed(mesh, '--pieces', String(cells))));
    const whole = await file.decode(), surface = await file.surface();
    const own = Array.from(surface.cells, (cell, i) => [cell, ...[0, 1, 2].map(k => surface.points[surface.triangles[3 * i + k]])]);
    const expected = boundaryOf(whole).flatMap(({points, cell}) => points.slice(2).map((_, i) => [cell, points[0], points[i + 1], points[i + 2]]));
    assert.deepEqual(numbered(own), numbered(expected), mesh);
    for (const {name, domain, components, values} of ofElements(whole.arrays)) {
      const drawn = surface.arrays.find(array => array.name === name && array.domain === (domain === 'cell' ? 'triangle' : 'point'));
      const from = domain === 'cell' ? surface.cells : surface.points;
      assert.deepEqual(drawn.values, drawn.values.map((_, i) => values[from[Math.floor(i / components)] * components + i % components]), `${mesh} ${name}`);
    }
    file.close();
  }
});

test('without the order of the input the surface has as many faces, and slices as many polygons', async () => {
  // Faces of other points at the same place are taken for the same: all but a mesh with such.
  for (const [mesh, cells] of volumes.filter(([mesh]) => !hasTwins(mesh))) {
    const [whole, pieces] = await Promise.all(['off', String(cells)].map(async option => {
      const file = await MeshFile.open(readFileSync(compressed(mesh, '--any-order', '--pieces', option)));
      const middle = middleOf((await MeshFile.open(readFileSync(compressed(mesh, '--pieces', String(cells))))).info.volume.box);
      const [surface, slice] = [await file.surface(), await file.slice({normal: [0, 0, 1], offset: -middle[2]})];
      file.close();
      return [surface, slice].map(({triangles, cells}) => [triangles.length, new Set(cells).size]);
    }));
    assert.deepEqual(pieces, whole, mesh);
  }
});

test('the coarse level is that of `maille extract --coarse`, of the index alone', async () => {
  const packed = canInPieces(), bytes = readFileSync(packed), {asked, fetch} = server(bytes);
  const file = await MeshFile.open('http://localhost/x.maille', {fetch}), opened = asked.length;
  const own = await file.coarse(), expected = await native('extract', packed, '--coarse');
  assert.equal(asked.length, opened);
  assert.deepEqual(own.positions, expected.positions);
  assert.deepEqual(own.arrays.map(({name, values}) => [name, values]), ofElements(expected.arrays).map(({name, values}) => [name, values]));
  assert.ok(own.positions.length > 0);
  file.close();
});

/** fetch() of one file, with ranges; `asked`: the ranges. */
function server(bytes) {
  const asked = [];
  const fetch = async (url, {headers: {Range}}) => {
    const [first, last] = Range.match(/(\d+)-(\d+)/).slice(1).map(Number), end = Math.min(bytes.length, last + 1);
    asked.push([first, end - first]);
    await new Promise(resolve => setTimeout(resolve, 1));
    const headers = {'Content-Range': `bytes ${first}-${end - 1}/${bytes.length}`};
    return new Response(bytes.subarray(first, end), {status: 206, headers});
  };
  return {asked, fetch};
}

test('a distant volume is opened with two requests, and a plane fetches the pieces that it meets, once', async () => {
  const [mesh, cells] = long, bytes = readFileSync(compressed(mesh, '--pieces', String(cells))), {asked, fetch} = server(bytes);
  const file = await MeshFile.open('http://localhost/x.maille', {fetch, cacheBytes: 0});
  assert.ok(asked.length <= 2, `${asked}`);
  const {box, pieces} = file.info.volume, plane = {normal: [1, 0, 0], offset: -(0.9 * box.low[0] + 0.1 * box.high[0])};
  const met = await file.select({plane}), opened = asked.length;
  assert.ok(met.length > 0 && met.length < pieces / 2, `${met.length} of ${pieces}`);
  const first = await file.slice(plane);
  assert.ok(asked.length - opened <= 3, `${asked}`);
  const fetched = asked.slice(opened).reduce((sum, [, size]) => sum + size, 0);
  assert.ok(fetched <= met.reduce((sum, piece) => sum + piece.bytes, 0) + 2 * 16384 + 65536, `${fetched} of ${bytes.length}`);
  // The decoders have kept the pieces.
  const before = asked.length, again = await file.slice(plane);
  assert.equal(asked.length, before);
  assert.deepEqual(again, first);
  file.close();
});

test('pieces are given back where memory for them is little, and slices are the same', async () => {
  const bytes = readFileSync(canInPieces());
  const slices = await Promise.all([undefined, 1].map(async pieceBytes => {
    const file = await MeshFile.open(bytes, {pieceBytes}), [x] = middleOf(file.info.volume.box), slices = [];
    for (const offset of [x, x + 1, x]) slices.push(drawnTriangles(await file.slice({normal: [1, 0, 0], offset: -offset})));
    file.close();
    return slices;
  }));
  assert.deepEqual(slices[1], slices[0]);
});

test('a damaged piece is named, and the others are sliced', async () => {
  const packed = canInPieces(), bytes = readFileSync(packed), good = await MeshFile.open(bytes);
  const plane = {normal: [0, 1, 0], offset: -middleOf(good.info.volume.box)[1]}, whole = await good.slice(plane);
  // Pieces stand one behind the other, behind a description.
  const hurt = Buffer.from(bytes), [{piece}] = await good.select({plane});
  const before = (await good.select()).slice(0, piece).reduce((sum, {bytes}) => sum + bytes, 0);
  hurt.fill(255, before + 8000, before + 8100);
  const file = await MeshFile.open(hurt), {problems, cells} = await file.slice(plane);
  assert.equal(problems.length, 1);
  assert.match(problems[0], /piece \d+/);
  assert.ok(cells.length > 0 && cells.length < whole.cells.length);
  const extracted = await file.extract({plane});
  assert.deepEqual(extracted.problems, problems);
  good.close();
  file.close();
});

test('a slice that is no longer wanted ends, and the file stays usable', async () => {
  const file = await MeshFile.open(readFileSync(canInPieces()));
  const plane = {normal: [0, 1, 0], offset: -middleOf(file.info.volume.box)[1]}, controller = new AbortController();
  const slicing = assert.rejects(file.slice(plane, {signal: controller.signal, onProgress: () => controller.abort()}), {name: 'AbortError'});
  await slicing;
  assert.ok((await file.slice(plane)).triangles.length > 0);
  await assert.rejects(file.slice(plane, {signal: AbortSignal.abort()}), {name: 'AbortError'});
  file.close();
});

test('files of other modes have no slices, which is told', async () => {
  const file = await MeshFile.open(readFileSync(compressed(bear)));
  await assert.rejects(file.slice({normal: [0, 0, 1], offset: 0}), {code: ErrorCode.usage, message: /read in parts/});
  file.close();
});
