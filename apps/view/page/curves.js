// Curves beside the picture, with a cursor at the current time. Dragging over a curve sets the
// time, the wheel zooms along time, a double click shows all again.
import {element, text} from './dom.js';

const kColors = ['#2f7fe6', '#e4703c', '#2fa06a', '#a05bd0', '#c09a1c', '#c2476f'];

/// A ghost's curve is dashed, in the colour of the curve that it is `like`.
function colorOf(curve, i) { return kColors[(curve.like ?? i) % kColors.length]; }

/// Value of a curve at a frame: stored, or read off the motion.
function valueOf(curve, frame) { return curve.read ? curve.read(frame) : curve.values[frame]; }

/// Curves by plot: those of the same group, or a curve without group by itself.
export function groups(curves) {
  const out = new Map();
  for (const curve of curves) {
    const name = curve.group || curve.name;
    if (!out.has(name)) out.set(name, {name, unit: curve.unit, curves: []});
    out.get(name).curves.push(curve);
  }
  return out;
}

class Chart {
  constructor(group, owner) {
    this.group = group;
    this.owner = owner;
    this.canvas = element('canvas', {'aria-label': `${group.name} over time`});
    this.legend = element('div', {class: 'values'});
    this.root = element('section', {class: 'chart'},
      element('header', {}, element('b', {}, group.name), element('span', {}, group.unit ? ` [${group.unit}]` : ''),
              element('button', {title: 'Remove this curve', onclick: () => owner.remove(group.name)}, '×')),
      this.canvas, this.legend);
    this.labels = group.curves.map((curve, i) => {
      const value = element('i');
      const mark = element('span', {class: 'mark'});
      mark.style.background = colorOf(curve, i);
      const entry = element('span', {}, mark, group.curves.length > 1 ? `${curve.label || curve.name} ` : '', value);
      this.legend.append(entry);
      return {value, entry};
    });
    this.listen();
  }

  listen() {
    const seek = (event) => this.owner.seek(this.timeAt(event));
    this.canvas.onpointerdown = (event) => {
      this.canvas.setPointerCapture(event.pointerId);
      seek(event);
    };
    this.canvas.onpointermove = (event) => { if (event.buttons) seek(event); };
    this.canvas.ondblclick = () => this.owner.zoom(null);
    this.canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      const at = this.timeAt(event), factor = Math.exp(0.0015 * event.deltaY);
      const [a, b] = this.owner.range;
      this.owner.zoom([at - (at - a) * factor, at + (b - at) * factor]);
    }, {passive: false});
  }

  /// Curves of a ghost are shown only while that ghost is.
  isShown(curve) { return curve.ghost === undefined || curve.ghost === this.owner.ghost; }

  timeAt(event) {
    const box = this.canvas.getBoundingClientRect(), [a, b] = this.owner.range;
    return a + (b - a) * Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
  }

  /// The smallest and largest value in view, and the scale of values: of their logarithms if the
  /// owner wants this and they are positive and differ much.
  bounds() {
    const {time, range: [from, to], frames: [first, last]} = this.owner;
    let low = Infinity, high = -Infinity;
    for (const curve of this.group.curves.filter((curve) => this.isShown(curve))) {
      for (let k = first; k <= last; ++k) {
        if (time[k] < from || time[k] > to) continue;
        const value = valueOf(curve, k);
        if (!Number.isFinite(value)) continue;
        low = Math.min(low, value);
        high = Math.max(high, value);
      }
    }
    if (!(low <= high)) [low, high] = [0, 1];
    const isLog = this.owner.logarithmic && low > 0 && high > 10 * low;
    if (isLog) [low, high] = [Math.log10(low), Math.log10(high)];
    const slack = (high - low) * 0.06 || Math.abs(high) * 0.1 || 1;
    return {low: low - slack, high: high + slack, isLog};
  }

  /// Draws the curves without the cursor: needed only when the range or the size changes.
  drawCurves(context, width, height, style) {
    const {time, range: [from, to], frames: [first, last]} = this.owner, {low, high, isLog} = this.bounds();
    const x = (t) => (t - from) / (to - from) * width;
    const y = (v) => (high - (isLog ? Math.log10(v) : v)) / (high - low) * height;
    context.fillStyle = context.strokeStyle = style.getPropertyValue('--faint');
    context.font = '10px system-ui, sans-serif';
    if (!isLog && low < 0 && high > 0) context.fillRect(0, y(0), width, 1);
    context.lineWidth = 1.4;
    this.group.curves.forEach((curve, i) => {
      if (!this.isShown(curve)) return;
      context.strokeStyle = colorOf(curve, i);
      context.setLineDash(curve.like === undefined ? [] : [4, 3]);
      context.beginPath();
      for (let k = first; k <= last; ++k) context.lineTo(x(time[k]), y(valueOf(curve, k)));
      context.stroke();
    });
    context.setLineDash([]);
    context.strokeStyle = style.getPropertyValue('--back');  // a halo: numbers stay readable on curves
    context.lineWidth = 3;
    for (const [number, at] of [[high, 10], [low, height - 3]]) {
      const words = text(isLog ? 10 ** number : number);
      context.strokeText(words, 3, at);
      context.fillText(words, 3, at);
    }
  }

  draw(at) {
    const ratio = window.devicePixelRatio || 1;
    const width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    if (!width) return;
    const key = [width, height, ratio, ...this.owner.range, this.owner.ghost, this.owner.version,
                 document.documentElement.dataset.theme].join();
    const style = getComputedStyle(document.documentElement);
    if (key !== this.key) {
      this.key = key;
      this.back = element('canvas', {width: Math.round(width * ratio), height: Math.round(height * ratio)});
      const context = this.back.getContext('2d');
      context.scale(ratio, ratio);
      this.drawCurves(context, width, height, style);
      this.canvas.width = this.back.width;
      this.canvas.height = this.back.height;
    }
    const context = this.canvas.getContext('2d');
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, this.canvas.width, this.canvas.height);
    context.drawImage(this.back, 0, 0);
    const [from, to] = this.owner.range;
    const {time} = this.owner, start = time[at.frame];
    const t = at.share > 0 ? start + at.share * (time[at.frame + 1] - start) : start;
    context.fillStyle = style.getPropertyValue('--ink');
    context.fillRect((t - from) / (to - from) * this.canvas.width, 0, Math.max(1, ratio), this.canvas.height);
    this.group.curves.forEach((curve, i) => {
      const a = valueOf(curve, at.frame), b = at.share > 0 ? valueOf(curve, at.frame + 1) : a;
      this.labels[i].entry.hidden = !this.isShown(curve);
      this.labels[i].value.textContent = text(a + at.share * (b - a));
    });
  }
}

