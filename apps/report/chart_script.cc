#include "chart_script.h"

namespace counterpoint::apps {

// Long: one string literal, a program in JavaScript.
const char* chart_script() {
  return R"js(
// Charts: wheel or two fingers zoom along x, a drag moves, a double click shows all; y follows what is in view.
// Points are read off the picture itself (docs/reference/replay.md, Charts).
(() => {
const kSpace = 'http://www.w3.org/2000/svg';
const make = (tag, attributes, words) => {
  const out = document.createElementNS(kSpace, tag);
  for (const [name, value] of Object.entries(attributes)) out.setAttribute(name, value);
  if (words !== undefined) out.textContent = words;
  return out;
};
const short = (x) => {
  const size = Math.abs(x);
  return size !== 0 && (size < 1e-3 || size >= 1e5) ? x.toExponential(3) : String(Number(x.toPrecision(5)));
};

class Axis {
  constructor(words, from, to) {
    const [low, high, log] = words.split(' ').map(Number);
    Object.assign(this, {all: [low, high], range: [low, high], log: log === 1, from, to});
  }
  /// Of a pixel of the whole picture, of a pixel now.
  first(pixel) { return this.all[0] + (pixel - this.from) / (this.to - this.from) * (this.all[1] - this.all[0]); }
  at(pixel) { return this.range[0] + (pixel - this.from) / (this.to - this.from) * (this.range[1] - this.range[0]); }
  pixel(t) { return this.from + (t - this.range[0]) / (this.range[1] - this.range[0]) * (this.to - this.from); }
  value(t) { return this.log ? 10 ** t : t; }
  ticks() {
    const [low, high] = this.range, raw = (high - low) / 6, power = 10 ** Math.floor(Math.log10(raw));
    const step = this.log && raw > 0.2 ? Math.max(1, Math.ceil(raw)) : power * [1, 2, 5, 10].find((s) => s * power >= 0.999 * raw);
    const out = [];
    for (let k = Math.ceil(low / step); k * step <= high && out.length < 20; ++k) out.push(k * step);
    return out;
  }
}

class Chart {
  constructor(svg) {
    this.svg = svg;
    const [left, top, right, bottom] = svg.dataset.frame.split(' ').map(Number);
    Object.assign(this, {left, top, right, bottom});
    this.x = new Axis(svg.dataset.x, left, right);
    this.y = new Axis(svg.dataset.y, bottom, top);
    this.grid = svg.querySelector('.grid');
    const plot = svg.querySelector('.plot'), id = `clip${Chart.count = (Chart.count ?? 0) + 1}`;
    const clip = make('clipPath', {id});
    clip.append(make('rect', {x: left, y: top, width: right - left, height: bottom - top}));
    plot.before(clip);
    plot.setAttribute('clip-path', `url(#${id})`);
    const t = (x, y) => [this.x.first(x), this.y.first(y)];
    this.lines = [...plot.querySelectorAll('polyline')].map((node) => ({
      node, name: node.dataset.name, points: node.getAttribute('points').trim().split(/\s+/).map((p) => t(...p.split(',').map(Number)))}));
    this.dots = [...plot.querySelectorAll('circle')].map((node) => ({node, point: t(Number(node.getAttribute('cx')), Number(node.getAttribute('cy')))}));
    this.levels = [...plot.querySelectorAll('.level')].map((node) => {
      const y = Number(node.querySelector('line').getAttribute('y1'));
      return {node, y, t: this.y.first(y)};
    });
    this.cursor = make('line', {y1: top, y2: bottom, stroke: '#888', 'stroke-dasharray': '2 2', visibility: 'hidden'});
    svg.append(this.cursor);
    this.words = document.createElement('div');
    this.words.className = 'values';
    svg.after(this.words);
    svg.style.touchAction = 'pan-y';
    this.listen();
  }

  listen() {
    const {svg} = this;
    this.pointers = new Map();
    svg.addEventListener('wheel', (event) => {
      event.preventDefault();
      this.zoom(this.pixelOf(event), Math.exp(0.0015 * event.deltaY));
    }, {passive: false});
    svg.addEventListener('pointerdown', (event) => this.pointers.set(event.pointerId, this.pixelOf(event)));
    for (const name of ['pointerup', 'pointercancel']) window.addEventListener(name, (event) => this.pointers.delete(event.pointerId));
    svg.addEventListener('pointermove', (event) => {
      const now = this.pixelOf(event), before = this.pointers.get(event.pointerId);
      if (before !== undefined) {
        const other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1];
        if (other !== undefined) this.zoom(other, Math.abs(before - other) / Math.max(1, Math.abs(now - other)));
        else if (event.buttons) this.move(before - now);
        this.pointers.set(event.pointerId, now);
      }
      this.show(now);
    });
    svg.addEventListener('pointerleave', () => this.show(null));
    svg.addEventListener('dblclick', () => this.setRange(...this.x.all));
  }

  /// x in the picture's own units.
  pixelOf(event) {
    const box = this.svg.getBoundingClientRect();
    return (event.clientX - box.left) / box.width * this.svg.viewBox.baseVal.width;
  }
  zoom(pixel, factor) {
    const at = this.x.at(pixel), [a, b] = this.x.range;
    this.setRange(at - (at - a) * factor, at + (b - at) * factor);
  }
  move(pixels) {
    const [a, b] = this.x.range, by = pixels / (this.right - this.left) * (b - a);
    const [low, high] = this.x.all, kept = Math.min(Math.max(by, low - a), high - b);
    this.setRange(a + kept, b + kept);
  }
  setRange(a, b) {
    const [low, high] = this.x.all;
    if (!(b - a > 1e-4 * (high - low))) return;
    this.x.range = [Math.max(a, low), Math.min(b, high)];
    this.y.range = this.x.range[0] === low && this.x.range[1] === high ? this.y.all : this.seen();
    this.draw();
  }

  /// The least and the largest y in view, with some room; parts of lines between two points too.
  seen() {
    const [a, b] = this.x.range;
    let low = Infinity, high = -Infinity;
    const take = (y) => { low = Math.min(low, y); high = Math.max(high, y); };
    for (const {points} of this.lines) {
      points.forEach(([x, y], i) => {
        if (x >= a && x <= b) take(y);
        if (i === 0) return;
        const [x0, y0] = points[i - 1];
        for (const edge of [a, b]) if ((x0 - edge) * (x - edge) < 0) take(y0 + (edge - x0) / (x - x0) * (y - y0));
      });
    }
    for (const {point: [x, y]} of this.dots) if (x >= a && x <= b) take(y);
    if (!(low <= high)) return this.y.all;
    const room = 0.06 * (high - low) || 0.02 * (this.y.all[1] - this.y.all[0]);
    return [low - room, high + room];
  }

  draw() {
    const {x, y} = this;
    for (const {node, points} of this.lines)
      node.setAttribute('points', points.map(([a, b]) => `${x.pixel(a).toFixed(1)},${y.pixel(b).toFixed(1)}`).join(' '));
    for (const {node, point: [a, b]} of this.dots) {
      node.setAttribute('cx', x.pixel(a));
      node.setAttribute('cy', y.pixel(b));
    }
    for (const level of this.levels) level.node.setAttribute('transform', `translate(0 ${y.pixel(level.t) - level.y})`);
    this.grid.replaceChildren();
    for (const t of x.ticks()) {
      const at = x.pixel(t);
      this.grid.append(make('line', {x1: at, x2: at, y1: this.top, y2: this.bottom, stroke: '#e4e4e4'}),
                       make('text', {x: at, y: this.bottom + 16, 'text-anchor': 'middle'}, short(x.value(t))));
    }
    for (const t of y.ticks()) {
      const at = y.pixel(t);
      this.grid.append(make('line', {x1: this.left, x2: this.right, y1: at, y2: at, stroke: '#e4e4e4'}),
                       make('text', {x: this.left - 6, y: at + 4, 'text-anchor': 'end'}, short(y.value(t))));
    }
  }

  /// The value of every curve under the cursor: on the line where x rises, else its nearest point.
  show(pixel) {
    const inside = pixel !== null && pixel >= this.left && pixel <= this.right;
    this.cursor.setAttribute('visibility', inside ? 'visible' : 'hidden');
    this.words.replaceChildren();
    if (!inside) return;
    this.cursor.setAttribute('x1', pixel);
    this.cursor.setAttribute('x2', pixel);
    const at = this.x.at(pixel);
    const add = (words, color) => {
      const entry = document.createElement('span');
      entry.textContent = words;
      entry.style.color = color;
      this.words.append(entry);
    };
    add(`${this.svg.dataset.xLabel}: ${short(this.x.value(at))}`, '#444');
    for (const {node, name, points} of this.lines) {
      if (node.classList.contains('band')) continue;
      const y = valueAt(points, at);
      if (y !== null) add(`${name ? `${name}: ` : ''}${short(this.y.value(y))}`, node.getAttribute('stroke'));
    }
  }
}

function valueAt(points, at) {
  if (!points.length) return null;
  for (let i = 1; i < points.length; ++i) {
    const [x0, y0] = points[i - 1], [x1, y1] = points[i];
    if ((x0 - at) * (x1 - at) <= 0 && x0 !== x1) return y0 + (at - x0) / (x1 - x0) * (y1 - y0);
  }
  return null;
}

window.counterpointCharts = [...document.querySelectorAll('svg.chart')].map((svg) => new Chart(svg));
})();
)js";
}

}  // namespace counterpoint::apps
