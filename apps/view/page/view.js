// The view of a replay: connects the motion, the picture and the controls.
import * as THREE from 'three';
import {Bodies} from './bodies.js';
import {capture} from './capture.js';
import {Curves} from './curves.js';
import {element, text} from './dom.js';
import {listen} from './keys.js';
import * as links from './link.js';
import {CentreOfMass, Closures, ForceScale, Forces, Frames, Limits, Sticks, kPull} from './marks.js';
import {Panel, kSpeeds} from './panel.js';
import {Stage, roundStep} from './stage.js';

const kDefaults = {forces: true, points: true, com: false, frames: false, limits: true, closures: true, sleep: true,
                   names: false, hull: false, ghost: true, visuals: true, pulls: true, curves: true, legend: true,
                   wireframe: false};

export class View {
  static Curves = Curves;

  constructor(replay) {
    this.replay = replay;
    this.motion = replay.motions[0];
    this.state = {time: this.motion.start, at: this.motion.at(this.motion.start),
                  playing: false, loop: true, speed: 1, ghost: 0, follow: null, selected: -1, hovered: -1, ui: true};
    const narrow = window.innerWidth < 720;
    this.defaults = {...kDefaults, curves: !narrow, legend: !narrow};
    this.state.show = {...this.defaults};
    this.panel = new Panel(replay, document.body, this);
    this.stage = new Stage(replay, this.panel.picture);
    const {scene} = this.stage;
    this.bodies = new Bodies(replay, this.motion, scene, false);
    this.ghost = replay.motions[1] ? new Bodies(replay, replay.motions[1], scene, true) : null;
    this.forceScale = new ForceScale(replay);
    this.forces = new Forces(replay.contacts, this.forceScale, scene);
    this.pulls = new Forces(replay.closureForces, this.forceScale, scene, kPull);
    this.sticks = new Sticks(replay, this.bodies.group);
    this.com = new CentreOfMass(replay, scene);
    this.frames = new Frames(replay, scene);
    this.limits = new Limits(replay, this.motion, scene);
    this.closures = new Closures(replay, scene);
    this.curves = new this.constructor.Curves(replay, this.panel.side, (time) => this.seek(time));
    this.curves.changed = () => this.redraw();
    this.names = new Map(replay.bodies.map((body, i) => [body.name, i]));
    for (const frame of replay.frames) if (!this.names.has(frame.name)) this.names.set(frame.name, frame.body);
    this.setTheme(matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light');
    this.fit();
  }

  // --- time

  get time() { return this.state.time; }

  setTime(time) {
    const {state, motion} = this;
    state.time = Math.min(Math.max(time, motion.start), motion.end);
    state.at = motion.at(state.time);
    this.redraw();
  }
  seek(time) {
    this.state.playing = false;
    this.setTime(time);
  }
  seekStart() { this.seek(this.motion.start); }
  seekEnd() { this.seek(this.motion.end); }
  step(direction) {
    const {frame, share} = this.state.at;
    const next = direction < 0 && share > 0 ? frame : frame + direction;
    this.seek(this.motion.time[Math.min(Math.max(next, 0), this.motion.frames - 1)]);
  }
  jump(direction) { this.seek(this.time + 0.1 * direction * (this.motion.end - this.motion.start)); }

  togglePlay() {
    const {state, motion} = this;
    state.playing = !state.playing && motion.frames > 1;
    if (state.playing && state.time >= motion.end) this.setTime(motion.start);
    this.last = performance.now();
    this.redraw();
  }
  toggleLoop() {
    this.state.loop = !this.state.loop;
    this.redraw();
  }
  setSpeed(speed) {
    this.state.speed = speed;
    this.redraw();
  }
  changeSpeed(by) {
    const nearest = kSpeeds.findIndex((speed) => speed >= this.state.speed);
    this.setSpeed(kSpeeds[Math.min(Math.max(nearest + by, 0), kSpeeds.length - 1)]);
    this.panel.say(`speed ${this.state.speed}×`);
  }

  advance(now) {
    const {state, motion} = this;
    const passed = Math.min(0.25, (now - this.last) / 1000) * state.speed;
    this.last = now;
    let time = state.time + passed;
    if (time >= motion.end) {
      if (state.loop) time = motion.start + (time - motion.start) % (motion.end - motion.start);
      else state.playing = false;
    }
    this.setTime(time);
  }

  // --- visible layers and theme

  toggle(name) {
    this.state.show[name] = !this.state.show[name];
    if (name === 'curves' || name === 'legend') this.fit();
    this.redraw();
  }
  toggleTheme() { this.setTheme(this.themeName === 'dark' ? 'light' : 'dark'); }
  setTheme(name) {
    this.themeName = name;
    document.documentElement.dataset.theme = name;
    this.stage.theme(name);
    this.painted = null;
    this.redraw();
  }
  toggleKeys() { this.panel.keys.hidden = !this.panel.keys.hidden; }
  escape() {
    this.panel.keys.hidden = true;
    this.select(-1);
  }
  enlargeForces(factor) {
    this.forceScale.enlarge *= factor;
    this.redraw();
  }

  /// Selects the ghost to draw; at the start it is the first.
  chooseGhost(index) {
    const count = this.replay.motions.length - 1;
    if (!count) return;
    this.state.ghost = (Math.trunc(index) % count + count) % count;
    this.ghost.motion = this.replay.motions[1 + this.state.ghost];
    this.curves.showGhost(this.state.ghost);
    this.redraw();
  }
  nextGhost() {
    this.chooseGhost(this.state.ghost + 1);
    if (this.ghost) this.panel.say(`ghost: ${this.ghost.motion.name}`);
  }

  select(body) {
    this.state.selected = body;
    if (body > 0 && this.state.show.curves) this.curves.addBody(body);
    this.redraw();
  }

  /// Follows a body or link by name; '' or an unknown name ends following.
  follow(name) {
    this.state.follow = this.names.get(name) > 0 ? name : null;
    this.anchor = null;
    this.redraw();
    return this.state.follow !== null;
  }
  followNext() {
    const {follow, selected} = this.state, {bodies} = this.replay;
    const wanted = selected > 0 ? bodies[selected].name : follow ? '' : bodies[1]?.name ?? '';
    this.follow(wanted === follow ? '' : wanted);
    this.panel.say(this.state.follow ? `following ${this.state.follow}` : 'following nothing');
  }

  // --- camera

  resetView() {
    this.anchor = null;
    this.stage.reset((eye) => this.bodies.hiddenFrom(eye));
    this.redraw();
  }
  lookFrom(azimuth, elevation) {
    this.stage.look(azimuth, elevation, this.stage.view[2], this.stage.controls.target.clone());
    this.redraw();
  }

  /// Position of a body's origin, or of a point in its frame, on the screen [CSS pixels]; for tests
  /// and labels.
  project(name, point = [0, 0, 0]) {
    const p = new THREE.Vector3(...point).applyMatrix4(this.bodies.matrices[this.names.get(name)]);
    return this.stage.project(p.toArray());
  }

  // --- links

  get link() {
    const {state, curves} = this;
    return links.write({t: state.time, follow: state.follow, cam: this.stage.view, speed: state.speed, ghost: state.ghost,
                        show: state.show, defaults: this.defaults,
                        curves: curves.names.filter((name) => !this.standard.includes(name))});
  }
  async copyLink() {
    history.replaceState(null, '', this.link);
    try {
      await navigator.clipboard.writeText(location.href);
      this.panel.say('link copied');
    } catch {
      this.panel.say('the address bar has the link');
    }
  }
  applyLink(link) {
    if (link.theme === 'dark' || link.theme === 'light') this.setTheme(link.theme);
    Object.assign(this.state.show, link.show);
    for (const key of ['speed', 'loop', 'ui']) if (link[key] !== undefined) this.state[key] = link[key];
    document.body.classList.toggle('bare', !this.state.ui);
    this.fit();
    if (link.follow !== undefined && !this.follow(link.follow) && link.follow)
      this.panel.say(`there is no body ${link.follow}`);
    if (link.t !== undefined) this.seek(link.t);
    if (link.ghost !== undefined) this.chooseGhost(link.ghost - 1);
    for (const name of link.curves ?? []) this.curves.add(name);
    if (link.cam) {
      const [azimuth, elevation, distance, ...target] = link.cam;
      this.update();
      this.stage.look(azimuth, elevation, distance,
                      target.length ? new THREE.Vector3(...target) : this.stage.controls.target.clone());
      this.anchor = null;
    }
    if (link.play) this.togglePlay();
    this.redraw();
  }

  // --- drawing

  get canvas() { return this.stage.renderer.domElement; }
  resize(width, height, ratio) { this.stage.resize(width, height, ratio); }
  fit() {
    this.panel.update(this.state);
    const {clientWidth, clientHeight} = this.panel.picture;
    this.resize(clientWidth || 1, clientHeight || 1, Math.min(2, window.devicePixelRatio || 1));
    const beside = this.state.ui && this.state.show.legend && clientWidth > 600;
    this.stage.aside(beside ? Math.min(this.panel.legend.offsetWidth, clientWidth / 3) / 2 : 0);
    this.redraw();
  }
  redraw() { this.dirty = true; }

  /// Updates everything to the time of the state, without drawing.
  update() {
    const {state} = this, {frame} = state.at;
    this.bodies.update(state.at);
    if (this.ghost) {
      this.ghost.group.visible = state.show.ghost;
      this.ghost.update(this.ghost.motion.at(state.time));
    }
    for (const one of [this.bodies, this.ghost])
      if (one && ['hull', 'visuals', 'wireframe'].some((name) => one[name] !== state.show[name])) one.show(state.show);
    this.keepUp();
    const {matrices} = this.bodies, {show} = state;
    this.forces.update(frame, show);
    this.pulls.update(frame, {forces: show.pulls, points: false});
    this.sticks.update(matrices, show.visuals);
    this.com.update(matrices, show.com);
    this.frames.update(matrices, show.frames);
    this.limits.update(frame, matrices, this.stage.camera, show.limits);
    this.closures.update(matrices, show.closures);
    this.paint(frame);
  }

  /// Colours change seldom, so they are uploaded only when they do.
  paint(frame) {
    const {state, motion} = this;
    const asleep = state.show.sleep ? motion.asleep.subarray(frame * motion.trees, (frame + 1) * motion.trees) : [];
    const key = [state.selected, state.hovered, this.themeName, state.show.hull, state.show.visuals, ...asleep].join();
    if (key === this.painted) return;
    this.painted = key;
    this.bodies.paint(frame, {sleep: state.show.sleep, selected: state.selected, hovered: state.hovered,
                              background: this.stage.background});
  }

  /// Moves the camera along with the followed body.
  keepUp() {
    const {follow} = this.state;
    if (!follow) return;
    const now = new THREE.Vector3().setFromMatrixPosition(this.bodies.matrices[this.names.get(follow)]);
    this.stage.shift(now.clone().sub(this.anchor ?? this.stage.controls.target));
    this.anchor = now;
  }

  renderNow() {
    this.update();
    this.stage.render();
  }

  /// A round force [N] and the length of its arrow in the middle of the picture [pixels].
  forceRuler() {
    const {show} = this.state, {scale, typical} = this.forceScale;
    const shown = (this.replay.contacts && show.forces) || (this.replay.closureForces && show.pulls);
    if (!shown) return null;
    const {target} = this.stage.controls, newtons = roundStep(typical);
    const right = new THREE.Vector3(1, 0, 0).applyQuaternion(this.stage.camera.quaternion);
    const end = target.clone().addScaledVector(right, newtons * scale);
    const pixels = Math.abs(this.stage.project(end.toArray()).x - this.stage.project(target.toArray()).x);
    return {words: `${text(newtons)} N`, pixels};
  }

  showScale() {
    const ruler = this.forceRuler();
    if (!ruler) return this.panel.forceScale.replaceChildren();
    const bar = element('span', {class: 'ruler'});
    bar.style.width = `${Math.min(220, ruler.pixels).toFixed(0)}px`;
    const longest = text(this.forceScale.longest / this.forceScale.scale);
    this.panel.forceScale.replaceChildren(bar, ` ${ruler.words}; paler arrows are cut at ${longest} N`);
  }

  /// The words beside points of the picture: [{name, x, y}].
  get labels() {
    const list = this.state.show.names ? this.replay.bodies.slice(1, 201) : [];
    return list.map((body) => ({name: body.name, ...this.project(body.name)})).filter((label) => label.inFront);
  }

  tick(now) {
    requestAnimationFrame((next) => this.tick(next));
    if (this.state.playing) this.advance(now);
    if (!this.dirty) return;
    this.dirty = false;
    this.renderNow();
    this.panel.update(this.state);
    this.panel.showLabels(this.labels);
    this.showScale();
    if (this.state.show.curves) this.curves.draw(this.state.at);
    ++this.rendered;
  }

  /// Ray from the camera through the pointer.
  rayAt({clientX, clientY}) {
    const box = this.canvas.getBoundingClientRect(), ray = new THREE.Raycaster();
    ray.setFromCamera({x: (clientX - box.left) / box.width * 2 - 1, y: 1 - (clientY - box.top) / box.height * 2},
                      this.stage.camera);
    return ray;
  }

  listenToPointer() {
    const pick = (event) => this.bodies.pick(this.rayAt(event));
    let down = null;
    this.canvas.addEventListener('pointerdown', (event) => { down = [event.clientX, event.clientY]; });
    this.canvas.addEventListener('pointerup', (event) => {
      if (down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) < 5) this.select(pick(event)?.body ?? -1);
      down = null;
    });
    this.canvas.addEventListener('pointermove', (event) => {
      if (event.buttons || event.pointerType === 'touch') return this.panel.showTip('');
      const shape = pick(event);
      const hovered = shape && shape.body > 0 ? shape.body : -1;
      if (hovered !== this.state.hovered) {
        this.state.hovered = hovered;
        this.redraw();
      }
      this.panel.showTip(shape ? shape.name : '', event.clientX, event.clientY);
    });
    this.canvas.addEventListener('pointerleave', () => this.panel.showTip(''));
  }

  start() {
    this.rendered = 0;
    this.standard = this.replay.shown_curves;
    for (const name of this.standard) this.curves.add(name);
    if (this.ghost && this.replay.bodies.length === 2) this.curves.addBody(1);  // to compare it with its ghost
    this.listenToPointer();
    listen(this);
    this.stage.controls.addEventListener('change', () => this.redraw());
    window.addEventListener('resize', () => this.fit());
    window.addEventListener('hashchange', () => this.applyLink(links.read(location.hash)));
    this.update();
    this.resetView();
    const link = links.read(location.hash);
    this.applyLink(link);
    capture(this, link);
    this.last = performance.now();
    requestAnimationFrame((now) => this.tick(now));
  }
}
