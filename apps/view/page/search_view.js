// The view of a search for a motion: plays the newest motion in a loop, and keeps earlier ones as ghosts
// (docs/reference/live.md, Searches).
import * as THREE from 'three';
import {Bodies} from './bodies.js';
import {Motion, decode, decodeMotion} from './data.js';
import * as links from './link.js';
import {Connection} from './live.js';
import {SearchCurves, SearchPanel} from './search_panel.js';
import {View} from './view.js';

const kGhosts = 30;  // most motions of the search kept as ghosts
const kWider = 50;  // largest growth of the view to that of a first motion

const noForces = (frames) => ({pairs: [], pair: [], first: new Uint32Array(frames + 1), values: new Float32Array(0)});

/// Decodes the data of a search's page; later motions may have forces that the first has not.
export function decodeSearch(packed) {
  const replay = decode(packed), {bodies, closures, motions: [{frames}]} = replay;
  const room = (forces, most) => (
    {typical: 1, ...forces ?? noForces(frames), most: Math.max(forces?.most ?? 0, most)});
  replay.contacts = room(replay.contacts, Math.min(4096, 64 + 48 * bodies.length));
  replay.closureForces = closures.length ? room(replay.closureForces, closures.length) : null;
  return replay;
}

export class SearchView extends View {
  static Curves = SearchCurves;

  constructor(replay) {
    super(replay);
    this.search = {rows: [], words: '', ended: ''};  // the last message about the search
    this.motion.iteration = 0;
    this.given = replay.motions.slice(1);  // ghosts of the page's data
    this.kept = [];  // ghosts of the search, the oldest first
    this.news = [];  // motions that wait for the next picture
    this.isChosen = false;  // the ghost stays, and does not move along with the search
    this.ghost ??= new Bodies(replay, this.motion, this.stage.scene, true);
    if (this.given.length) this.curves.showGhost(0);
    this.searchPanel = new SearchPanel(replay.live.search.numbers, this.panel, this);
    this.live = new Connection({bytes: (bytes) => this.receive(JSON.parse(new TextDecoder().decode(bytes))),
                                say: (words) => this.panel.say(words), there: (isThere) => this.serverIs(isThere)});
  }

  start() {
    super.start();
    this.state.playing = true;
    this.live.open();
  }

  // --- from and to the server

  serverIs(isThere) {
    this.searchPanel.serverIs(isThere);
    if (this.search.ended) this.searchPanel.gone.hidden = true;
  }

  /// Takes rows and the first motion at once, and other motions before the next picture.
  receive(message) {
    if (message.motion && this.motion.frames === 1) this.take(message);
    else if (message.motion) this.hold(message);
    if (!message.rows) return;
    this.search = message;
    this.live.isOver = Boolean(message.ended);
    this.searchPanel.update(message);
    this.redraw();
  }

  /// Keeps a motion until the next picture. A page that is not seen draws none: it forgets every other motion.
  hold(message) {
    if (this.news.length >= 2 * kGhosts) this.news = this.news.filter((_, i) => i % 2 === 0);
    this.news.push(message);
  }

  stop() {
    this.live.send({do: 'stop'});
    this.searchPanel.stop.disabled = true;
  }

  // --- the newest motion

  /// Shows a motion in place of the last one, which becomes a ghost.
  take({motion: packed, iteration, ...more}) {
    const {motion, replay} = this, isFirst = motion.frames === 1;  // before it the page has a pose only
    const next = decodeMotion(packed, more, motion.bodies, motion.trees);
    if (!isFirst && next.motion.name !== motion.name) this.keep(motion);
    Object.assign(motion, next.motion, {iteration});
    this.takeForces(next);
    this.curves.renew(next.curves, more.shown_curves);
    this.painted = null;
    if (isFirst) this.lookAtMotion();
    this.setTime(this.time);
  }

  /// Replaces the forces; arrows keep their scale while there are none.
  takeForces({contacts, closureForces, motion: {frames}}) {
    const {contacts: shown, closureForces: pulls} = this.replay, {typical} = contacts ?? closureForces ?? shown;
    Object.assign(shown, contacts ?? noForces(frames), {typical});
    if (pulls) Object.assign(pulls, closureForces ?? noForces(frames));
  }

  /// Keeps a copy of a motion as a ghost. When there are too many, the one goes between whose neighbours the fewest
  /// iterations lie.
  keep(motion) {
    const {replay, kept} = this, chosen = this.isChosen ? this.ghost.motion : null;
    kept.push(Object.assign(Object.create(Motion.prototype), motion));
    if (kept.length > kGhosts) {
      const gap = (i) => kept[i] === chosen ? Infinity : kept[i + 1].iteration - kept[i - 1].iteration;
      let least = 1;
      for (let i = 2; i < kGhosts; ++i) if (gap(i) < gap(least)) least = i;
      kept.splice(least, 1);
    }
    replay.motions.splice(1, Infinity, ...this.given, ...kept);
    this.panel.listGhosts();
    super.chooseGhost(chosen ? replay.motions.indexOf(chosen) - 1 : this.usualGhost);
  }

  /// Moves and widens the view of a page that knew only the pose at the start to its first motion.
  lookAtMotion() {
    const {replay, motion: {poses, bodies, frames}} = this, point = new THREE.Vector3();
    const box = (count) => {
      const out = new THREE.Box3();
      for (let k = 0; k < count * bodies; ++k) if (k % bodies > 0) out.expandByPoint(point.fromArray(poses, 7 * k));
      return {middle: out.getCenter(new THREE.Vector3()), radius: 0.5 * out.getSize(new THREE.Vector3()).length()};
    };
    const start = box(1), all = box(frames), more = all.radius - start.radius;
    if (!(more < kWider * replay.radius)) return;  // the motion is far from a sensible one
    replay.center = all.middle.sub(start.middle).add(new THREE.Vector3(...replay.center)).toArray();
    replay.radius += Math.max(0, more);
    if (!links.read(location.hash).cam) this.resetView();
  }

  advance(now) {
    if (this.motion.frames > 1) super.advance(now);
    else this.last = now;
  }

  // --- ghosts

  /// The first ghost, if motions are compared with it; otherwise the motion before the newest.
  get usualGhost() { return this.given.length || this.replay.live.search.reference ? 0 : this.kept.length - 1; }

  /// Selects a ghost; the usual one moves along with the search.
  chooseGhost(index) {
    super.chooseGhost(index);
    this.isChosen = this.replay.motions.length > 1 && this.state.ghost !== this.usualGhost;
  }
  nextGhost() { if (this.replay.motions.length > 1) super.nextGhost(); }

  /// Selects the ghost nearest to an iteration.
  chooseIteration(iteration) {
    if (!this.kept.length) return;
    const far = (ghost) => Math.abs(ghost.iteration - iteration);
    const nearest = this.kept.reduce((best, ghost) => far(ghost) < far(best) ? ghost : best);
    this.chooseGhost(this.replay.motions.indexOf(nearest) - 1);
    this.panel.say(`ghost: ${nearest.name}`);
  }

  // --- drawing

  tick(now) {
    super.tick(now);
    for (const message of this.news.splice(0)) this.take(message);
  }

  update() {
    super.update();
    const {show} = this.state;
    this.ghost.group.visible = show.ghost && this.replay.motions.length > 1;
    if (show.curves) this.searchPanel.draw(this.isChosen ? this.ghost.motion.iteration : undefined);
  }
}
