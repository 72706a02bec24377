// The page: opens files, and lets parts of it know of each other. `window.viewer` is there for programs and tests.

import * as THREE from 'three';

import {Colouring, legendOf} from './colouring.js';
import {Compare} from './compare.js';
import {CutList} from './cuts.js';
import {Gauges} from './gauges.js';
import {Measure} from './measure.js';
import {openModel} from './models.js';
import {Navigation} from './navigation.js';
import {clearMessages, saveAs, showLegend, showProgress, showStatistics, tell} from './page.js';
import {Picking} from './picking.js';
import {Region} from './region.js';
import {Settings} from './settings.js';
import {Spheres} from './spheres.js';
import {Stage} from './stage.js';
import {bytesText, count, counted, rateText, sentence} from './text.js';
import {Timeline} from './timeline.js';
import {followLink, linkOf} from './view_link.js';

const find = id => document.getElementById(id);

class Viewer {
  constructor() {
    const canvas = find('canvas');
    this.stage = new Stage(canvas);
    this.navigation = new Navigation(this.stage);
    this.colouring = new Colouring();
    this.picking = new Picking(this.stage, find('picked'));
    this.region = new Region(this.stage, find('region'), find('rectangle'), tell);
    this.spheres = new Spheres(this.stage.scene);
    this.model = null;
    this.done = false;
    this.timeline = new Timeline(() => this.#valuesChanged());
    this.measure = new Measure(this.stage, find('distance'));
    this.gauges = new Gauges(this.stage, find('axes'), find('scale'), direction => this.fit(direction));
    this.cuts = new CutList(planes => this.#setCuts(planes));
    this.compare = new Compare(this);
    this.settings = new Settings(this);
    this.stage.addEventListener('frame', () => this.#frame());
    setInterval(() => this.#tellState(), 250);
    this.#pointers(canvas);
    this.#files();
    addEventListener('resize', () => this.layOut());
    canvas.addEventListener('webglcontextlost', event => {
      event.preventDefault();
      tell('The graphics card took back its memory; the picture comes again when it can.', true);
    });
    canvas.addEventListener('webglcontextrestored', () => this.stage.renew());
  }

  /** @param input an address, File or ArrayBuffer; resolves to whether it could be opened */
  async open(input) {
    if (this.wantsBeside) return this.#openBeside(input);
    this.opening?.abort();
    const opening = this.opening = Object.assign(new AbortController(), {busy: true}), name = nameOf(input);
    clearMessages();
    find('start').hidden = true;
    showProgress(NaN, `Opening ${name}`);
    let opened = false;
    const bytes = (fetched, size) => {
      if (opened || opening.signal.aborted || size === 0) return;
      showProgress(fetched < size ? fetched / size : NaN, fetched < size ? `${name}: ${bytesText(fetched)} of ${bytesText(size)}` : `Decoding ${name}`);
    };
    try {
      const model = await openModel(input, {bytes}, opening.signal);
      if (opening.signal.aborted) return model.dispose();
      this.input = input;
      this.#show(model, name);
      this.address = typeof input === 'string' ? input : null;
      return true;
    } catch (error) {
      if (opening.signal.aborted) return false;
      tell(sentence(error), true, {text: 'Try again', run: () => this.open(input)});
      if (!this.model) this.showStart();
      return false;
    } finally {
      opened = true;
      opening.busy = false;
      if (this.opening === opening) showProgress(null);
    }
  }

  #show(model, name) {
    this.compare.close();
    this.model?.dispose();
    this.picking.show(null);
    this.region.setBox(null, null);
    this.measure.clear();
    this.model = model;
    this.failures = 0;
    this.shownSince = null;
    this.lastShown = null;
    this.knownFields = model.fields.size;
    document.title = `${name} · maille`;
    document.body.classList.toggle('is-random', model.refines);
    document.body.classList.add('has-model');
    find('file-name').textContent = name;
    find('file-about').textContent = model.about;
    find('file-about').title = model.about;
    this.stage.scene.add(model.object);
    this.stage.setSphere(model.sphere);
    this.stage.setReflecting(Boolean(model.reflects));
    this.stage.setGround(() => model.shownBox ?? model.box);
    this.cuts.offer(model, this.stage.sphere, () => this.stage.camera.getWorldDirection(new THREE.Vector3()));
    this.colouring.offerMaterials(null);
    this.settings.offer(model);
    this.settings.setColour(find('colour').value);
    this.settings.suitFlat(model.flat ?? false);
    this.settings.suitGround(model.file.mode !== 'stream');
    this.#offerMaterials(model);
    find('pane-names').children[0].textContent = name;
    this.setTarget(this.target);
    this.setSpheres(find('spheres').checked);
    this.layOut();
    this.fit(this.navigation.firstDirection);
    model.onChange = () => this.stage.touchGround();
    model.onLimit = left => tell(`${counted(left, 'piece')} of this volume ${left === 1 ? 'is' : 'are'} shown as boxes with mean values: its surface is more than a page reads. Cut it open to see what is inside.`);
    model.object.addEventListener('chart', ({mesh}) => this.#arrived(mesh));
    model.object.addEventListener('error', ({error}) => this.#failed(error));
    this.#tellWhatIsMissing();
    this.timeline.offer(model);
  }
  #tellWhatIsMissing() {
    const {model} = this, faces = model.refines ? model.file.levels[0]?.faces ?? 0 : model.triangles;
    if (faces === 0 && !model.volume) tell('This mesh has no faces. Points and lines are not drawn.', true);
    if (model.undrawable > 0) tell(`${counted(model.undrawable, 'triangle')} not drawn: the numbers of their corners are not finite.`, true);
    if (model.missing > 0) tell(`${counted(model.missing, 'picture')} of this scene could not be read.`, true);
  }

  /** Pictures come later than the mesh. */
  async #offerMaterials(model) {
    const materials = await model.materials;
    if (!materials || this.model !== model) return;
    model.materialsByName = materials;
    this.colouring.offerMaterials(materials);
    this.settings.offer(model);
    this.settings.setColour(find('colour').value);
  }
  #arrived(mesh) {
    this.#offerNewFields();
    this.colouring.apply(mesh);
  }
  #offerNewFields() {
    if (this.knownFields === this.model.fields.size) return;
    this.knownFields = this.model.fields.size;
    this.settings.offer(this.model);
    this.settings.setColour(find('colour').value);
  }
  /** Another step of time. Colours stay comparable: their range is that of all steps seen so far. */
  #valuesChanged() {
    this.#offerNewFields();
    for (const mesh of this.model.meshes) this.colouring.apply(mesh);
    const {last} = this.picking;  // a face of this model
    if (last) this.picking.show({...last, values: this.model.valuesAt(last)});
    this.stage.touch();
  }
  #failed(error) {
    ++this.failures;
    const place = this.model.volume || !this.model.refines ? '' : this.failures === 1 ? 'This place stays coarse.' : `${this.failures} places stay coarse.`;
    tell(`${sentence(error)} ${place}`, true, {text: 'Try again', run: () => {
      this.failures = 0;
      this.model.object.retry();
    }}, 'failures');
  }

  fit(direction = null) {
    const {model} = this;
    if (!model) return;
    this.navigation.fit(model, direction);
    this.fitted = this.stage.camera.position.clone();
  }
  /** What is free of the picture: not covered by bars and the panel. */
  layOut() {
    const narrow = matchMedia('(max-width: 760px)').matches, panel = find('panel').getBoundingClientRect(), covers = panel.width > 0;
    const bottom = narrow && covers ? innerHeight - panel.top : 76;
    this.stage.setInsets({left: 0, top: narrow ? 66 : 8, right: !narrow && covers ? innerWidth - panel.left : 0, bottom});
    if (this.model && this.fitted && this.stage.camera.position.equals(this.fitted)) this.fit();
  }
  async fullScreen() {
    try {
      if (document.fullscreenElement) await document.exitFullscreen();
      else await document.documentElement.requestFullscreen();
    } catch {
      tell('This browser shows no page on the full screen.', true);
    }
  }
  setTarget(pixels) {
    this.target = Math.min(32, Math.max(0.25, pixels));
    if (this.model?.refines) this.model.object.errorTarget = this.target;
  }
  setUp(axis) {
    this.navigation.setUp(axis);
    this.fit(this.navigation.firstDirection);
  }
  /** Shade where little light comes in. */
  setShade(on) {
    this.stage.shades = on;
    this.stage.touch();
  }
  setGround(on) {
    this.stage.groundShown = on;
    this.stage.touchGround();
  }
  setFrozen(on) {
    this.frozen = on;
  }
  setSpheres(on) {
    this.spheres.show(on && this.model?.refines ? this.model : null);
    this.showsSpheres = on;
  }
  /** @param {THREE.Plane[]} planes what lies before all of them is seen; of volumes the cuts are shown */
  #setCuts(planes) {
    this.stage.setClips(planes);
    this.model?.setCuts?.(planes);
    this.compare.model?.setCuts?.(planes);
  }
  /** @param {string} what '': nothing; a level; 'file': the next one that is opened */
  async showBeside(what) {
    if (what === '') return this.compare.close();
    if (what === 'file') {
      this.wantsBeside = true;
      return this.showStart();
    }
    try {
      await this.compare.open(this.input, Number(what) === 0 ? 'the mesh itself' : `level ${what}`, Number(what));
    } catch (error) {
      tell(sentence(error), true);
    }
  }
  async #openBeside(input) {
    this.wantsBeside = false;
    find('start').hidden = true;
    try {
      await this.compare.open(input, nameOf(input));
      return true;
    } catch (error) {
      tell(sentence(error), true);
      find('beside').value = '';
      return false;
    }
  }
  setColour(key, component) {
    this.model?.setField?.(this.model.fields.get(key) ?? null);
    if (!this.model) return;
    this.colouring.set(this.model, key, component);
    for (const mesh of this.compare.model?.meshes ?? []) this.colouring.apply(mesh);
    // Values are to be read: less shade falls on them.
    this.stage.shadeStrength = this.colouring.field ? 0.5 : 1;
    this.stage.touch();
  }
  setMap(name) {
    this.colouring.setMap(name);
    this.stage.touch();
  }
  savePicture() {
    const {stage, stage: {canvas}} = this;
    // What was drawn before is no longer there.
    stage.draw();
    canvas.toBlob(blob => saveAs(blob, `${find('file-name').textContent.replace(/(\.maille)?(\.gl(b|tf))?$/, '')}.png`));
  }
  async copyLink() {
    if (!this.address) return tell('A file of this device has no address that others could open.');
    const link = linkOf(this, this.address);
    try {
      await navigator.clipboard.writeText(link);
      tell('The address of this view is copied.');
    } catch {
      history.replaceState(null, '', link);  // pages without a clipboard
      tell('The address of this view is now that of the page.');
    }
    return link;
  }
  escape() {
    if (!find('start').hidden) find('start').hidden = this.model !== null;
    this.wantsBeside = false;
    if (!this.compare.model) find('beside').value = '';
    this.picking.show(null);
    this.measure.clear();
    this.region.setBox(null, null);
    this.settings.setTool('orbit');
  }
  showStart() {
    find('start').hidden = false;
    find('start-close').hidden = this.model === null;
    // A keyboard of glass would cover it.
    if (!matchMedia('(pointer: coarse)').matches) find('address').focus();
  }

  #frame() {
    const {model, stage, gauges, navigation} = this;
    gauges.target.copy(navigation.orbit.target);
    gauges.flying = navigation.flying;
    if (!model) return;
    const other = this.compare.update(stage);
    if (!(this.frozen && model.refines)) this.done = model.update(stage.camera, stage.renderer) && other;
    if (!model.refines) return;
    const {shown} = model.object;
    if (shown === this.lastShown) return;
    this.lastShown = shown;
    // Now it is known how large it is, and nobody has seen it yet.
    if (this.shownSince === null && shown.size > 0) {
      this.shownSince = performance.now();
      if (stage.camera.position.equals(this.fitted)) this.fit(navigation.firstDirection);
    }
    if (this.showsSpheres) this.spheres.show(model);
    stage.touchGround();
  }

  #tellState() {
    const {model} = this;
    if (!model) return;
    showLegend(legendOf(this.colouring, model));
    const rows = [['Triangles', count(model.triangles)], ...model.rows ?? []];
    if (!this.opening?.busy) showProgress(model.progress ?? null);
    if (model.refines) {
      const {object} = model;
      rows.push(['Charts shown', `${object.shown.size} of ${object.charts.size} here`],
        ['Error seen', Number.isFinite(object.error) ? `${object.error.toFixed(2)} px` : '…'],
        ['In memory', bytesText(object.heldBytes)]);
    }
    const {fetched} = model.count, share = Math.min(100, Math.round(100 * fetched / model.file.size));
    rows.push(['Fetched', fetched > 0 ? `${bytesText(fetched)}, ${share} %` : 'from this device']);
    if (model.decodeRate) this.lastRate = model.decodeRate;
    rows.push(['Decoded', this.lastRate ? rateText(this.lastRate) : '…']);
    rows.push(['Frames', `${this.stage.frames.length} /s`]);
    showStatistics(rows);
  }

  #pointers(canvas) {
    let down = null;
    canvas.addEventListener('pointerdown', event => {
      canvas.focus({preventScroll: true});
      down = event;
      if (this.settings.tool === 'box' && this.model && event.button === 0) this.region.begin(this.model, event);
    });
    canvas.addEventListener('pointerup', event => {
      const moved = down && Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY);
      if (!down || moved >= 5 || event.button !== 0) return;
      if (this.settings.tool === 'pick') this.pick(event);
      if (this.settings.tool === 'measure') this.#measure(event);
    });
    canvas.addEventListener('dblclick', async event => {
      const hit = await this.#hit(event);
      if (hit) this.navigation.turnAround(new THREE.Vector3(...hit.position));
    });
  }

  /** @returns the exact face there, which is shown, or null */
  async pick(event) {
    const hit = await this.#hit(event);
    this.picking.show(hit);
    return hit;
  }
  async #measure(event) {
    const hit = await this.#hit(event);
    if (hit) this.measure.add(hit);
  }
  async #hit(event) {
    const model = this.stage.paneAt(event) === 1 ? this.compare.model : this.model;
    if (!model) return null;
    try {
      return await this.picking.at(model, event);
    } catch (error) {
      tell(sentence(error), true);
      return null;
    }
  }

  #files() {
    find('open').onclick = () => this.showStart();
    find('start-close').onclick = () => this.escape();
    find('choose').onchange = () => find('choose').files[0] && this.open(find('choose').files[0]);
    find('start-form').onsubmit = event => {
      event.preventDefault();
      const address = find('address').value.trim();
      if (address !== '') this.open(address);
    };
    addEventListener('dragover', event => {
      event.preventDefault();
      document.body.classList.add('dropping');
    });
    addEventListener('dragleave', event => {
      if (event.relatedTarget === null) document.body.classList.remove('dropping');
    });
    addEventListener('drop', event => {
      event.preventDefault();
      document.body.classList.remove('dropping');
      const file = event.dataTransfer.files[0], address = event.dataTransfer.getData('text/uri-list');
      if (file || address) this.open(file ?? address);
    });
  }
}

function nameOf(input) {
  if (typeof input !== 'string') return input.name ?? 'mesh';
  const last = new URL(input, location.href).pathname.split('/').filter(Boolean).pop() ?? input;
  try {
    return decodeURIComponent(last);
  } catch {
    return last;  // not everything with a % is an escape
  }
}

try {
  const viewer = window.viewer = new Viewer();
  const file = new URLSearchParams(location.search).get('file');
  if (file) viewer.open(file).then(opened => opened && followLink(viewer));
  else viewer.showStart();
} catch (error) {
  document.body.classList.add('nothing');
  tell(/webgl/i.test(error.message)
    ? 'This browser has no WebGL 2, which drawing needs: allow hardware acceleration in its settings, or take another browser.'
    : sentence(error), true);
}
