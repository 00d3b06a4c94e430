// The view of a simulation that runs: time follows the newest frame, and actions are sent to the server.
import * as THREE from 'three';
import {Curves} from './curves.js';
import {Drag, HandMarks} from './drag.js';
import {text} from './dom.js';
import {Connection, decodeFrame} from './live.js';
import {LivePanel} from './live_panel.js';
import {View} from './view.js';

const kGhostBehind = 0.2;  // the longest time that the view waits for the ghost [s]
const kRedrawn = 60;  // time between two drawings of the curves [ms]

/// Curves of the last ten seconds, or of as many as the wheel has chosen.
class LiveCurves extends Curves {
  last = 0;
  version = 0;
  get range() { return this.shown ?? this.all; }

  draw(at) {
    const {motion} = this, wait = this.last + kRedrawn - performance.now();
    if (wait <= 0) {
      this.last = performance.now();
      this.version = motion.version;
      const width = this.zoomed ? this.zoomed[1] - this.zoomed[0] : 10;
      const start = Math.max(motion.start, Math.min(motion.time[at.frame] - 0.1 * width, motion.end - width));
      this.shown = [start, start + width];
    } else {
      this.timer ??= setTimeout(() => {
        this.timer = undefined;
        this.changed?.();
      }, wait);
    }
    super.draw(at);
  }
}

export class LiveView extends View {
  static Curves = LiveCurves;

  constructor(replay) {
    super(replay);
    this.isFollowing = true;  // the newest frame
    this.hand = null;
    this.live = new Connection({bytes: (bytes) => this.take(decodeFrame(bytes)), status: (status) => this.note(status),
                                say: (words) => this.panel.say(words), there: (isThere) => this.serverIs(isThere)});
    this.handMarks = new HandMarks(replay, this.forceScale, this.stage.scene);
    this.drag = new Drag(this);
    this.livePanel = new LivePanel(replay, this.panel, this);
  }

  start() {
    super.start();
    this.curves.showGhost(-1);
    this.live.open();
  }

  get status() { return this.live.status; }
  get isDriving() { return Boolean(this.status?.driver); }
  get canDrag() { return this.isDriving && this.isFollowing; }

  get ghostIsThere() { return this.curves.ghost === 0 && !this.replay.motions[1].fresh; }
  /// The time to show [s]: of the newest frame, or of the ghost's if that is not far behind, so that
  /// both can be compared.
  get latest() {
    const [{end}, ghost] = this.replay.motions;
    return this.ghostIsThere && ghost.end > end - kGhostBehind ? Math.min(ghost.end, end) : end;
  }

  // --- from the server

  serverIs(isThere) {
    for (const motion of this.replay.motions) motion.fresh = true;
    if (!isThere) this.state.playing = false;
    this.livePanel.serverIs(isThere);
    this.redraw();
  }

  take(frame) {
    const [motion, ghost] = this.replay.motions, {curves} = this.replay;
    const fits = frame.poses.length === 7 * motion.bodies && frame.asleep.length === motion.trees &&
                 (frame.isGhost || frame.curves.length === curves.length);
    if (!fits) return this.panel.say('the server shows another scene: load the page again');
    (frame.isGhost ? ghost : motion).append(frame);
    if (!frame.isGhost) this.newest = frame;
    if (this.replay.live.watch) this.state.playing = this.isFollowing;
    this.hasNews = true;
  }

  note(status) {
    const {state} = this, ghost = this.replay.motions[1];
    const playing = status.playing && this.isFollowing;
    if (state.playing !== playing || state.speed !== status.speed) this.redraw();
    Object.assign(state, {playing, speed: status.speed});
    this.motion.oldest = status.history?.start ?? -Infinity;
    const index = status.ghost?.on ? 0 : -1;
    if (index !== this.curves.ghost) {
      ghost.fresh = true;
      this.curves.showGhost(index);
    }
    this.livePanel.update(status);
  }

  // --- to the server

  /// Sends a command if this page drives; returns whether it does.
  command(message) {
    if (this.isDriving) this.live.send(message);
    else this.panel.say(this.status ? 'another page drives; the button “drive” takes over' : 'the server is gone');
    return this.isDriving;
  }