export class Curves {
  constructor(replay, panel, seek) {
    this.replay = replay;
    this.motion = replay.motions[0];
    this.zoomed = null;  // the range of times in view [s], or all
    this.ghost = 0;
    this.seek = seek;
    this.charts = new Map();
    this.list = element('datalist', {id: 'curve-names'});
    this.use(groups(replay.curves));
    this.input = element('input', {list: 'curve-names', placeholder: 'add a curve …', 'aria-label': 'Add a curve',
                                   onchange: () => { this.add(this.input.value); this.input.value = ''; }});
    this.holder = element('div');
    panel.append(this.holder, this.input, this.list);
  }

  /// Takes the curves by plot that the page can show.
  use(all) {
    this.groups = all;
    this.list.replaceChildren(...[...all.keys()].map((name) => element('option', {value: name})));
  }

  get time() { return this.motion.time; }
  get ghosts() { return this.replay.motions.slice(1); }
  get all() { return [this.motion.start, Math.max(this.motion.end, this.motion.start + 1e-9)]; }
  get range() { return this.zoomed ?? this.all; }

  /// The frames to draw: the first and the last in range, and one beyond.
  get frames() {
    const [from, to] = this.range, {motion} = this;
    return [motion.at(from).frame, Math.min(motion.at(to).frame + 1, motion.frames - 1)];
  }

  showGhost(index) {
    this.ghost = index;
    this.changed?.();
  }

  get names() { return [...this.charts.keys()]; }

  add(name) {
    const group = this.groups.get(name);
    if (!group || this.charts.has(name)) return;
    const chart = new Chart(group, this);
    this.charts.set(name, chart);
    this.holder.append(chart.root);
    this.changed?.();
  }

  remove(name) {
    this.charts.get(name)?.root.remove();
    this.charts.delete(name);
    this.changed?.();
  }

  /// Adds the position of a body, read off the poses, so that the page need not store it twice.
  addBody(body) {
    const {name} = this.replay.bodies[body], {motion, ghosts} = this;
    const group = `${name}: position`;
    if (!this.groups.has(group)) {
      const curves = ['x', 'y', 'z'].map((label, axis) => (
        {label, read: (k) => motion.poses[(k * motion.bodies + body) * 7 + axis]}));
      const pose = new Float64Array(7);
      ghosts.forEach((ghost, index) => {
        for (let axis = 0; axis < 3; ++axis)
          curves.push({label: `${'xyz'[axis]} ${ghost.name}`, like: axis, ghost: index,
                       read: (k) => ghost.pose(body, ghost.at(motion.time[k]), pose)[axis]});
      });
      this.use(new Map(this.groups).set(group, {name: group, unit: 'm', curves}));
    }
    this.add(group);
  }

  zoom(range) {
    const [start, end] = this.all, [a, b] = range ?? this.all;
    if (!(b - a > 1e-6 * (end - start))) return;
    this.zoomed = range && [Math.max(a, start), Math.min(b, end)];
    this.changed?.();
  }

  draw(at) {
    for (const chart of this.charts.values()) chart.draw(at);
  }
}
