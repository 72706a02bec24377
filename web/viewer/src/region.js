// A box around what is seen in a rectangle; its faces, exactly, as a PLY file.

import * as THREE from 'three';

import {saveAs} from './page.js';
import {OVERLAY} from './layers.js';
import {count, sentence} from './text.js';

/** Rays through a rectangle, each way. */
const RAYS = 13;

export class Region {
  /** @param {function} tell(text, bad): a message in the page */
  constructor(stage, card, rectangle, tell) {
    Object.assign(this, {stage, card, rectangle, tell, box: null, model: null});
    this.helper = new THREE.Box3Helper(new THREE.Box3(), 0x58a6ff);
    this.helper.visible = false;
    this.helper.layers.set(OVERLAY);
    stage.scene.add(this.helper);
  }

  /** Drags a rectangle; then there is a box, or a message. */
  begin(model, event) {
    const {canvas} = this.stage, from = event;
    canvas.setPointerCapture(event.pointerId);
    const move = to => Object.assign(this.rectangle.style, sides(from, to)) && (this.rectangle.hidden = false);
    const end = to => {
      canvas.removeEventListener('pointermove', move);
      canvas.removeEventListener('pointerup', end);
      canvas.removeEventListener('pointercancel', end);
      this.rectangle.hidden = true;
      if (to.type === 'pointerup') this.select(model, from, to);
    };
    canvas.addEventListener('pointermove', move);
    canvas.addEventListener('pointerup', end);
    canvas.addEventListener('pointercancel', end);
  }

  select(model, from, to) {
    const box = new THREE.Box3();
    for (let i = 0; i < RAYS; ++i) {
      for (let k = 0; k < RAYS; ++k) {
        const clientX = from.clientX + (to.clientX - from.clientX) * i / (RAYS - 1);
        const clientY = from.clientY + (to.clientY - from.clientY) * k / (RAYS - 1);
        const point = this.#firstSeen(model, {clientX, clientY});
        if (point) box.expandByPoint(point);
      }
    }
    if (box.isEmpty()) return this.tell('There is nothing in this rectangle.');
    this.setBox(model, box);
  }
  #firstSeen(model, at) {
    const hits = this.stage.rayAt(at).intersectObjects(model.shown, false);
    const seen = hits.find(({point}) => this.stage.isLeft(point));
    return seen?.point;
  }

  /** @param {THREE.Box3 | null} box */
  setBox(model, box) {
    Object.assign(this, {model, box});
    this.helper.visible = box !== null;
    this.card.hidden = box === null;
    this.stage.touch();
    if (!box) return;
    const size = box.getSize(new THREE.Vector3()).length();
    for (const corner of [box.min, box.max]) corner.fromArray(corner.toArray().map(x => rounded(x, size)));
    this.helper.box.copy(box);
    this.#fill();
  }

  /** The faces that have a point in the box, as MeshFile.extractPly() gives them; an error is a rejected promise. */
  async ply() {
    if (!this.model.refines) throw new Error('Only files of mode "random" give regions: maille compress --mode random');
    const {min, max} = this.box;
    return this.model.file.extractPly({box: {low: min.toArray(), high: max.toArray()}});
  }

  async #download(button) {
    button.disabled = true;
    button.textContent = 'Fetching…';
    try {
      const {bytes, points, faces, notes} = await this.ply();
      if (faces === 0) return this.tell('No face has a point in this box.');
      const name = fileName(this.model.file.name).replace(/\.maille$/, '');
      saveAs(new Blob([bytes], {type: 'application/octet-stream'}), `${name}-region.ply`);
      this.tell([`${count(faces)} faces with ${count(points)} points saved`, ...notes].join('; ') + '.');
    } catch (error) {
      this.tell(sentence(error), true);
    } finally {
      button.disabled = false;
      button.textContent = 'Download PLY';
    }
  }

  #fill() {
    const {card, box, model} = this;
    card.innerHTML = `<h3>Region</h3><button class="close" title="Close">×</button><div class="sides"></div>
      <p>All faces with a point in this box, bit for bit as in the original.</p><pre></pre><button class="main">Download PLY</button>`;
    const place = card.querySelector('.sides');
    for (const axis of ['x', 'y', 'z']) {
      const label = document.createElement('span');
      label.textContent = axis;
      place.append(label, this.#field(box.min, axis, `least ${axis}`), this.#field(box.max, axis, `greatest ${axis}`));
    }
    card.querySelector('.close').onclick = () => this.setBox(null, null);
    const button = card.querySelector('.main');
    button.onclick = () => this.#download(button);
    button.hidden = !model.refines;
    if (model.volume) card.querySelector('p').textContent = 'Cells that meet this box, as the command gives them:';
    else if (!model.refines) card.querySelector('p').textContent = 'Only files of mode "random" give regions: compress the mesh with --mode random.';
    this.#say();
  }
  #field(corner, axis, label) {
    const input = document.createElement('input');
    Object.assign(input, {type: 'number', step: 'any', value: corner[axis], ariaLabel: label});
    input.onchange = () => {
      if (!Number.isFinite(input.valueAsNumber)) return;
      corner[axis] = input.valueAsNumber;
      this.helper.box.copy(this.box);
      this.#say();
      this.stage.touch();
    };
    return input;
  }
  #say() {
    const {min, max} = this.box, pre = this.card.querySelector('pre');
    pre.hidden = !this.model.refines && !this.model.volume;
    pre.textContent = `maille extract ${fileName(this.model.file.name)} region.${this.model.volume ? 'vtu' : 'ply'} --box=${[...min.toArray(), ...max.toArray()].join(',')}`;
    this.helper.box.copy(this.box);
  }
}

/** To a hundred-thousandth of the box: the fields and the command say the same as the box is. */
function rounded(x, size) {
  const digits = Math.min(20, Math.max(0, 5 - Math.floor(Math.log10(size || 1))));
  return Number(x.toFixed(digits));
}
function fileName(name) {
  return decodeURIComponent(name.split(/[?#]/)[0].split('/').pop()) || name;
}
function sides(a, b) {
  const px = value => `${value}px`;
  return {
    left: px(Math.min(a.clientX, b.clientX)), top: px(Math.min(a.clientY, b.clientY)),
    width: px(Math.abs(a.clientX - b.clientX)), height: px(Math.abs(a.clientY - b.clientY)),
  };
}
