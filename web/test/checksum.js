// The CRC-32 of a mesh as mesh_checksums.cc takes it.

const table = Uint32Array.from({length: 256}, (_, byte) => {
  for (let k = 0; k < 8; ++k) byte = byte & 1 ? 0xedb88320 ^ (byte >>> 1) : byte >>> 1;
  return byte;
});

export function checksumOf(mesh) {
  let crc = 0xffffffff;
  const add = values => {
    for (const byte of new Uint8Array(values.buffer, values.byteOffset, values.byteLength)) crc = table[(crc ^ byte) & 255] ^ (crc >>> 8);
  };
  add(mesh.positions);
  for (const block of mesh.blocks) {
    add(block.types);
    add(BigUint64Array.from(block.offsets, BigInt));
    add(block.connectivity);
  }
  for (const array of mesh.arrays) add(array.values);
  return ((crc ^ 0xffffffff) >>> 0).toString(16).padStart(8, '0');
}
