/** Decodes a mesh to typed arrays as DRACOLoader of three.js does it; how many triangles it has. `data`: an Int8Array. */
export function decodeDraco(draco, data) {
  const decoder = new draco.Decoder(), mesh = new draco.Mesh();
  decoder.DecodeArrayToMesh(data, data.length, mesh);
  const faces = mesh.num_faces(), points = mesh.num_points(), indexBytes = faces * 12, index = draco._malloc(indexBytes);
  decoder.GetTrianglesUInt32Array(mesh, indexBytes, index);
  new Uint32Array(draco.HEAPF32.buffer, index, faces * 3).slice();
  draco._free(index);
  const attribute = decoder.GetAttribute(mesh, decoder.GetAttributeId(mesh, draco.POSITION));
  const positionBytes = points * 12, positions = draco._malloc(positionBytes);
  decoder.GetAttributeDataArrayForAllPoints(mesh, attribute, draco.DT_FLOAT32, positionBytes, positions);
  new Float32Array(draco.HEAPF32.buffer, positions, points * 3).slice();
  draco._free(positions);
  draco.destroy(mesh);
  draco.destroy(decoder);
  return faces;
}
