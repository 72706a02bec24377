// Damaged files through the WebAssembly decoders: damage.js COUNT [FIRST], of those that maille_damaged_files writes. Every answer
// must be an error with a sentence or the mesh that the native decoder gives; the decoder's memory stays within its limit, and it
// goes on with the next file. The last lines are a table for docs/reliability.md. scripts/fuzz-web calls it.
import {spawn} from 'node:child_process';
import {readFileSync, writeFileSync} from 'node:fs';
import path from 'node:path';
import {fileURLToPath} from 'node:url';

import {compileDecoder, Decoder, DecoderFile, decoderFor, ErrorCode, MailleError, WantsBytes} from '../src/decoder.js';
import * as volumes from '../src/volume_decoder.js';
import {checksumOf} from './checksum.js';

const root = fileURLToPath(new URL('../..', import.meta.url));
const program = path.join(process.env.MAILLE_BUILD ?? path.join(root, 'build/release'), 'tests/maille_damaged_files');

/** What a mesh may take, as in damaged_files.cc; and the decoder for itself and for what is in no mesh. */
const MESH_BYTES = 16 * 2 ** 20, SLACK = 8 * 2 ** 20;
/** Memory that nobody gave back is seen when files share a decoder. */
const FILES_PER_DECODER = 1000;

/** What `call` gives; null: an error as it may be. All else is thrown, traps of WebAssembly above all. */
function answerOf(call) {
  try {
    return call();
  } catch (error) {
    if (!(error instanceof MailleError) || /decoder stopped|not enough memory for/.test(error.message)) throw error;
    const known = Object.values(ErrorCode).includes(error.code) && error.message !== '';
    if (!known && !(error.code in decoderFor)) throw new Error(`an odd error: ${error.code} '${error.message}'`);
    return null;
  }
}

/** The same until it has all bytes: a damaged file may want any, also behind its end. */
function asked(file, bytes, call) {
  for (let round = 0; round < 50; ++round) {
    const answer = answerOf(call);
    if (!(answer instanceof WantsBytes)) return answer;
    for (const {offset, size} of answer.ranges) {
      if (!(offset >= 0 && offset + size <= bytes.length)) throw new Error(`wants ${size} bytes at ${offset} of ${bytes.length}`);
      file.give(offset, bytes.subarray(offset, offset + size));
    }
  }
  throw new Error('wants bytes again and again');
}

function askCharts(file, ask) {
  if (ask(() => file.open()) === null) return;
  ask(() => file.groups(0, 256));
  const charts = ask(() => file.select({level: 0})) ?? [];
  for (const {group, chart} of charts.slice(0, 4)) ask(() => file.chart(group, chart));
  ask(() => file.hit([0, 0, 1e3], [0, 0, -1]));
  if (ask(() => file.select({level: 0})) !== null) ask(() => file.extract({clip: true, sphere: {centre: [0, 0, 0], radius: 1}}));
}

function askStream(file, ask) {
  ask(() => volumes.steps(file));
  if (ask(() => volumes.beginPieces(file)) !== null) {
    for (let i = 0; i < 100 && ask(() => volumes.nextPiece(file)) !== null; ++i);
  }
  if (ask(() => volumes.beginPieces(file)) !== null) ask(() => volumes.surfaceOfPieces(file));
  if (ask(() => volumes.openVolume(file, {})) === null) return;
  ask(() => volumes.extractVolume(file, {}));
  ask(() => volumes.coarseVolume(file, {}));
  ask(() => volumes.sliceOfPiece(file, {plane: {normal: [0, 0, 1], offset: 0}, pieces: [0]}));
}

/** Everything of one file; the whole mesh, or null. */
function askEverything(file, bytes, mode) {
  const ask = call => asked(file, bytes, call);
  if (mode === 2) askCharts(file, ask);
  if (file.decoder.calls.maille_begin_pieces) askStream(file, ask);
  ask(() => file.metadata());
  ask(() => file.surface());
  return ask(() => file.decode(false));
}

/** One of the decoders, made anew now and then. */
class Tried {
  constructor(name) {
    Object.assign(this, {name, module: new WebAssembly.Module(readFileSync(new URL(`../dist/${name}.wasm`, import.meta.url))), files: 0,
      meshes: 0, errors: 0, findings: 0, most: 0});
  }
  async try(bytes, native, number) {
    if (this.files++ % FILES_PER_DECODER === 0) this.decoder = await Decoder.create(await compileDecoder(this.module));
    try {
      const file = new DecoderFile(this.decoder, bytes.length, 'x', MESH_BYTES);
      file.give(0, bytes.slice());
      const mesh = askEverything(file, bytes, bytes[20]);
      file.close();
      ++this[mesh ? 'meshes' : 'errors'];
      this.#compare(mesh, native);
      this.most = Math.max(this.most, this.decoder.memoryBytes);
      if (this.decoder.memoryBytes > MESH_BYTES + SLACK) throw new Error(`takes ${this.decoder.memoryBytes >> 20} MiB`);
    } catch (error) {
      ++this.findings;
      writeFileSync(`found-${number}.maille`, bytes);
      console.log(`${this.name}, number ${number} (found-${number}.maille): ${error.stack}`);
      this.decoder = await Decoder.create(await compileDecoder(this.module));
    }
  }
  /** The smaller decoders leave out what the full one has, and 32 bits hold less. */
  #compare(mesh, {code, checksum}) {
    if (mesh && code !== 0) throw new Error(`a mesh, where natively it is error ${code}`);
    if (mesh && checksumOf(mesh) !== checksum) throw new Error('another mesh than natively');
    if (!mesh && code === 0 && this.name === 'maille-full') throw new Error('no mesh, but there is one natively');
  }
}

/** What the program writes, as [{bytes, code, checksum}] one by one. */
async function *damagedFiles(count, first) {
  const child = spawn(program, [count, first], {stdio: ['ignore', 'pipe', 'inherit']});
  let held = Buffer.alloc(0);
  for await (const part of child.stdout) {
    held = Buffer.concat([held, part]);
    while (held.length >= 12 && held.length >= 12 + held.readUInt32LE(0)) {
      const end = 12 + held.readUInt32LE(0);
      yield {bytes: new Uint8Array(held.subarray(12, end)), code: held.readUInt32LE(4), checksum: held.readUInt32LE(8).toString(16).padStart(8, '0')};
      held = held.subarray(end);
    }
  }
}

const [count = 1000, first = 0] = process.argv.slice(2).map(Number);
const full = new Tried('maille-full'), small = new Tried('maille'), charts = new Tried('maille-charts');
let number = first;
for await (const {bytes, ...native} of damagedFiles(count, first)) {
  await full.try(bytes, native, number);
  if (bytes[20] !== 1) await small.try(bytes, native, number);
  if (bytes[20] === 2) await charts.try(bytes, native, number);
  ++number;
}
console.log('| decoder | files | meshes | errors | findings | most memory, MiB |\n|---|--:|--:|--:|--:|--:|');
for (const {name, files, meshes, errors, findings, most} of [charts, small, full])
  console.log(`| ${name}.wasm | ${files} | ${meshes} | ${errors} | ${findings} | ${(most / 2 ** 20).toFixed(1)} |`);
process.exitCode = number === first + count && full.findings + small.findings + charts.findings === 0 ? 0 : 1;