  /// Sends a command that goes on from the time shown: later frames are undone first.
  goOn(message) {
    if (!this.isDriving && !this.isFollowing) return this.seekEnd();
    if (this.isDriving && !this.isFollowing) {
      this.live.send({do: 'rewind', time: this.time});
      this.motion.cut(this.time);
      this.seekEnd();
    }
    this.command(message);
  }

  togglePlay() {
    if (this.replay.live.watch) return this.isFollowing ? this.stop() : this.seekEnd();
    this.state.playing ? this.command({do: 'pause'}) : this.goOn({do: 'play'});
  }
  /// Stays at the present time while frames come.
  stop() {
    this.isFollowing = this.state.playing = false;
    this.redraw();
  }
  step(direction) {
    if (direction < 0 || this.replay.live.watch) super.step(direction);
    else this.goOn({do: 'step', count: 1});
  }
  seek(time) {
    if (this.state.playing && this.isDriving) this.live.send({do: 'pause'});
    this.isFollowing = time >= this.motion.end;
    this.state.playing = false;
    this.setTime(time);
  }
  seekEnd() {
    this.isFollowing = true;
    this.setTime(this.motion.end);
  }
  advance() {}  // the server does
  toggleLoop() {}
  setSpeed(speed) {
    if (this.command({do: 'speed', value: speed})) super.setSpeed(speed);
  }
  reset() { if (this.command({do: 'reset'})) this.seekEnd(); }
  save() { if (this.command({do: 'save'})) this.panel.say('state saved'); }
  /// slot: number of the saved state, by default the last.
  restore(slot = (this.status?.saved?.length ?? 0) - 1) {
    if (slot < 0) return this.panel.say('no state is saved');
    if (this.command({do: 'restore', slot})) this.seekEnd();
  }
  record() { this.command({do: 'record', on: !this.status?.recording?.on}); }
  drive() { this.live.send({do: 'drive'}); }

  get ownKeys() { return {b: () => this.reset(), s: () => this.save(), y: () => this.restore()}; }
  get keyRows() {
    return [['space →', 'play or pause, one step; from an earlier time, what came after is undone'],
            ['B', 'back to the start'], ['S Y', 'save, restore the last saved state'],
            ['drag a body', 'pull it; with Ctrl: turn it']];
  }

  // --- drawing

  tick(now) {
    if (this.hasNews) this.setTime(this.isFollowing ? this.latest : this.time);
    this.hasNews = false;
    this.drag.update();
    this.live.flush();
    super.tick(now);
  }

  /// The hand of the newest frame: {point [m], force [N] or torque [N m], turns}; null if it holds nothing.
  get held() {
    if (!this.isFollowing || !this.newest?.held) return null;
    const {hand} = this.newest, turns = this.drag.gesture?.turns ?? this.status?.hand?.torque_Nm !== undefined;
    return {point: [...hand.subarray(0, 3)], force: [...hand.subarray(3)], turns};
  }

  update() {
    super.update();
    this.ghost.group.visible = this.state.show.ghost && this.ghostIsThere;
    const {gesture} = this.drag;
    this.handMarks.update(this.held, gesture?.began && !gesture.turns ? this.drag.target : null);
  }

  /// While a body is dragged the camera stands still: otherwise the pointer would run away with a
  /// body that is followed.
  keepUp() {
    const {follow} = this.state;
    if (!this.drag.gesture) super.keepUp();
    else if (follow)
      this.anchor = new THREE.Vector3().setFromMatrixPosition(this.bodies.matrices[this.names.get(follow)]);
  }

  get labels() {
    const {label} = this.handMarks;
    if (!label) return super.labels;
    const {x, y} = this.stage.project(label.point.toArray());
    return [...super.labels, {name: label.name, x: x + 10, y}];
  }

  async copyCommand() {
    const words = this.status?.command ?? '';
    try {
      await navigator.clipboard.writeText(words);
      this.panel.say('command copied');
    } catch {
      this.livePanel.showCommand(words);
    }
  }

  /// The bar's words on the hand.
  get handWords() {
    const {hand} = this.status ?? {};
    if (!hand) return '';
    return `${hand.body}: ${hand.torque_Nm === undefined ? `${text(hand.force_N)} N` : `${text(hand.torque_Nm)} N m`}`;
  }
}
