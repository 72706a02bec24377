// Parts of the page that tell: messages, progress, the legend, statistics.

const find = id => document.getElementById(id);

/** A sentence at the foot of the page; `action`: {text, run}; `kind`: takes the place of another message of this kind. */
export function tell(text, bad = false, action = null, kind = text) {
  const message = document.createElement('div'), sentence = document.createElement('p'), close = document.createElement('button');
  message.className = `card message${bad ? ' bad' : ''}`;
  message.dataset.kind = kind;
  sentence.textContent = text;
  Object.assign(close, {textContent: '×', title: 'Close', onclick: () => message.remove()});
  message.append(sentence);
  if (action) {
    const button = document.createElement('button');
    Object.assign(button, {textContent: action.text, onclick: () => { message.remove(); action.run(); }});
    message.append(button);
  }
  message.append(close);
  // Three are enough.
  for (const old of [...find('messages').children]) {
    if (old.dataset.kind === kind) old.remove();
  }
  while (find('messages').children.length > 2) find('messages').firstChild.remove();
  find('messages').append(message);
  if (!bad) setTimeout(() => message.remove(), 6000);
}

/** Gives bytes to whoever sits there, as a file. */
export function saveAs(blob, name) {
  const link = document.createElement('a');
  Object.assign(link, {href: URL.createObjectURL(blob), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

export function clearMessages() {
  find('messages').replaceChildren();
}

/** @param {number | null} share 0 to 1; NaN: not known; null: done */
export function showProgress(share, text = '') {
  const bar = find('progress');
  bar.hidden = share === null;
  if (share === null) return;
  bar.classList.toggle('unknown', Number.isNaN(share));
  bar.querySelector('div').style.width = Number.isNaN(share) ? '' : `${100 * share}%`;
  bar.querySelector('p').textContent = text;
  bar.querySelector('p').hidden = text === '';
}

export function showLegend(legend) {
  const card = find('legend'), text = JSON.stringify(legend);
  if (card.dataset.shown === text) return;
  card.dataset.shown = text;
  card.hidden = legend === null;
  card.replaceChildren();
  if (!legend) return;
  const title = document.createElement('h3');
  title.textContent = legend.title;
  title.title = legend.about ?? '';
  card.append(title, legend.ticks ? scaleOf(legend) : entriesOf(legend));
}
function scaleOf({colours, ticks}) {
  const scale = document.createElement('div'), bar = document.createElement('div'), list = document.createElement('ol');
  scale.className = 'scale';
  bar.className = 'colours';
  bar.style.background = `linear-gradient(to top, ${colours.map(c => `#${c}`).join()})`;
  for (const tick of ticks) list.append(Object.assign(document.createElement('li'), {textContent: tick}));
  scale.append(bar, list);
  return scale;
}
function entriesOf({entries}) {
  const list = document.createElement('ul');
  for (const {colour, text, detail} of entries) {
    const item = document.createElement('li'), patch = document.createElement('i'), more = document.createElement('span');
    patch.style.background = `#${colour}`;
    more.textContent = detail;
    item.append(patch, text, more);
    list.append(item);
  }
  return list;
}

/** @param {Array} rows [term, value] */
export function showStatistics(rows) {
  const list = find('statistics');
  if (list.children.length !== 2 * rows.length) {
    list.replaceChildren(...rows.flatMap(([term]) => [Object.assign(document.createElement('dt'), {textContent: term}), document.createElement('dd')]));
  }
  rows.forEach(([term, value], i) => {
    const [dt, dd] = [list.children[2 * i], list.children[2 * i + 1]];
    if (dt.textContent !== term) dt.textContent = term;
    if (dd.textContent !== value) dd.textContent = value;
  });
}
