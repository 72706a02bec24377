// Millions of triangles a second on one thread, in CPU time: charts of maille beside draco3d and meshoptimizer (npm), which
// decode the whole mesh, all on the same positions and faces; and the native library on the same charts.
import {execFileSync} from 'node:child_process';
import {createRequire} from 'node:module';
import path from 'node:path';

import {decode, ready} from '../src/maille.js';
import {Decoder, DecoderFile} from '../src/decoder.js';
import {decodeDraco} from './draco.js';
import {best, build, compressed, dracoOf, read, table} from './support.js';

const peers = createRequire(process.env.MAILLE_PEERS ? path.join(process.env.MAILLE_PEERS, 'x.js') : import.meta.url);
const mesh = process.argv[2] ?? 'tri/stanford_dragon_vrip.ply';
const file = compressed(mesh, '--mode', 'random', '-2', '--bits', '14');
const bytes = read(file);
const whole = await decode(bytes);
const triangles = whole.blocks[0].connectivity.length / 3;
const rows = [];
const row = (name, count, ms, size) => rows.push([name, (count / ms / 1000).toFixed(1), (size * 8 / triangles).toFixed(2)]);

async function charts(name, call) {
  const open = new DecoderFile(await Decoder.create(await ready()), bytes.length, 'bench');
  open.give(0, bytes);
  open.open();
  const list = open.select({level: 0});
  let count = 0;
  const ms = best(() => {
    count = 0;
    for (const {group, chart} of list) count += call(open, group, chart);
  });
  row(name, count, ms, bytes.length);
  open.close();
  return count / ms / 1000;
}

const own = await charts('maille, charts to typed arrays', (open, group, chart) => open.chart(group, chart).triangles.length / 3);
{
  const open = new DecoderFile(await Decoder.create(await ready()), bytes.length, 'bench');
  open.give(0, bytes);
  open.open();
  const list = open.select({level: 0});
  const ms = best(() => { for (const {group, chart} of list) open.decoder.calls.maille_read_chart(open.reader, group, chart); });
  row('maille, charts left where they were decoded', triangles, ms, bytes.length);
}

try {
  const native = Number(execFileSync(path.join(build, 'tests/maille_native_charts'), [file, '10'], {encoding: 'utf8'}));
  rows.push(['maille, native, charts left where they were decoded', native.toFixed(1), (bytes.length * 8 / triangles).toFixed(2)]);
} catch {}

try {
  const data = await dracoOf(peers, whole, 14), size = data.length;
  const module = await peers('draco3d').createDecoderModule({});
  const ms = best(() => decodeDraco(module, data), {rounds: 3});
  row('draco3d, level 7, 14 bits', triangles, ms, size);
  rows.push(['maille over draco3d', `${(own / (triangles / ms / 1000)).toFixed(1)} x`, '']);
} catch (error) {
  console.error('no draco3d:', error.message);
}

try {
  const {MeshoptEncoder: encoder, MeshoptDecoder: decoder} = peers('meshoptimizer');
  await Promise.all([encoder.ready, decoder.ready]);
  const points = whole.positions.length / 3;
  const [remap, unique] = encoder.reorderMesh(Uint32Array.from(whole.blocks[0].connectivity), true, false);
  const low = [0, 1, 2].map(k => whole.positions.reduce((least, x, i) => i % 3 === k ? Math.min(least, x) : least, Infinity));
  const high = [0, 1, 2].map(k => whole.positions.reduce((most, x, i) => i % 3 === k ? Math.max(most, x) : most, -Infinity));
  const scale = (2 ** 14 - 1) / Math.max(...high.map((x, k) => x - low[k])), vertices = new Uint16Array(4 * unique);
  for (let i = 0; i < points; ++i) {
    if (remap[i] !== 0xffffffff) for (let k = 0; k < 3; ++k) vertices[4 * remap[i] + k] = Math.round((whole.positions[3 * i + k] - low[k]) * scale);
  }
  const index = Uint32Array.from(whole.blocks[0].connectivity, p => remap[p]);
  const codedIndex = encoder.encodeIndexBuffer(new Uint8Array(index.buffer), index.length, 4);
  const codedVertices = encoder.encodeVertexBuffer(new Uint8Array(vertices.buffer), unique, 8);
  const outIndex = new Uint8Array(index.length * 4), outVertices = new Uint8Array(unique * 8);
  const ms = best(() => {
    decoder.decodeIndexBuffer(outIndex, index.length, 4, codedIndex);
    decoder.decodeVertexBuffer(outVertices, unique, 8, codedVertices);
  });
  row('meshoptimizer, 14 bits', triangles, ms, codedIndex.length + codedVertices.length);
} catch (error) {
  console.error('no meshoptimizer:', error.message);
}
table(`Decoding ${path.basename(mesh)}, ${triangles} triangles, 14 bits, one thread`, ['', 'M triangles/s', 'bits a triangle'], rows);
