// Colours and pictures of materials, where a file names them and they lie beside it: the library of an OBJ file (mtllib), or the
// picture of a PLY file (TextureFile).

import * as THREE from 'three';

import {beside, parseLibrary} from './material_library.js';

/** Longer texts are no library of materials. */
const MOST_TEXT = 4e6;

/**
 * @param {string[][]} metadata keys and values of the file
 * @param {URL | null} address of the file; null: nothing lies beside it
 * @returns a Map of THREE materials by name, '' for what has none; null: the file names none
 */
export async function readMaterials(metadata, address) {
  const picture = metadata.map(([key, value]) => (key === 'TextureFile' ? value : /^TextureFile (.+)$/.exec(value)?.[1])).find(Boolean);
  if (picture) return withPictures(new Map([['', {picture: beside(picture, address)}]]));
  const library = metadata.find(([key]) => key === 'mtllib')?.[1], url = library && beside(library, address);
  if (!url) return null;
  const response = await fetch(url);
  if (!response.ok) return null;
  const text = await response.text();
  if (text.length > MOST_TEXT) return null;
  const described = parseLibrary(text);
  for (const one of described.values()) one.picture &&= beside(one.picture, url);
  return withPictures(described);
}

/** Of what has neither a colour nor a picture that could be read there is no material. */
async function withPictures(described) {
  const made = new Map();
  await Promise.all([...described].map(async ([name, {colour, opacity, picture}]) => {
    const texture = picture ? await new THREE.TextureLoader().loadAsync(picture.href).catch(() => null) : null;
    if (colour || texture) made.set(name, materialOf({colour, opacity, texture}));
  }));
  if (made.size === 1) made.set('', [...made.values()][0]);
  return made.size > 0 ? made : null;
}

function materialOf({colour, opacity = 1, texture}) {
  const material = new THREE.MeshStandardMaterial({roughness: 0.62, metalness: 0, side: THREE.DoubleSide, map: texture});
  // Many libraries are black beside their pictures.
  if (colour && !(texture && colour.every(x => x < 0.02))) material.color.setRGB(...colour, THREE.SRGBColorSpace);
  if (opacity < 1) Object.assign(material, {opacity: Math.max(0.05, opacity), transparent: true});
  if (texture) Object.assign(texture, {colorSpace: THREE.SRGBColorSpace, wrapS: THREE.RepeatWrapping, wrapT: THREE.RepeatWrapping, anisotropy: 4});
  return material;
}
