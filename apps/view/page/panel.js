// Buttons, sliders, lists and legend around the picture.
import {element, save, text} from './dom.js';
import {unpack} from './data.js';

export const kSpeeds = [0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1, 2, 5, 10];

const kKeys = [
  ['space', 'play, pause'], ['← →', 'one frame'], ['shift ← →', 'a tenth of the motion'],
  ['home end', 'start, end'], [', .', 'slower, faster'], ['L', 'loop'],
  ['F', 'follow the selected or next body; again: stop'], ['R', 'look at all of it'], ['1 2 3', 'front, side, top'],
  ['C', 'contact forces'], ['+ −', 'longer, shorter arrows'], ['P', 'contact points'], ['O', 'centre of mass'],
  ['A', 'frames'], ['J', 'joints at limits'], ['Z', 'dim what sleeps'], ['N', 'names'], ['M', 'mesh or hull'],
  ['G', 'ghost'], ['H', 'next of several ghosts'], ['V', 'robots as they look, or as they collide'],
  ['X', 'closure forces'], ['W', 'wire frames'], ['K', 'curves'], ['I', 'legend and menu'], ['D', 'dark, light'], ['U', 'copy a link to this view'], ['?', 'keys'],
];

/// Whether there may be several ghosts, to choose from.
function hasGhosts(replay) { return replay.live?.search || replay.motions[2]; }

/// [toggle, label, kind of mark] for each layer that the replay has data for, or may get.
function layers(replay) {
  const {live} = replay, [motion] = replay.motions;
  const has = (shape) => replay.shapes.some(shape);
  const rows = [];
  if (replay.contacts) {
    rows.push(['forces', 'contact force on the body', 'arrow']);
    rows.push(['points', 'contact point', 'point']);
  }
  if (replay.closureForces) rows.push(['pulls', 'closure force on its second body', 'pull']);
  if (hasGhosts(replay)) rows.push(['ghost', 'ghost:', 'ghost']);
  else if (replay.motions[1]) rows.push(['ghost', `ghost: ${replay.motions[1].name}`, 'ghost']);
  rows.push(['com', 'centre of mass of all', 'com']);
  if (live || motion.atLimit.some(Boolean)) rows.push(['limits', 'joint at a limit', 'limit']);
  if (replay.closures.length) rows.push(['closures', 'closure, between its anchors', 'closure']);
  if (live || motion.asleep.some(Boolean)) rows.push(['sleep', 'at rest: dimmed', 'sleep']);
  rows.push(['frames', 'body frames: x red, y green, z blue', 'frames'], ['names', 'names', 'names']);
  if (has((shape) => shape.visual)) rows.push(['visuals', 'robots as they look, not as they collide', 'names']);
  if (has((shape) => shape.given >= 0)) rows.push(['hull', 'meshes as their hulls', 'hull']);
  rows.push(['wireframe', 'wire frames', 'names']);
  return rows;
}

export class Panel {
  /// act: the actions behind the buttons (main.js).
  constructor(replay, root, act) {
    this.replay = replay;
    this.act = act;
    this.picture = element('div', {class: 'picture'});
    this.tip = element('div', {class: 'tip', hidden: true});
    this.labels = element('div', {class: 'labels'});
    this.message = element('div', {class: 'message', role: 'status', hidden: true});
    this.side = element('aside', {class: 'curves', 'aria-label': 'Curves'});
    this.keys = this.makeKeys();
    root.append(this.picture, this.labels, this.makeLegend(), this.side, this.makeBar(), this.tip, this.keys,
                this.message);
  }

  button(label, title, onclick) {
    return element('button', {title, 'aria-label': title, onclick: (event) => {
      onclick();
      event.currentTarget.blur();  // key presses stay with the page
    }}, label);
  }

  makeBar() {
    const {act} = this;
    this.play = this.button('▶', 'Play, pause (space)', () => act.togglePlay());
    this.scrub = element('input', {type: 'range', step: 'any', class: 'scrub', 'aria-label': 'Time [s]'});
    this.scrub.oninput = () => act.seek(Number(this.scrub.value));
    this.scrub.onchange = () => this.scrub.blur();
    this.clock = element('output', {class: 'clock'});
    this.speed = element('select', {'aria-label': 'Speed', title: 'Speed (, .)',
                                    onchange: () => act.setSpeed(Number(this.speed.value))});
    this.speed.append(...kSpeeds.map((speed) => element('option', {value: speed}, `${speed}×`)));
    this.loop = this.button('⟳', 'Loop (L)', () => act.toggleLoop());
    this.follow = element('select', {'aria-label': 'Follow a body', title: 'Follow a body (F)', class: 'follow',
                                     onchange: () => { act.follow(this.follow.value); this.follow.blur(); }});
    this.follow.append(element('option', {value: ''}, 'follow …'));
    const bodies = this.replay.bodies.slice(1, 2001);  // a longer list is not usable
    this.follow.append(...bodies.map((body) => element('option', {value: body.name}, body.name)));
    this.bar = element('nav', {class: 'bar'},
      this.play, this.button('◀|', 'One frame back (←)', () => act.step(-1)),
      this.button('|▶', 'One frame on (→)', () => act.step(1)), this.scrub, this.clock, this.speed, this.loop,
      this.follow, this.button('≣', 'Legend and menu (I)', () => act.toggle('legend')),
      this.button('∿', 'Curves (K)', () => act.toggle('curves')),
      this.button('◐', 'Dark, light (D)', () => act.toggleTheme()),
      this.button('?', 'Keys (?)', () => act.toggleKeys()));
    return this.bar;
  }

