// What is seen as a part of the page's address, so that others see the same.

import * as THREE from 'three';

const find = id => document.getElementById(id);
const text = vector => vector.toArray().map(x => Number(x.toPrecision(7))).join();

/** The address of the page with this file and view. */
export function linkOf({cuts, navigation, settings, stage}, file) {
  const view = {eye: text(stage.camera.position), at: text(navigation.orbit.target), up: settings.up ?? 'y', colour: find('colour').value, colours: find('map').value, cut: cuts.text};
  const url = new URL(location.href);
  url.searchParams.set('file', file);
  url.hash = new URLSearchParams(Object.entries(view).filter(([, value]) => value !== '')).toString();
  return url.href;
}

/** Shows what the page's address tells of a view; what is not there, or makes no sense, stays as it is. */
export function followLink({cuts, navigation, settings}) {
  const view = new URLSearchParams(location.hash.slice(1)), has = (id, value) => [...find(id).options].some(option => option.value === value);
  if (['y', 'z'].includes(view.get('up'))) settings.setUp(view.get('up'));
  const [eye, at] = ['eye', 'at'].map(name => (view.get(name) ?? '').split(',').map(Number));
  if ([eye, at].every(place => place.length === 3 && place.every(Number.isFinite))) navigation.place(new THREE.Vector3(...eye), new THREE.Vector3(...at));
  if (has('map', view.get('colours'))) settings.setMap(view.get('colours'));
  if (has('colour', view.get('colour'))) settings.setColour(view.get('colour'));
  if (view.get('cut')) cuts.text = view.get('cut');
}
