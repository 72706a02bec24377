// What the benchmarks share: files made by the native command, CPU time, a throttled server, tables.
import {execFileSync} from 'node:child_process';
import {existsSync, mkdirSync, readFileSync} from 'node:fs';
import path from 'node:path';
import {fileURLToPath} from 'node:url';

export const root = fileURLToPath(new URL('../..', import.meta.url));
export const build = process.env.MAILLE_BUILD ?? path.join(root, 'build/release');
const cache = process.env.MAILLE_BENCH_FILES ?? path.join(root, 'build/web-bench');

/** A mesh of build/data, or of a path, compressed to a file of such an extension; made once. */
export const compressed = (mesh, ...options) => compressedAs('maille', mesh, ...options);
export function compressedAs(extension, mesh, ...options) {
  mkdirSync(cache, {recursive: true});
  const file = path.join(cache, `${path.basename(mesh)}${options.join('')}.${extension}`);
  const input = path.isAbsolute(mesh) ? mesh : path.join(root, 'build/data', mesh);
  if (!existsSync(file)) execFileSync(path.join(build, 'tool/maille'), ['compress', '-q', ...options, input, file]);
  return file;
}

/** The same mesh by draco3d, on a lattice of so many bits, as draco_encoder has it by default: level 7. */
export async function dracoOf(peers, {positions, blocks: [{connectivity}]}, bits) {
  const draco = await peers('draco3d').createEncoderModule({});
  const encoder = new draco.Encoder(), builder = new draco.MeshBuilder(), mesh = new draco.Mesh(), coded = new draco.DracoInt8Array();
  builder.AddFacesToMesh(mesh, connectivity.length / 3, connectivity);
  builder.AddFloatAttributeToMesh(mesh, draco.POSITION, positions.length / 3, 3, Float32Array.from(positions));
  encoder.SetAttributeQuantization(draco.POSITION, bits);
  encoder.SetSpeedOptions(3, 3);
  const data = new Int8Array(encoder.EncodeMeshToDracoBuffer(mesh, coded));
  for (let i = 0; i < data.length; ++i) data[i] = coded.GetValue(i);
  return data;
}

export const read = file => readFileSync(file);

/** Runs `work` until `least` ms of CPU time are over, at least `rounds` times; the least ms that one run took. Machines are busy. */
export function best(work, {rounds = 5, least = 1000} = {}) {
  let best = Infinity, spent = 0;
  for (let i = 0; i < rounds || spent < least; ++i) {
    const begin = process.cpuUsage();
    work();
    const {user, system} = process.cpuUsage(begin), ms = (user + system) / 1000;
    best = Math.min(best, ms);
    spent += ms;
  }
  return best;
}

export function table(title, head, rows) {
  console.log(`\n${title}\n\n| ${head.join(' | ')} |\n|${head.map((_, i) => i === 0 ? '---' : '--:').join('|')}|`);
  for (const row of rows) console.log(`| ${row.join(' | ')} |`);
}
