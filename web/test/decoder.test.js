// The WebAssembly decoder gives what the native one gives. Needs the native programs of build/release.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdtempSync, readdirSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import path from 'node:path';
import {after, test} from 'node:test';
import {fileURLToPath} from 'node:url';

import {decode, ErrorCode, MailleError, MeshFile} from '../src/maille.js';
import {checksumOf} from './checksum.js';

const root = fileURLToPath(new URL('../..', import.meta.url));
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
  execFileSync(maille, ['compress', '-q', '-f', ...options, path.join(root, 'build/data', mesh), file]);
  return file;
}

test('golden files of all modes decode to the same bytes as natively', () => expectTheSame(filesBelow('tests/golden', '.maille')));

test('damaged files are refused as they are natively', () => expectTheSame(filesBelow('tests/corrupt', '.maille')));

test('real surfaces decode to the same bytes as natively, at all kinds of levels', () => expectTheSame(
  ['-1', '-3', '-5', '-9'].flatMap(level => [compressed('tri/cheese.off', level), compressed('tri/bear.off', level, '--bits', '12'),
    compressed('tri/bear.off', level, '--mode', 'random')])));

test('real volumes decode to the same bytes as natively', () => expectTheSame(
  ['hex', 'tet', 'mixed'].flatMap(kind => readdirSync(path.join(root, 'build/data', kind)).sort().slice(0, 3)
    .map(name => compressed(`${kind}/${name}`)))));

test('charts of level 0 hold every face once', async () => {
  const bytes = readFileSync(compressed('tri/bear.off', '--mode', 'random'));
  const file = await MeshFile.open(bytes), whole = await file.decode();
  let faces = 0;
  for (const chart of await file.select({level: 0})) faces += (await file.decodeNode(chart)).triangles.length / 3;
  assert.equal(faces, whole.blocks[0].connectivity.length / 3);
  assert.equal(faces, file.levels[0].faces);
  file.close();
});

test('a ray meets the original where the whole mesh has its nearest triangle', async () => {
  const file = await MeshFile.open(readFileSync(compressed('tri/bear.off', '--mode', 'random')));
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
  const file = await MeshFile.open(readFileSync(compressed('tri/bear.off', '--mode', 'random')));
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

test('what is no .maille file is named', async () => {
  await assert.rejects(MeshFile.open(new Uint8Array(100)), {name: 'MailleError', code: 6, message: /is no \.maille file/});
  await assert.rejects(MeshFile.open(new Uint8Array(3)), {code: 6});
  await assert.rejects(MeshFile.open(42), {code: 2});
});

test('an aborted call is rejected, and the file stays usable', async () => {
  const file = await MeshFile.open(readFileSync(compressed('tri/bear.off', '--mode', 'random')));
  const [chart] = await file.select({level: 0});
  await assert.rejects(file.decodeNode(chart, {signal: AbortSignal.abort()}), {name: 'AbortError'});
  assert.ok((await file.decodeNode(chart)).triangles.length > 0);
  file.close();
});
