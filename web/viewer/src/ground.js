// A soft shadow on the ground below a mesh: how near each place of the ground is to what stands above it, blurred.

import * as THREE from 'three';

import {OVERLAY} from './layers.js';

const SIZE = 256;
/** The ground reaches so far beyond the mesh, in its widths; what is higher than this share of them casts no shadow. */
const MARGIN = 0.35, HEIGHT = 0.45;

const screen = 'varying vec2 place; void main() { place = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }';

export class Ground {
  constructor(scene) {
    const target = () => new THREE.WebGLRenderTarget(SIZE, SIZE, {depthBuffer: true});
    this.targets = [target(), target()];
    this.camera = new THREE.OrthographicCamera();
    this.near = new THREE.ShaderMaterial({
      side: THREE.DoubleSide, clipping: true, blending: THREE.NoBlending,
      vertexShader: `#include <clipping_planes_pars_vertex>
        varying float height;
        void main() {
          vec4 mvPosition = modelViewMatrix * vec4(position, 1.0);
          #include <clipping_planes_vertex>
          gl_Position = projectionMatrix * mvPosition;
          height = 0.5 + 0.5 * gl_Position.z;
        }`,
      fragmentShader: `#include <clipping_planes_pars_fragment>
        varying float height;
        void main() {
          #include <clipping_planes_fragment>
          float near = 1.0 - clamp(height, 0.0, 1.0);
          gl_FragColor = vec4(vec3(0.0), near * near);
        }`,
    });
    this.blur = new THREE.ShaderMaterial({
      uniforms: {picture: {value: null}, step: {value: new THREE.Vector2()}}, vertexShader: screen, depthTest: false, depthWrite: false, blending: THREE.NoBlending,
      fragmentShader: `uniform sampler2D picture; uniform vec2 step; varying vec2 place;
        void main() {
          float sum = 0.0, all = 0.0;
          for (int i = -7; i <= 7; ++i) {
            float weight = exp(-float(i * i) / 18.0);
            sum += weight * texture2D(picture, place + float(i) * step).a;
            all += weight;
          }
          gl_FragColor = vec4(vec3(0.0), sum / all);
        }`,
    });
    this.screen = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), this.blur);
    this.screen.frustumCulled = false;
    this.plane = new THREE.Mesh(new THREE.PlaneGeometry(1, 1), new THREE.MeshBasicMaterial({
      map: this.targets[0].texture, transparent: true, depthWrite: false, toneMapped: false, opacity: 0.7, side: THREE.DoubleSide}));
    this.plane.layers.set(OVERLAY);
    this.plane.renderOrder = -1;
    this.plane.visible = false;
    scene.add(this.plane);
  }

  /**
   * Casts the shadow of what a scene shows anew.
   * @param {THREE.Box3} box around it
   * @param {THREE.Vector3} up of the world: an axis
   */
  cast(renderer, scene, box, up) {
    const size = box.getSize(new THREE.Vector3()), centre = box.getCenter(new THREE.Vector3()), tall = Math.abs(size.dot(up));
    const across = size.clone().sub(up.clone().multiply(size)), wide = Math.max(across.length(), 1e-30), side = (1 + 2 * MARGIN) * wide;
    const floor = centre.clone().addScaledVector(up, -0.5 * tall - 1e-3 * wide);
    // From below, with the top of the picture where that of the plane will be.
    const {camera, plane} = this, top = Math.abs(up.z) === 1 ? new THREE.Vector3(0, 1, 0) : new THREE.Vector3(0, 0, -1);
    Object.assign(camera, {left: -side / 2, right: side / 2, top: side / 2, bottom: -side / 2, near: 0, far: HEIGHT * wide});
    camera.position.copy(floor);
    camera.up.copy(top);
    camera.lookAt(floor.clone().add(up));
    camera.updateProjectionMatrix();
    plane.position.copy(floor);
    plane.up.copy(top);
    plane.quaternion.copy(camera.quaternion).multiply(new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(0, 1, 0), Math.PI));
    // Looking up, the picture is the mirror of what is seen from above.
    plane.scale.set(-side, side, 1);
    this.#draw(renderer, scene);
  }
  #draw(renderer, scene) {
    const before = {background: scene.background, autoClear: renderer.autoClear, alpha: renderer.getClearAlpha(), planes: renderer.clippingPlanes};
    const shown = this.plane.visible;
    Object.assign(scene, {background: null, overrideMaterial: this.near});
    this.plane.visible = false;
    renderer.autoClear = true;
    renderer.setClearAlpha(0);
    renderer.setRenderTarget(this.targets[0]);
    renderer.render(scene, this.camera);
    Object.assign(scene, {background: before.background, overrideMaterial: null});
    renderer.clippingPlanes = [];
    for (const [wide, k] of [[1.6, 0], [1.6, 1], [0.7, 0], [0.7, 1]]) {
      this.blur.uniforms.picture.value = this.targets[k].texture;
      this.blur.uniforms.step.value.set(k === 0 ? wide / SIZE : 0, k === 0 ? 0 : wide / SIZE);
      renderer.setRenderTarget(this.targets[1 - k]);
      renderer.render(this.screen, this.camera);
    }
    renderer.setRenderTarget(null);
    renderer.setClearAlpha(before.alpha);
    Object.assign(renderer, {autoClear: before.autoClear, clippingPlanes: before.planes});
    this.plane.visible = shown;
  }

  show(on) {
    this.plane.visible = on;
  }
}
