// Files on servers: what is asked for, and what goes wrong.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {createServer} from 'node:http';
import {after, before, test} from 'node:test';

import {bytesOf, CachedBytes} from '../src/bytes.js';
import {MeshFile} from '../src/maille.js';

const golden = readFileSync(new URL('../../tests/golden/random/arrays.maille', import.meta.url));
const large = Uint8Array.from({length: 1 << 20}, (_, i) => (i * 2654435761) >>> 24);
let server, address, log, misbehave;

before(async () => {
  server = createServer((request, response) => {
    const content = request.url === '/golden' ? golden : large;
    log.push(request.headers.range);
    if (misbehave?.(request, response, content)) return;
    serveRange(request, response, content);
  });
  await new Promise(resolve => server.listen(0, '127.0.0.1', resolve));
  address = `http://127.0.0.1:${server.address().port}`;
});
after(() => server.close());

function serveRange(request, response, content, etag = '"one"') {
  const [, first, last] = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range).map(Number);
  const end = Math.min(last + 1, content.length);
  response.writeHead(206, {'Content-Range': `bytes ${first}-${end - 1}/${content.length}`, 'Content-Length': end - first, ETag: etag});
  response.end(content.subarray(first, end));
}

function fresh(behaviour = null) {
  log = [];
  misbehave = behaviour;
}

test('of bytes that are here already only the rest is asked for', async () => {
  const asked = [], source = {size: large.length, name: 'large', read: async (offset, size) => (asked.push([offset, size]), large.slice(offset, offset + size))};
  const cached = new CachedBytes(source, 1 << 20);
  for (const [offset, size, fetched] of [[0, 1000, [0, 1000]], [100, 300, null], [500, 1000, [1000, 500]], [3000, 500, [3000, 500]],
    [1200, 2000, [1500, 1500]], [0, 3500, [1000, 2000]], [50, 3450, null], [2900, 1000, [3500, 400]], [5000, 0, [5000, 0]]]) {
    asked.length = 0;
    assert.deepEqual(await cached.read(offset, size), large.slice(offset, offset + size), `${offset} ${size}`);
    assert.deepEqual(asked, fetched ? [fetched] : [], `${offset} ${size}`);
  }
});

test('a path where an address belongs is told at once, with what to do', async () => {
  await assert.rejects(MeshFile.open('scans/a.maille'), {code: 2, message: /^scans\/a.maille: is no address .* open\(await readFile\('scans\/a.maille'\)\)$/});
  fresh();
  const bytes = await bytesOf('golden', {fetch: (url, more) => fetch(new URL(url, address), more)});
  assert.equal(bytes.size, golden.length);
});

test('one request gives the size and the front, and a small file needs no other', async () => {
  fresh();
  const file = await MeshFile.open(`${address}/golden`);
  for (const chart of await file.select({level: 0})) await file.decodeNode(chart);
  assert.equal(log.length, 1);
  file.close();
});

test('ranges near one another are one request, others go beside each other', async () => {
  fresh();
  const bytes = await bytesOf(`${address}/large`);
  const reads = [[100_000, 10], [100_500, 1000], [900_000, 5]];
  const parts = await Promise.all(reads.map(([offset, size]) => bytes.read(offset, size)));
  for (const [i, [offset, size]] of reads.entries()) assert.deepEqual([...parts[i]], [...large.subarray(offset, offset + size)]);
  assert.deepEqual(log, ['bytes=0-65535', 'bytes=100000-101499', 'bytes=900000-900004']);
});

test('a busy server is asked again', async () => {
  let left = 2;
  fresh((request, response) => left-- > 0 && response.writeHead(503).end());
  const bytes = await bytesOf(`${address}/large`);
  assert.equal(bytes.size, large.length);
  assert.equal(log.length, 3);
});

test('a missing file is an error at once', async () => {
  fresh((request, response) => response.writeHead(404).end());
  await assert.rejects(bytesOf(`${address}/large`), {code: 10, message: /404/});
  assert.equal(log.length, 1);
});

test('a server without ranges gives the whole file, part by part as it arrives', async () => {
  let rest;
  fresh((request, response, content) => {
    response.writeHead(200, {'Content-Length': content.length});
    response.write(content.subarray(0, 200_000));
    rest = () => response.end(content.subarray(200_000));
    return true;
  });
  const bytes = await bytesOf(`${address}/large`);
  assert.deepEqual([...await bytes.read(150_000, 8)], [...large.subarray(150_000, 150_008)]);
  const last = bytes.read(large.length - 4, 4);
  rest();
  assert.deepEqual([...await last], [...large.subarray(large.length - 4)]);
  assert.equal(log.length, 1);
});

test('a server that claims to send more than it does takes no more memory', async () => {
  const before = process.memoryUsage().arrayBuffers, claimed = 1.9e9;
  fresh((request, response) => {
    response.writeHead(200, {'Content-Length': claimed});
    response.write(large, () => response.destroy());
    return true;
  });
  const bytes = await bytesOf(`${address}/large`, {maxWhole: Infinity});
  assert.deepEqual(await bytes.read(0, 1000), large.slice(0, 1000));
  assert.ok(process.memoryUsage().arrayBuffers - before < 200e6);
  await assert.rejects(bytes.read(claimed - 10, 10));
});

test('a large file is not fetched whole by accident', async () => {
  fresh((request, response, content) => { response.writeHead(200, {'Content-Length': content.length}).end(content); return true; });
  await assert.rejects(bytesOf(`${address}/large`, {maxWhole: 1000}), {code: 10, message: /gives no parts/});
});

test('a file that changes while it is read is noticed', async () => {
  fresh();
  const bytes = await bytesOf(`${address}/large`);
  misbehave = (request, response, content) => { serveRange(request, response, content, '"two"'); return true; };
  await assert.rejects(bytes.read(500_000, 4), {code: 10, message: /changed/});
  misbehave = (request, response, content) => { response.writeHead(200).end(content); return true; };
  await assert.rejects(bytes.read(600_000, 4), {code: 10, message: /changed/});
});

test('a body cut short is an error, not wrong bytes', async () => {
  fresh();
  const bytes = await bytesOf(`${address}/large`);
  misbehave = (request, response, content) => {
    response.writeHead(206, {'Content-Range': `bytes 500000-500099/${content.length}`, 'Content-Length': 50});
    response.end(content.subarray(500_000, 500_050));
    return true;
  };
  await assert.rejects(bytes.read(500_000, 100), {code: 10, message: /100 bytes were asked for, 50 came/});
});

test('other bytes than those asked for are refused', async () => {
  fresh((request, response, content) => {
    response.writeHead(206, {'Content-Range': `bytes 7-106/${content.length}`, 'Content-Length': 100}).end(content.subarray(7, 107));
    return true;
  });
  await assert.rejects(bytesOf(`${address}/large`), {code: 10, message: /other bytes/});
});
