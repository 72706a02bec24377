// <maille-viewer> as a module of its own, with three in it: web/dist/element, part of the npm package.
import path from 'node:path';

import {defineConfig, mergeConfig} from 'vite';

import viewer from './vite.config.js';

const here = import.meta.dirname;

export default defineConfig(mergeConfig(viewer, {
  publicDir: false,
  build: {
    outDir: path.join(here, '../dist/element'), modulePreload: false,
    rolldownOptions: {
      input: path.join(here, 'src/element.js'), preserveEntrySignatures: 'exports-only',
      output: {entryFileNames: 'maille-viewer.js', chunkFileNames: '[name]-[hash].js', assetFileNames: '[name]-[hash][extname]'},
    },
  },
}));
