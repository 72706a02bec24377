// Libraries of materials, and files beside a mesh.
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {beside, parseLibrary} from '../viewer/src/material_library.js';

test('a library gives colours, opacity and pictures by the names of materials', () => {
  const all = parseLibrary('# made by hand\nKd 1 1 1\nnewmtl red paint\r\n  Kd 0.8 0.1 0\r\nd 0.5\nnewmtl wood\nmap_Kd -s 1 1 1 -clamp on oak planks.png\nTr 0.25\nKd 1 none 0\n');
  assert.deepEqual([...all], [['red paint', {colour: [0.8, 0.1, 0], opacity: 0.5}], ['wood', {picture: 'oak planks.png', opacity: 0.75}]]);
});

test('files beside a mesh never leave its folder', () => {
  const mesh = new URL('https://example.org/scans/a/mesh.maille?x=1');
  assert.equal(beside('./maps\\oak planks#1.png', mesh).href, 'https://example.org/scans/a/maps/oak%20planks%231.png');
  for (const name of ['', ' ', '/etc/passwd', '../b.mtl', 'x/../../b.mtl', 'https://other.org/b.mtl', 'C:\\b.mtl', 'data:text/plain,x', '\\\\server\\b.mtl', '..'])
    assert.equal(beside(name, mesh), null, name);
  assert.equal(beside('b.mtl', null), null);
});
