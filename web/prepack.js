// Before `npm pack`: a package without decoders or viewer, or with those of older sources, is no package. What is missing is
// built; where it cannot be, packing stops with a sentence.
import {execFileSync} from 'node:child_process';
import {copyFileSync, existsSync, readdirSync, statSync} from 'node:fs';
import path from 'node:path';
import {fileURLToPath} from 'node:url';

const root = fileURLToPath(new URL('..', import.meta.url)), inRoot = name => path.join(root, name);
const decoders = ['maille-charts', 'maille', 'maille-full'].map(name => inRoot(`web/dist/${name}.wasm`)), element = inRoot('web/dist/element/maille-viewer.js');

function newest(folder) {
  const files = readdirSync(inRoot(folder), {recursive: true}).filter(name => /\.(js|css|cpp|h|txt)$/.test(name) && !/_test\.cpp$/.test(name));
  return Math.max(...files.map(name => statSync(path.join(inRoot(folder), name)).mtimeMs));
}
function older(file, ...folders) {
  return !existsSync(file) || statSync(file).mtimeMs < Math.max(...folders.map(newest));
}
/** Why something is to be built; null: all is there. */
function missing() {
  const decoder = decoders.find(file => !existsSync(file));
  if (decoder) return `${path.relative(root, decoder)} is missing`;
  if (decoders.some(file => older(file, 'bindings/wasm'))) return 'the decoders of web/dist are older than bindings/wasm';
  if (older(element, 'web/src', 'web/viewer/src')) return 'web/dist/element is missing, or older than its sources';
  return null;
}

const why = missing();
if (why) {
  console.error(`npm pack: ${why}: building with scripts/build-viewer`);
  try {
    execFileSync(inRoot('scripts/build-viewer'), {stdio: ['ignore', 2, 2]});
  } catch {
    console.error(`npm pack stops: ${why}, and scripts/build-viewer, which needs emscripten and npm, failed.`);
    process.exit(1);
  }
}
copyFileSync(inRoot('LICENSE'), inRoot('web/LICENSE'));
