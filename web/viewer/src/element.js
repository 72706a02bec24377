// <maille-viewer src="scan.maille" alt="A scan of ...">: a mesh of any size in somebody's page. docs/viewer.md has its attributes.

import {Colouring, maps} from './colouring.js';
import {openModel} from './models.js';
import {Navigation} from './navigation.js';
import {Stage} from './stage.js';
import {sentence} from './text.js';

const HTML = `
<style>
  :host { display: block; position: relative; width: 100%; height: 400px; overflow: hidden; font: 14px/1.4 system-ui, sans-serif; color: #e7eaee; }
  :host([hidden]) { display: none; }
  :host([theme="light"]), :host([theme="none"]) { color: #1c2128; }
  canvas { width: 100%; height: 100%; display: block; outline: none; touch-action: none; cursor: grab; }
  canvas:active { cursor: grabbing; }
  canvas:focus-visible { box-shadow: inset 0 0 0 3px #58a6ff; }
  .bar { position: absolute; inset: 0 0 auto; height: 3px; pointer-events: none; }
  .bar i { display: block; height: 100%; width: 0; background: #58a6ff; transition: width .15s; }
  .says { position: absolute; inset: auto 12px 12px; margin: 0; text-align: center; pointer-events: none; overflow-wrap: anywhere; }
  .says:empty { display: none; }
  button { position: absolute; right: 8px; bottom: 8px; width: 34px; height: 34px; padding: 7px; border: 0; border-radius: 8px; background: rgb(128 138 150 / 22%); color: inherit; cursor: pointer; opacity: .75; }
  button:hover, button:focus-visible { opacity: 1; }
  svg { display: block; fill: none; stroke: currentcolor; stroke-width: 2; }
</style>
<canvas tabindex="0" role="img"></canvas>
<div class="bar" role="progressbar" aria-label="Loading" hidden><i></i></div>
<p class="says" role="status"></p>
<button type="button" aria-label="Full screen"><svg viewBox="0 0 24 24" aria-hidden="true"><path d="M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5"/></svg></button>`;

const KEYS = 'Arrow keys turn it, with Shift they move it; plus and minus come nearer; Home shows all of it.';
/** Radians a second. */
const TURNING = 0.5;

/** Events: 'load' {detail: {about}}, 'progress' {detail: {loaded, total}}, 'error' {detail: {message}}. */
export class MailleViewer extends HTMLElement {
  static observedAttributes = ['src', 'alt', 'colour', 'colours', 'theme', 'up', 'error', 'ground'];

