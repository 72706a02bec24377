// What can be set: the panel, buttons and keys, which all end here.

import {maps} from './colouring.js';
import {isTyping} from './navigation.js';

const find = id => document.getElementById(id);

export class Settings {
  /** @param viewer see main.js */
  constructor(viewer) {
    this.viewer = viewer;
    this.#panel();
    this.#tools();
    addEventListener('keydown', event => this.#key(event));
    this.setTheme(remembered('theme') ?? (matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark'));
    this.setTarget(0.75);
  }

  #panel() {
    const {viewer} = this;
    find('map').append(...Object.keys(maps).map(name => new Option(name, name)));
    find('map').onchange = () => this.setMap(find('map').value);
    find('colour').onchange = () => this.setColour(find('colour').value);
    for (const [id, set] of [['wireframe', on => viewer.colouring.setWireframe(on)], ['flat', on => viewer.colouring.setFlat(on)],
      ['spheres', on => viewer.setSpheres(on)], ['shade', on => viewer.setShade(on)], ['ground', on => viewer.setGround(on)], ['light', on => this.setTheme(on ? 'light' : 'dark')], ['freeze', on => viewer.setFrozen(on)]]) {
      find(id).onchange = () => {
        if (id === 'flat') this.flatChosen = true;
        if (id === 'ground') this.groundChosen = true;
        set(find(id).checked);
        viewer.stage.touch();
      };
    }
    find('target').oninput = () => this.setTarget(2 ** find('target').valueAsNumber);
    find('beside').onchange = () => viewer.showBeside(find('beside').value);
    for (const button of document.querySelectorAll('[data-up]')) button.onclick = () => this.setUp(button.dataset.up);
  }

  #tools() {
    const {viewer} = this;
    for (const button of document.querySelectorAll('[data-tool]')) {
      if (button.tagName === 'BUTTON') button.onclick = () => this.setTool(button.dataset.tool);
    }
    find('fit').onclick = () => viewer.fit();
    find('full').onclick = () => viewer.fullScreen();
    find('picture').onclick = () => viewer.savePicture();
    find('link').onclick = () => viewer.copyLink();
    find('help-button').onclick = () => this.help();
    find('panel-button').onclick = () => this.togglePanel();
    this.setTool('orbit');
  }

  setTool(tool) {
    this.tool = document.body.dataset.tool = tool;
    for (const button of document.querySelectorAll('button[data-tool]')) button.setAttribute('aria-pressed', button.dataset.tool === tool);
    document.body.classList.toggle('is-flying', tool === 'fly');
    this.viewer.navigation.setTool(tool);
  }
  togglePanel() {
    const open = !find('panel').classList.toggle('closed');
    find('panel-button').setAttribute('aria-expanded', open);
    document.body.classList.toggle('has-panel', open);
    this.viewer.layOut();
  }
  help() {
    if (find('help').open) find('help').close();
    else find('help').showModal();
  }

  setTheme(theme) {
    document.documentElement.dataset.theme = theme;
    find('light').checked = theme === 'light';
    this.viewer.stage.setTheme(theme);
    remember('theme', theme);
  }

  /** @param {string} axis 'y' or 'z' */
  setUp(axis) {
    this.up = axis;
    for (const button of document.querySelectorAll('[data-up]')) button.setAttribute('aria-pressed', button.dataset.up === axis);
    this.viewer.setUp(axis);
  }

  /** Pixels. */
  setTarget(pixels) {
    find('target').value = Math.log2(pixels);
    find('target-value').textContent = `${Number(pixels.toPrecision(2))} px`;
    this.viewer.setTarget(pixels);
  }

  setMap(name) {
    find('map').value = name;
    this.viewer.setMap(name);
  }
  /** Flat shading as suits a mesh, until somebody chose. */
  suitFlat(flat) {
    if (this.flatChosen) return;
    find('flat').checked = flat;
    this.viewer.colouring.setFlat(flat);
  }
  /** The same of the shadow on the ground. */
  suitGround(on) {
    if (this.groundChosen) return;
    find('ground').checked = on;
    this.viewer.setGround(on);
  }

  /** The choices that a model gives. @param {string | null} chosen null: what suits it */
  offer(model, chosen = null) {
    const fields = [...model.fields.values()], select = find('colour'), groups = [];
    const options = [new Option('one colour', 'plain')];
    if (model.materialsByName) options.push(new Option('its own materials', 'materials'));
    if (fields.some(field => field.role === 'colour' && field.domain === 'point')) options.push(new Option('its own colours', 'own'));
    if (model.refines) options.push(new Option('level of detail', 'level'), new Option('chart', 'chart'));
    for (const [domain, label] of [['point', 'Values of points'], ['cell', 'Values of cells']]) {
      const group = Object.assign(document.createElement('optgroup'), {label});
      for (const field of fields.filter(f => f.domain === domain)) group.append(...optionsOf(field));
      if (group.children.length > 0) groups.push(group);
    }
    const before = select.value;
    select.replaceChildren(...options, ...groups);
    const values = [...select.options].map(option => option.value);
    select.value = chosen ?? (values.includes(before) && before !== 'plain' ? before : ['materials', 'own'].find(own => values.includes(own)) ?? firstField(model) ?? 'plain');
    if (select.selectedIndex < 0) select.value = 'plain';
    const levels = model.refines ? model.file.levels.map((_, level) => new Option(level === 0 ? 'the mesh itself' : `level ${level} of it`, level)) : [];
    if (!this.viewer.compare.model) find('beside').replaceChildren(new Option('nothing', ''), ...levels, new Option('another file…', 'file'));
  }
  setColour(value) {
    find('colour').value = value;
    const {key, component} = parse(value);
    this.viewer.setColour(key, component);
    find('map-row').hidden = !this.viewer.colouring.field || this.viewer.colouring.labels !== null;
  }
  #nextColour() {
    const select = find('colour');
    this.setColour(select.options[(select.selectedIndex + 1) % select.options.length].value);
  }