  makeLegend() {
    this.boxes = new Map();
    const rows = layers(this.replay).map(([name, label, mark]) => {
      const box = element('input', {type: 'checkbox', onchange: () => { this.act.toggle(name); box.blur(); }});
      this.boxes.set(name, box);
      const choice = name === 'ghost' && hasGhosts(this.replay) ? [this.makeGhosts()] : [];
      return element('label', {}, box, element('span', {class: `mark ${mark}`}), label, ...choice);
    });
    this.forceScale = element('div', {class: 'scale'});
    this.legend = element('div', {class: 'legend'},
      element('h1', {}, this.replay.title), this.forceScale, ...rows, this.makeInputs(), this.makeMade());
    return this.legend;
  }

  /// List to choose the ghost shown.
  makeGhosts() {
    this.ghosts = element('select', {'aria-label': 'Ghost', title: 'Ghost (H)',
                                     onchange: () => { this.act.chooseGhost(Number(this.ghosts.value)); this.ghosts.blur(); }});
    this.listGhosts();
    return this.ghosts;
  }
  listGhosts() {
    const ghosts = this.replay.motions.slice(1);
    this.ghosts.replaceChildren(...ghosts.map((ghost, i) => element('option', {value: i}, ghost.name)));
  }

  makeInputs() {
    const {inputs} = this.replay;
    const list = inputs.map((input) => element('li', {}, element('a', {
      href: '#', title: 'Save this file',
      onclick: () => { save(input.name.split('/').pop(), unpack(input.data)); return false; },
    }, input.name), ` ${input.bytes < 1000 ? `${input.bytes} B` : `${text(input.bytes / 1000)} kB`}`));
    return element('details', {}, element('summary', {}, `Inputs (${inputs.length} files)`),
                   element('ul', {}, ...list),
                   this.button('copy link', 'Copy a link to this view (U)', () => this.act.copyLink()));
  }

  makeMade() {
    const rows = this.replay.made.map(([key, value]) => [element('dt', {}, key), element('dd', {}, value)]);
    return element('details', {}, element('summary', {}, 'What made it'), element('dl', {}, ...rows.flat()));
  }

  makeKeys() {
    const rows = [...kKeys, ...this.act.keyRows ?? []].map(([key, what]) =>
      element('tr', {}, element('td', {}, element('kbd', {}, key)), element('td', {}, what)));
    return element('div', {class: 'keys', hidden: true, onclick: () => this.act.toggleKeys()},
      element('table', {}, ...rows),
      element('p', {}, 'Drag: turn. Right button or two fingers: move. Wheel or pinch: nearer, farther. ' +
                       'Click a body: select it; its position is added to the curves.'));
  }

  /// Shows a message for 2.5 s.
  say(words) {
    this.message.textContent = words;
    this.message.hidden = false;
    clearTimeout(this.fading);
    this.fading = setTimeout(() => { this.message.hidden = true; }, 2500);
  }

  showTip(words, x, y) {
    this.tip.hidden = !words;
    if (!words) return;
    this.tip.textContent = words;
    this.tip.style.transform = `translate(${x + 14}px, ${y + 10}px)`;
  }

  /// Shows names at their bodies: [{name, x, y}].
  showLabels(list) {
    while (this.labels.childElementCount > list.length) this.labels.lastChild.remove();
    while (this.labels.childElementCount < list.length) this.labels.append(element('span'));
    list.forEach(({name, x, y}, i) => {
      const label = this.labels.children[i];
      if (label.textContent !== name) label.textContent = name;
      label.style.transform = `translate(${x}px, ${y}px)`;
    });
  }

  /// Updates the controls that depend on time and settings.
  update(state) {
    const {start, end} = this.replay.motions[0];
    this.play.textContent = state.playing ? '❚❚' : '▶';
    Object.assign(this.scrub, {min: start, max: Math.max(end, start + 1e-9)});
    if (document.activeElement !== this.scrub) this.scrub.value = state.time;
    const digits = end - start < 0.1 ? 5 : 3;
    this.clock.textContent = `${state.time.toFixed(digits)} s`;
    this.clock.title = `of ${text(end)} s, frame ${state.at.frame}`;
    this.speed.value = state.speed;
    this.loop.classList.toggle('on', state.loop);
    this.follow.value = state.follow ?? '';
    if (this.ghosts) this.ghosts.value = state.ghost;
    for (const [name, box] of this.boxes) box.checked = state.show[name];
    this.legend.hidden = !state.show.legend;
    this.side.hidden = !state.show.curves;
  }
}
