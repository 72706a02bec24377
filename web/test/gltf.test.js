// glTF files with .maille files in them: JavaScript gives each accessor what the command gives. Needs build/release.
import assert from 'node:assert/strict';
import {execFileSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import path from 'node:path';
import {after, test} from 'node:test';

import {models, pathOf, root} from './meshes.js';
import {compressedAccessors, createSyncDecoder, MailleMeshCompression} from '../src/gltf.js';
import {MailleError} from '../src/maille.js';

const maille = path.join(process.env.MAILLE_BUILD ?? path.join(root, 'build/release'), 'tool/maille');
const folder = mkdtempSync(path.join(tmpdir(), 'maille-gltf-'));
after(() => rmSync(folder, {recursive: true}));

const sizes = {SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4};

function open(file) {
  const bytes = readFileSync(file), size = bytes.readUInt32LE(12), json = JSON.parse(bytes.subarray(20, 20 + size));
  const view = i => {
    const {byteOffset = 0, byteLength} = json.bufferViews[i];
    return bytes.subarray(28 + size + byteOffset, 28 + size + byteOffset + byteLength);
  };
  return {json, view};
}
function compressed(source, name, ...options) {
  const packed = path.join(folder, `${name}.maille.glb`), plain = path.join(folder, `${name}.glb`);
  execFileSync(maille, ['compress', '-q', ...options, source, packed]);
  execFileSync(maille, ['decompress', '-q', packed, plain]);
  return {packed: open(packed), plain: open(plain)};
}
function expectTheSame({packed, plain}, decoder) {
  const meshes = new Map(), accessors = compressedAccessors(packed.json);
  assert.ok(accessors.size > 0);
  for (const [number, {view, values}] of accessors) {
    if (!meshes.has(view)) meshes.set(view, decoder.decode(packed.view(view)));
    const array = values(meshes.get(view)), {bufferView, type, count} = plain.json.accessors[number];
    const bytes = Buffer.from(array.buffer, array.byteOffset, array.byteLength), wanted = plain.view(bufferView);
    const size = sizes[type] * array.BYTES_PER_ELEMENT, stride = plain.json.bufferViews[bufferView].byteStride ?? size;
    for (let i = 0; i < count; ++i)
      assert.equal(bytes.compare(wanted, i * stride, i * stride + size, i * size, (i + 1) * size), 0, `accessor ${number}, ${i}`);
  }
}

const wave = path.join(folder, 'small.glb');
execFileSync(maille, ['convert', '-q', path.join(root, 'tests/cli/data/wave.ply'), wave]);

test('accessors are those of the command, bit for bit and with loss', async () => {
  const decoder = await createSyncDecoder(), model = pathOf(models[0]);
  expectTheSame(compressed(model, 'exact'), decoder);
  expectTheSame(compressed(model, 'lossy', '--bits', '12', '--bits', 'normal=10'), decoder);
});

test('levels beyond the small decoder name what they need', async () => {
  const best = compressed(wave, 'best', '-9'), [{view}] = compressedAccessors(best.packed.json).values();
  const small = await createSyncDecoder();
  assert.throws(() => small.decode(best.packed.view(view)), error => error instanceof MailleError && /full/.test(error.message));
  expectTheSame(best, await createSyncDecoder({full: true}));
});

test('the plug-in gives views to accessors, and decodes a file once', async () => {
  const {packed} = compressed(wave, 'plugin'), {json} = packed, before = json.bufferViews.length;
  let asked = 0;
  const parser = {json, getDependency: async (type, i) => (++asked, new Uint8Array(packed.view(i)).buffer)};
  const plugin = new MailleMeshCompression(parser), accessors = compressedAccessors(json);
  assert.equal(plugin.beforeRoot(), null);
  assert.equal(json.bufferViews.length, before + accessors.size);
  assert.equal(plugin.loadBufferView(0), null);
  for (const number of accessors.keys()) {
    const {bufferView, count, type} = json.accessors[number], buffer = await plugin.loadBufferView(bufferView);
    assert.ok(buffer instanceof ArrayBuffer && buffer.byteLength % (count * sizes[type]) === 0);
  }
  assert.equal(asked, new Set([...accessors.values()].map(({view}) => view)).size);
});

test('what does not fit is named', async () => {
  const {packed} = compressed(wave, 'bad'), decoder = await createSyncDecoder(), {json} = packed;
  const link = json.meshes[0].primitives[0].extensions.MAILLE_mesh_compression;
  const mesh = decoder.decode(packed.view(link.bufferView)), position = json.meshes[0].primitives[0].attributes.POSITION;
  const values = () => compressedAccessors(json).get(position).values(mesh);
  link.attributes.POSITION = 'elsewhere';
  assert.throws(values, /no array 'elsewhere'/);
  link.attributes.POSITION = 'position';
  json.accessors[position].count += 1;
  assert.throws(values, /not what was decoded/);
  assert.throws(() => decoder.decode(packed.view(link.bufferView).subarray(0, 300)), MailleError);
});