  #key(event) {
    if (isTyping(event) || event.ctrlKey || event.metaKey || event.altKey || find('help').open) return;
    const {viewer} = this, shift = event.shiftKey, flying = this.tool === 'fly';
    const move = (right, up) => (shift ? viewer.navigation.move(-0.1 * right, 0.1 * up) : viewer.navigation.turn(0.1 * right, 0.1 * up));
    const check = id => find(id).click();
    const keys = {
      1: () => this.setTool('orbit'), 2: () => this.setTool('fly'), 3: () => this.setTool('pick'), 4: () => this.setTool('box'), 5: () => this.setTool('measure'),
      Home: () => viewer.fit(), Escape: () => viewer.escape(), '?': () => this.help(), Tab: () => this.togglePanel(),
      c: () => this.#nextColour(), p: () => viewer.savePicture(), l: () => viewer.copyLink(), m: () => check('wireframe'), f: () => check('flat'), b: () => check('spheres'), t: () => check('light'),
      ' ': () => viewer.timeline.play(!viewer.timeline.playing), ',': () => viewer.timeline.move(-1), '.': () => viewer.timeline.move(1),
      h: () => check('freeze'), s: () => check('shade'), n: () => check('ground'), g: () => viewer.fullScreen(), v: () => find('cut-view').click(), o: () => viewer.showStart(), u: () => this.setUp(this.up === 'z' ? 'y' : 'z'), '[': () => this.setTarget(viewer.target / 1.25), ']': () => this.setTarget(viewer.target * 1.25),
      ArrowLeft: () => move(-1, 0), ArrowRight: () => move(1, 0), ArrowUp: () => move(0, 1), ArrowDown: () => move(0, -1),
      '+': () => viewer.navigation.approach(0.85), '-': () => viewer.navigation.approach(1 / 0.85),
    };
    for (const axis of ['x', 'y', 'z']) keys[axis] = () => viewer.cuts.toggle(axis);
    const arrows = /^(Arrow|[+-]$)/.test(event.key);
    // Tab goes on from button to button where one has the focus; arrows move what has it, Space presses it.
    const elsewhere = document.activeElement !== viewer.stage.canvas && document.activeElement !== document.body;
    if ((event.key === 'Tab' || arrows) && elsewhere) return;
    if (event.key === ' ' && elsewhere && document.activeElement.type !== 'range') return;
    if (flying && arrows) return;
    const run = keys[event.key] ?? keys[event.key.toLowerCase()];
    if (!run) return;
    event.preventDefault();
    run();
  }
}

/** Who has computed something wants to see it: the first field of a volume. Numbers of points and labels of cells are none. */
function firstField(model) {
  if (model.file.mode !== 'stream') return null;
  const fields = [...model.fields.values()].filter(({type, role}) => type[0] === 'f' && role !== 'normal');
  return (fields.find(field => field.domain === 'point') ?? fields[0])?.key ?? null;
}

function optionsOf({key, name, components}) {
  if (components === 1) return [new Option(name || 'value', key)];
  const parts = components > 4 ? [] : Array.from({length: components}, (_, c) => new Option(`${name} [${c}]`, `${key}\n${c}`));
  return [new Option(`${name}, magnitude`, key), ...parts];
}
function parse(value) {
  const [key, component] = value.split('\n');
  return {key, component: component === undefined ? -1 : Number(component)};
}

function remembered(name) {
  try {
    return localStorage.getItem(`maille.${name}`);
  } catch {
    return null;  // pages without storage
  }
}
function remember(name, value) {
  try {
    localStorage.setItem(`maille.${name}`, value);
  } catch {
    // Only for the next visit.
  }
}
