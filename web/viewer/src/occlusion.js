// Soft shade where little light comes in: what lies around each pixel hides the sky from it. Out of depths alone, as "scalable
// ambient obscurance" does it (McGuire and others, 2012), at half the resolution; multiplied into the picture that is there, each
// pixel by the shade of what lies as deep as it does, so that outlines stay as they are.

import * as THREE from 'three';

import {OVERLAY} from './layers.js';

/** How far hides what, in radii of the mesh; samples a pixel; at most so far away on the screen, in pixels. */
const REACH = 0.16, SAMPLES = 14, MOST_PIXELS = 56;

const screen = 'varying vec2 place; void main() { place = position.xy * 0.5 + 0.5; gl_Position = vec4(position.xy, 0.0, 1.0); }';
const depths = `
  uniform highp sampler2D depths; uniform mat4 unproject; uniform vec2 texel; varying vec2 place;
  vec3 pointAt(vec2 at) {
    vec4 point = unproject * vec4(vec3(at, texture2D(depths, at).r) * 2.0 - 1.0, 1.0);
    return point.xyz / point.w;
  }`;

export class Occlusion {
  constructor() {
    this.target = new THREE.WebGLRenderTarget(1, 1, {depthTexture: new THREE.DepthTexture(1, 1, THREE.UnsignedIntType)});
    // How much light there is, and the depth at which, in two bytes.
    this.shade = new THREE.WebGLRenderTarget(1, 1, {depthBuffer: false, magFilter: THREE.NearestFilter, minFilter: THREE.NearestFilter});
    this.flat = new THREE.MeshBasicMaterial({side: THREE.DoubleSide, colorWrite: false});
    this.find = new THREE.ShaderMaterial({
      uniforms: {depths: {value: this.target.depthTexture}, unproject: {value: new THREE.Matrix4()}, texel: {value: new THREE.Vector2()},
        reach: {value: 1}, perPixel: {value: 1}},
      vertexShader: screen, depthTest: false, depthWrite: false,
      fragmentShader: `${depths}
        uniform float reach, perPixel;
        void main() {
          vec2 first = place - 0.25 * texel;  // of the four pixels of this texel
          float depth = texture2D(depths, first).r;
          if (depth >= 1.0) { gl_FragColor = vec4(1.0); return; }
          vec3 here = pointAt(first);
          // The nearer neighbour of two is of the same surface.
          vec3 l = here - pointAt(first - vec2(texel.x, 0.0)), r = pointAt(first + vec2(texel.x, 0.0)) - here;
          vec3 d = here - pointAt(first - vec2(0.0, texel.y)), u = pointAt(first + vec2(0.0, texel.y)) - here;
          vec3 normal = normalize(cross(abs(l.z) < abs(r.z) ? l : r, abs(d.z) < abs(u.z) ? d : u));
          float pixels = min(reach * perPixel / -here.z, ${MOST_PIXELS}.0), sum = 0.0;
          float noise = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
          for (int i = 0; i < ${SAMPLES}; ++i) {
            float far = (float(i) + 0.5 * noise + 0.25) / ${SAMPLES}.0, angle = float(i) * 2.3999632 + 6.2831853 * noise;
            vec2 at = first + far * max(pixels, 2.0) * vec2(cos(angle), sin(angle)) * texel;
            vec3 away = pointAt(at) - here;
            float square = dot(away, away), near = max(0.0, 1.0 - square / (reach * reach));
            sum += near * near * max(0.0, dot(away, normal) * inversesqrt(square + 1e-12) - 0.12);
          }
          gl_FragColor = vec4(max(0.0, 1.0 - 2.5 * sum / ${SAMPLES}.0), floor(depth * 255.0) / 255.0, fract(depth * 255.0), 1.0);
        }`,
    });
    this.apply = new THREE.ShaderMaterial({
      uniforms: {depths: this.find.uniforms.depths, unproject: this.find.uniforms.unproject, shade: {value: this.shade.texture},
        texel: this.find.uniforms.texel, reach: this.find.uniforms.reach, strength: {value: 1}},
      vertexShader: screen, depthTest: false, depthWrite: false, transparent: true,
      blending: THREE.CustomBlending, blendSrc: THREE.DstColorFactor, blendDst: THREE.ZeroFactor, blendSrcAlpha: THREE.ZeroFactor, blendDstAlpha: THREE.OneFactor,
      fragmentShader: `${depths}
        uniform sampler2D shade; uniform float reach, strength;
        float zOf(float depth) {
          float z = depth * 2.0 - 1.0;
          return (unproject[2][2] * z + unproject[3][2]) / (unproject[2][3] * z + unproject[3][3]);
        }
        void main() {
          float depth = texture2D(depths, place).r, sum = 0.0, all = 0.0;
          if (depth >= 1.0) discard;
          float here = zOf(depth);
          vec2 middle = (floor(place / texel - 0.5) + 0.5) * texel;
          // A box of four texels, wherever it begins: then the noise of find, of about that period, is gone.
          for (int y = -2; y < 4; ++y) for (int x = -2; x < 4; ++x) {
            vec2 at = middle + vec2(float(x), float(y)) * texel, share = clamp(2.5 - abs(at - place) / texel, 0.0, 1.0);
            vec4 there = texture2D(shade, at);
            float weight = share.x * share.y * max(1e-4, 1.0 - abs(zOf(there.g + there.b / 255.0) - here) / (0.1 * reach));
            sum += weight * there.r;
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
    const whole = renderer.getDrawingBufferSize(new THREE.Vector2()), size = whole.clone().multiplyScalar(0.5).ceil();
    if (whole.x !== this.target.width || whole.y !== this.target.height) {
      this.target.setSize(whole.x, whole.y);
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
