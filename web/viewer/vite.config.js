import path from 'node:path';

import {defineConfig} from 'vite';

const here = import.meta.dirname;

export default defineConfig({
  root: here,
  // Served from anywhere: `maille view`, a folder of a web server.
  base: './',
  // web/src asks for three where it has none of its own.
  resolve: {alias: [{find: /^three$/, replacement: path.join(here, 'node_modules/three/build/three.module.js')}]},
  build: {
    outDir: path.join(here, '../dist/viewer'), emptyOutDir: true, target: 'es2022', chunkSizeWarningLimit: 1000,
    rolldownOptions: {external: ['node:fs/promises']},
  },
  worker: {format: 'es'},
  server: {fs: {allow: [path.join(here, '..')]}},
});
