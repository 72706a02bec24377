// Soft shade where little light comes in: what lies around each pixel hides the sky from it. Out of depths alone, as "scalable
// ambient obscurance" does it (McGuire and others, 2012), at half the resolution; multiplied into the picture that is there.

import * as THREE from 'three';

import {OVERLAY} from './layers.js';

/** How far hides what, in radii of the mesh; samples a pixel; at most so far away on the screen, in pixels. */
const REACH = 0.16, SAMPLES = 14, MOST_PIXELS = 56;

const screen = 'varying vec2 place; void main() { place = position.xy * 0.5 + 0.5; gl_Position = vec4(position.xy, 0.0, 1.0); }';
const depths = `
  uniform highp sampler2D depths; uniform mat4 unproject; varying vec2 place;
  vec3 pointAt(vec2 at) {
    vec4 point = unproject * vec4(vec3(at, texture2D(depths, at).r) * 2.0 - 1.0, 1.0);
    return point.xyz / point.w;
  }`;

export class Occlusion {
  constructor() {
    this.scale = 0.5;
    this.target = new THREE.WebGLRenderTarget(1, 1, {depthTexture: new THREE.DepthTexture(1, 1, THREE.UnsignedIntType)});
    this.shade = new THREE.WebGLRenderTarget(1, 1, {format: THREE.RedFormat, depthBuffer: false});
    this.flat = new THREE.MeshBasicMaterial({side: THREE.DoubleSide, colorWrite: false});
    this.find = new THREE.ShaderMaterial({
      uniforms: {depths: {value: this.target.depthTexture}, unproject: {value: new THREE.Matrix4()}, texel: {value: new THREE.Vector2()},
        reach: {value: 1}, perPixel: {value: 1}},
      vertexShader: screen, depthTest: false, depthWrite: false,
      fragmentShader: `${depths}
        uniform vec2 texel; uniform float reach, perPixel;
        void main() {
          float depth = texture2D(depths, place).r;
          if (depth >= 1.0) { gl_FragColor = vec4(1.0); return; }
          vec3 here = pointAt(place);
          // The nearer neighbour of two is of the same surface.
          vec3 l = here - pointAt(place - vec2(texel.x, 0.0)), r = pointAt(place + vec2(texel.x, 0.0)) - here;
          vec3 d = here - pointAt(place - vec2(0.0, texel.y)), u = pointAt(place + vec2(0.0, texel.y)) - here;
          vec3 normal = normalize(cross(abs(l.z) < abs(r.z) ? l : r, abs(d.z) < abs(u.z) ? d : u));
          float pixels = min(reach * perPixel / -here.z, ${MOST_PIXELS}.0), sum = 0.0;
          float noise = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
          for (int i = 0; i < ${SAMPLES}; ++i) {
            float far = (float(i) + 0.5 * noise + 0.25) / ${SAMPLES}.0, angle = float(i) * 2.3999632 + 6.2831853 * noise;
            vec2 at = place + far * max(pixels, 2.0) * vec2(cos(angle), sin(angle)) * texel;
            vec3 away = pointAt(at) - here;
            float square = dot(away, away), near = max(0.0, 1.0 - square / (reach * reach));
            sum += near * near * max(0.0, dot(away, normal) * inversesqrt(square + 1e-12) - 0.12);
          }
          gl_FragColor = vec4(max(0.0, 1.0 - 2.5 * sum / ${SAMPLES}.0));
        }`,
    });
    this.apply = new THREE.ShaderMaterial({
      uniforms: {depths: this.find.uniforms.depths, unproject: this.find.uniforms.unproject, shade: {value: this.shade.texture},
        texel: this.find.uniforms.texel, reach: this.find.uniforms.reach, strength: {value: 1}},
      vertexShader: screen, depthTest: false, depthWrite: false, transparent: true,
      blending: THREE.CustomBlending, blendSrc: THREE.DstColorFactor, blendDst: THREE.ZeroFactor, blendSrcAlpha: THREE.ZeroFactor, blendDstAlpha: THREE.OneFactor,
      fragmentShader: `${depths}
        uniform sampler2D shade; uniform vec2 texel; uniform float reach, strength;
        void main() {
          if (texture2D(depths, place).r >= 1.0) discard;
          float here = pointAt(place).z, sum = 0.0, all = 0.0;
          for (int y = 0; y < 4; ++y) for (int x = 0; x < 4; ++x) {
            vec2 at = place + (vec2(float(x), float(y)) - 1.5) * texel;
            float weight = max(1e-3, 1.0 - abs(pointAt(at).z - here) / (0.25 * reach));
            sum += weight * texture2D(shade, at).r;
            all += weight;
          }
          gl_FragColor = vec4(vec3(mix(1.0, sum / all, strength)), 1.0);
        }`,
    });
    this.screen = new THREE.Mesh(new THREE.PlaneGeometry(2, 2));
    this.screen.frustumCulled = false;
    this.eye = new THREE.Camera();
  }

  /** Multiplies shade into what was drawn of a scene, in the renderer's viewport. @param {number} radius of the mesh */
  draw(renderer, scene, camera, radius, strength = 1) {
    const size = renderer.getDrawingBufferSize(new THREE.Vector2()).multiplyScalar(this.scale).ceil();
    if (size.x !== this.target.width || size.y !== this.target.height) {
      this.target.setSize(size.x, size.y);
      this.shade.setSize(size.x, size.y);
    }
    const {unproject, texel, reach, perPixel} = this.find.uniforms;
    unproject.value.copy(camera.projectionMatrixInverse);
    texel.value.set(1 / size.x, 1 / size.y);
    reach.value = REACH * radius;
    perPixel.value = 0.5 * size.y * camera.projectionMatrix.elements[5];
    this.apply.uniforms.strength.value = strength;
    const before = {background: scene.background, override: scene.overrideMaterial, autoClear: renderer.autoClear, planes: renderer.clippingPlanes};
    Object.assign(scene, {background: null, overrideMaterial: this.flat});
    camera.layers.disable(OVERLAY);
    renderer.autoClear = true;
    renderer.setRenderTarget(this.target);
    renderer.render(scene, camera);
    camera.layers.enable(OVERLAY);
    Object.assign(scene, {background: before.background, overrideMaterial: before.override});
    renderer.clippingPlanes = [];
    this.#pass(renderer, this.find, this.shade);
    renderer.autoClear = false;
    this.#pass(renderer, this.apply, null);
    Object.assign(renderer, {autoClear: before.autoClear, clippingPlanes: before.planes});
  }
  #pass(renderer, material, target) {
    this.screen.material = material;
    renderer.setRenderTarget(target);
    renderer.render(this.screen, this.eye);
  }
}
