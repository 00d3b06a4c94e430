// The sidebar of a search: its state in words, the button that ends it, its numbers over iterations, and the curves of
// the newest motion.
import {Curves, groups} from './curves.js';
import {Motion} from './data.js';
import {element} from './dom.js';
import {goneSign, section} from './live_panel.js';

/// Curves of the newest motion.
export class SearchCurves extends Curves {
  version = 0;
  ghost = -1;
  shown = 0;  // index of the ghost shown

  /// One item stands for the ghost shown, since charts stay while ghosts come and go.
  get ghosts() {
    const shown = () => this.replay.motions[1 + this.shown] ?? this.motion;
    return [{name: 'ghost', at: (time) => shown().at(time), pose: (...where) => shown().pose(...where)}];
  }
  showGhost(index) {
    this.shown = index;
    this.ghost = 0;
    this.renewed();
  }
  renewed() {
    ++this.version;
    this.changed?.();
  }

  /// Takes the curves of another motion; charts stay if only values differ. wanted: plots to show when they are new.
  renew(curves, wanted) {
    const names = (list) => JSON.stringify(list.map(({group, label, unit}) => [group, label, unit]));
    const old = this.replay.curves;
    if (this.zoomed?.[1] > this.motion.end) this.zoomed = null;
    if (names(curves) === names(old)) old.forEach((curve, i) => Object.assign(curve, curves[i]));
    else this.replace(curves, wanted);
    this.renewed();
  }
  replace(curves, wanted) {
    const {groups: before, names: shown} = this, plots = groups(curves);
    const positions = [...before].filter(([, group]) => group.curves[0].read);
    const fresh = wanted.filter((name) => !before.has(name));
    for (const name of shown) this.remove(name);
    this.replay.curves = curves;
    this.use(new Map([...plots, ...positions]));
    for (const name of [...shown, ...fresh]) this.add(name);
  }
}

/// Curves of the numbers of a search; the time of the others is the iteration here.
class NumberCurves extends Curves {
  logarithmic = true;
  version = 0;

  /// numbers: name and unit of each.
  constructor(numbers, seek) {
    const motion = Object.assign(Object.create(Motion.prototype), {frames: 0, time: []});
    const curves = numbers.map(({name, unit}, i) => (
      {name, unit: unit === '1' ? '' : unit, read: (row) => motion.rows[row][1 + i] ?? NaN}));
    super({motions: [motion], curves}, element('div'), seek);
    for (const name of this.groups.keys()) this.add(name);
  }

  /// rows: iteration and numbers of each.
  setRows(rows) {
    Object.assign(this.motion, {rows, frames: rows.length, time: rows.map(([iteration]) => iteration)});
    ++this.version;
  }
}

export class SearchPanel {
  /// act: the view of the search.
  constructor(numbers, panel, act) {
    this.words = element('p');
    this.stop = panel.button('stop and keep', 'End the search and keep the motion found so far', () => act.stop());
    this.curves = new NumberCurves(numbers, (iteration) => act.chooseIteration(iteration));
    this.curves.changed = () => act.redraw();
    this.gone = goneSign();
    panel.side.prepend(element('div', {class: 'live search'},
                               section('Search', this.words, this.stop, this.curves.holder)));
    document.body.append(this.gone);
    this.serverIs(false);
    this.gone.hidden = true;
  }

  serverIs(isThere) {
    this.gone.hidden = isThere;
    this.stop.disabled = !isThere;
  }

  update({rows, words, ended}) {
    this.words.textContent = [words, ended].filter(Boolean).join('\n');
    if (ended) this.stop.disabled = true;
    this.curves.setRows(rows);
  }

  /// Draws the curves with the cursor at an iteration, by default the newest.
  draw(iteration) {
    const {motion} = this.curves;
    if (motion.frames > 0) this.curves.draw(motion.at(iteration ?? motion.end));
  }
}