  connectedCallback() {
    if (this.stage) return;
    const root = this.shadowRoot ?? this.attachShadow({mode: 'open'});
    root.innerHTML = HTML;
    this.parts = {canvas: root.querySelector('canvas'), bar: root.querySelector('.bar'), says: root.querySelector('.says')};
    root.querySelector('button').onclick = () => (document.fullscreenElement ? document.exitFullscreen() : this.requestFullscreen()).catch(() => {});
    this.parts.canvas.addEventListener('keydown', event => this.#key(event));
    try {
      this.#begin();
    } catch (error) {
      return this.#fail(/webgl/i.test(error.message) ? new Error('This browser has no WebGL 2, which drawing needs.') : error);
    }
    for (const name of MailleViewer.observedAttributes) if (name !== 'src' && this.hasAttribute(name)) this.attributeChangedCallback(name, null, this.getAttribute(name));
    // What is far below in a page is not fetched yet.
    this.seen = new IntersectionObserver(entries => {
      if (!entries.some(entry => entry.isIntersecting)) return;
      this.seen.disconnect();
      this.inSight = true;
      if (this.hasAttribute('src') && !this.model) this.open(this.getAttribute('src'));
    });
    this.seen.observe(this);
  }
  disconnectedCallback() {
    // Moved to another place of the page: what is there goes on.
    queueMicrotask(() => {
      if (this.isConnected || !this.stage) return;
      this.opening?.abort();
      this.seen.disconnect();
      this.model?.dispose();
      this.stage.dispose();
      this.stage.renderer.forceContextLoss();
      this.stage = this.model = this.inSight = null;
    });
  }
  #begin() {
    this.stage = new Stage(this.parts.canvas);
    this.stage.groundShown = true;
    this.navigation = new Navigation(this.stage);
    this.navigation.orbit.enablePan = true;
    this.colouring = new Colouring();
    this.stage.addEventListener('frame', ({detail}) => this.#frame(detail.time));
    this.stage.addEventListener('resize', () => this.#fitAgain());
    this.#describe();
  }

  attributeChangedCallback(name, before, value) {
    if (!this.stage || before === value) return;
    if (name === 'src' && this.inSight && value !== null) this.open(value);
    else if (name === 'alt') this.#describe();
    else if (name === 'colour' && this.model) this.#colour();
    else if (name === 'colours' && maps[value]) this.colouring.setMap(value);
    else if (name === 'theme') this.stage.setTheme(value === 'none' ? null : value === 'light' ? 'light' : 'dark');
    else if (name === 'ground') this.stage.groundShown = value !== 'off';
    else if (name === 'up' && (value === 'y' || value === 'z')) {
      this.navigation.setUp(value);
      this.fit();
    }
    if (name === 'error') this.#target();
    this.stage.touch();
  }

  /** Shows another mesh. @param input an address, File or ArrayBuffer; resolves to whether it could be opened */
  async open(input) {
    this.opening?.abort();
    const {signal} = this.opening = new AbortController(), bar = this.parts.bar;
    this.parts.says.textContent = '';
    bar.hidden = false;
    try {
      const bytes = (loaded, total) => {
        bar.firstElementChild.style.width = `${total > 0 ? Math.min(100, 100 * loaded / total) : 5}%`;
        this.#tell('progress', {loaded, total});
      };
      const model = await openModel(typeof input === 'string' ? new URL(input, document.baseURI).href : input, {bytes}, signal);
      if (signal.aborted) {
        model.dispose();
        return false;
      }
      this.#show(model);
      return true;
    } catch (error) {
      if (!signal.aborted) this.#fail(error);
      return false;
    } finally {
      if (this.opening?.signal === signal) bar.hidden = true;
    }
  }
  #show(model) {
    const {stage} = this;
    this.model?.dispose();
    this.model = model;
    stage.scene.add(model.object);
    stage.setSphere(model.sphere);
    stage.setReflecting(Boolean(model.reflects));
    stage.setGround(() => model.shownBox ?? model.box);
    this.#target();
    this.colouring.setFlat(model.flat ?? false);
    this.colouring.offerMaterials(null);
    this.#colour();
    this.shown = null;
    this.fit();
    model.onChange = () => stage.touchGround();
    model.object.addEventListener('chart', ({mesh}) => this.colouring.apply(mesh));
    model.object.addEventListener('error', ({error}) => this.#tell('error', {message: sentence(error)}));
    Promise.resolve(model.materials).then(materials => {
      if (!materials || this.model !== model) return;
      this.colouring.offerMaterials(materials);
      model.materialsByName = materials;
      this.#colour();
    });
    this.#describe();
    this.#tell('load', {about: model.about});
  }
  /** What the attribute says: the name of an array; else what suits the mesh. */
  #colour() {
    const {model} = this, fields = [...model.fields.values()], wanted = this.getAttribute('colour');
    const field = fields.find(({key, name}) => key === wanted || name === wanted);
    const own = fields.some(({role, domain}) => role === 'colour' && domain === 'point');
    const measured = model.file.mode === 'stream' ? fields.find(({type, role}) => type[0] === 'f' && role !== 'normal') : null;
    const mode = field?.key ?? (wanted === 'none' ? 'plain' : model.materialsByName ? 'materials' : own ? 'own' : measured?.key ?? 'plain');
    model.setField?.(model.fields.get(mode) ?? null);
    this.colouring.set(model, mode);
    this.stage.shadeStrength = this.colouring.field ? 0.5 : 1;
    this.stage.touch();
  }
  #target() {
    const pixels = Number(this.getAttribute('error'));
    if (this.model?.refines) this.model.object.errorTarget = pixels > 0 ? pixels : 0.75;
  }

  /** Shows all of it again. */
  fit() {
    const {model, navigation, stage} = this;
    if (!model) return;
    navigation.fit(model, navigation.firstDirection);
    this.fitted = stage.camera.position.clone();
  }
  #fitAgain() {
    if (this.fitted && this.stage.camera.position.equals(this.fitted)) this.fit();
  }
  /** A picture of what is seen: a Blob. */
  toBlob(type = 'image/png') {
    this.stage.draw();
    return new Promise(resolve => this.parts.canvas.toBlob(resolve, type));
  }
  /** Is all there that this view needs? */
  get settled() {
    return Boolean(this.model && this.done);
  }

  #frame(time) {
    const {model, stage} = this, seconds = Math.min(0.1, (time - (this.last ?? time)) / 1000);
    this.last = time;
    if (!model) return;
    const still = matchMedia('(prefers-reduced-motion: reduce)').matches || this.shadowRoot.activeElement;
    if (this.hasAttribute('auto-rotate') && !still) this.navigation.turn(TURNING * seconds, 0);
    this.done = model.update(stage.camera, stage.renderer);
    if (!model.refines || model.object.shown === this.shown) return;
    const first = !this.shown?.size && model.object.shown.size > 0;
    this.shown = model.object.shown;
    if (first) this.#fitAgain();
    stage.touchGround();
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || !this.model) return;
    const {navigation} = this, step = 0.1;
    const arrow = {ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step]}[event.key];
    if (arrow) event.shiftKey ? navigation.move(-arrow[0], arrow[1]) : navigation.turn(...arrow);
    else if (event.key === '+') navigation.approach(0.85);
    else if (event.key === '-') navigation.approach(1 / 0.85);
    else if (event.key === 'Home') this.fit();
    else return;
    event.preventDefault();
  }

  #describe() {
    const alt = this.getAttribute('alt') ?? 'A mesh in three dimensions';
    this.parts.canvas.setAttribute('aria-label', `${alt.replace(/[.\s]+$/, '')}. ${this.model ? `${this.model.about}. ` : ''}${KEYS}`);
  }
  #fail(error) {
    this.parts.says.textContent = sentence(error);
    this.#tell('error', {message: sentence(error)});
  }
  #tell(name, detail) {
    this.dispatchEvent(new CustomEvent(name, {detail}));
  }
}

if (!customElements.get('maille-viewer')) customElements.define('maille-viewer', MailleViewer);
