// Compiled only.
import {MailleLoader, MailleObject, toGeometry, toInstances} from 'maille/three';
import {decode, MeshFile} from 'maille';
import * as THREE from 'three';

export async function calls(scene: THREE.Scene, camera: THREE.PerspectiveCamera, renderer: THREE.WebGLRenderer): Promise<void> {
  const loader = new MailleLoader().setDecoderPath('/libs/').setWorkerLimit(4).preload();
  const geometry: THREE.BufferGeometry = await loader.loadAsync('bunny.maille', event => console.log(event.loaded));
  scene.add(new THREE.Mesh(geometry));
  const scan = await MailleObject.open('scan.maille', {errorTarget: 1.5, maxBytes: 5e8, workers: 2});
  scene.add(scan);
  const whole: boolean = scan.update(camera, renderer);
  const hit = await scan.pick(new THREE.Raycaster());
  console.log(whole, hit?.distance, toGeometry(await decode('x.maille', {drawn: true})));
  const file = await MeshFile.open('scene.maille');
  scene.add(toInstances(geometry, await file.readInstances(), new THREE.MeshStandardMaterial()));
  scan.dispose();
}
