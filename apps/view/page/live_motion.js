// The motion of a live simulation: frames come at its end, and the oldest go when memory is full.
import {Motion, decode} from './data.js';

const kBytes = 48e6;  // memory of a motion's frames [bytes]
const kFrames = 6000;

/// A list of numbers that grows at its end.
class Rows {
  constructor(Type, values) {
    this.room = new Type(Math.max(64, values.length));
    this.length = 0;
    this.push(values);
  }
  get bytes() { return this.length * this.room.BYTES_PER_ELEMENT; }
  push(values) {
    const length = this.length + values.length;
    if (length > this.room.length) {
      const room = new this.room.constructor(2 * length);
      room.set(this.room.subarray(0, this.length));
      this.room = room;
    }
    this.room.set(values, this.length);
    this.length = length;
  }
  /// Keeps the numbers from `from` to `to`.
  keep(from, to) {
    this.room.copyWithin(0, from, to);
    this.length = to - from;
  }
}

/// Forces by frame, with the fields of Contacts (data.js); further forces than `most` are left out.
export class LiveContacts {
  constructor(most, typical) {
    Object.assign(this, {most, typical, pair: [], ends: new Rows(Uint32Array, [0]), rows: new Rows(Float32Array, [])});
    this.push([]);
  }
  get first() { return this.ends.room; }
  get values() { return this.rows.room; }
  get bytes() { return this.ends.bytes + this.rows.bytes; }
  push(values) {
    this.rows.push(values.slice(0, 6 * this.most));
    this.ends.push([this.rows.length / 6]);
  }
  keep(from, to) {
    const begin = this.first[from];
    this.rows.keep(6 * begin, 6 * this.first[to]);
    this.ends.keep(from, to + 1);
    for (let k = 0; k < this.ends.length; ++k) this.first[k] -= begin;
  }
}

/// Size [N] below which 90 % of the forces lie; 0 if there are none.
function usualForce(...lists) {
  const sizes = lists.flatMap((list) => Array.from(
    {length: Math.min(list.length / 6, 500)}, (_, i) => Math.hypot(list[6 * i + 3], list[6 * i + 4], list[6 * i + 5])));
  return sizes.sort((a, b) => a - b)[Math.floor(0.9 * sizes.length)] ?? 0;
}

export class LiveMotion extends Motion {
  constructor(packed, bodies, trees) {
    super(packed, bodies, trees);
    this.version = 0;
    this.fresh = false;  // the next frame begins a new history
    this.oldest = -Infinity;  // the oldest time to which the server can return [s]
    this.curves = new Float32Array(0);
    this.forces = {};
    this.rows = {};
    for (const [name, Type] of Object.entries({time: Float64Array, poses: Float32Array, asleep: Uint8Array,
                                               atLimit: Uint8Array, curves: Float32Array}))
      this.rows[name] = new Rows(Type, this[name]);
    this.share();
  }

  get start() { return Math.min(Math.max(this.time[0], this.oldest), this.end); }

  share() {
    for (const [name, rows] of Object.entries(this.rows)) this[name] = rows.room;
    ++this.version;
  }

  /// Keeps the frames from `from` to `to`.
  keep(from, to) {
    for (const rows of Object.values(this.rows)) {
      const width = rows.length / this.frames;
      rows.keep(width * from, width * to);
    }
    for (const forces of Object.values(this.forces)) forces.keep(from, to);
    this.frames = to - from;
    this.share();
  }

  /// Undoes the frames after a time [s]; one always stays.
  cut(time) {
    let frames = this.frames;
    while (frames > 1 && this.time[frames - 1] > time) --frames;
    if (frames < this.frames) this.keep(0, frames);
  }

  /// Adds a frame (live.js); it undoes the frames at and after its time.
  append(frame) {
    const {frames} = this, lists = [...Object.values(this.rows), ...Object.values(this.forces)];
    let kept = this.fresh ? 0 : frames;
    while (kept > 0 && this.time[kept - 1] >= frame.time) --kept;
    const full = kept >= kFrames || lists.reduce((sum, list) => sum + list.bytes, 0) > kBytes;
    const from = full ? kept >> 1 : 0;
    if (from > 0 || kept < frames) this.keep(from, kept);
    for (const name of Object.keys(this.rows)) this.rows[name].push(name === 'time' ? [frame.time] : frame[name]);
    for (const name of Object.keys(this.forces)) this.forces[name].push(frame[name]);
    this.fresh = false;
    ++this.frames;
    this.share();
    this.adapt(usualForce(...Object.keys(this.forces).map((name) => frame[name]), frame.held ? frame.hand : []));
  }

  /// Moves the typical force of the arrows towards a size [N], within half a second at 60 frames a
  /// second, so that an impact does not shorten all arrows at once.
  adapt(size) {
    const {contacts} = this.forces;
    if (contacts && size > 0 && Number.isFinite(size)) contacts.typical *= (size / contacts.typical) ** 0.03;
  }
}

/// Decodes the data of a live page: the motion has one frame, and a second motion is the finer run.
export function decodeLive(packed) {
  const [start] = packed.motions;
  const replay = decode({...packed, motions: [start, {...start, name: 'a finer time step'}]}, LiveMotion);
  const [motion] = replay.motions, {bodies, closures, curves} = replay;
  // A first scale of the arrows: the weight of a body.
  const weight = 9.81 * bodies.reduce((sum, body) => sum + body.mass, 0) / Math.max(1, bodies.length - 1) || 1;
  replay.contacts = new LiveContacts(Math.min(4096, 64 + 48 * bodies.length), weight);
  replay.closureForces = closures.length ? new LiveContacts(closures.length, weight) : null;
  motion.forces = {contacts: replay.contacts, ...replay.closureForces && {closures: replay.closureForces}};
  motion.rows.curves.push(curves.map((curve) => curve.values[0]));
  motion.share();
  replay.curves = curves.map((curve, i) => (
    {...curve, values: null, read: (frame) => motion.curves[frame * curves.length + i]}));
  return replay;
}
