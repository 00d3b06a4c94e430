// Decodes the data that apps/view/replay.cc wrote into the page (docs/reference/replay.md, Format)
// into arrays of numbers.
import {unzlibSync} from 'fflate';

const kPose = 7;  // x y z [m], qw qx qy qz

function bytesOfBase64(text) {
  const raw = atob(text);
  const bytes = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; ++i) bytes[i] = raw.charCodeAt(i);
  return bytes;
}

/// Returns the bytes of a packed block.
export function unpack(text) {
  return unzlibSync(bytesOfBase64(text));
}

/// Reads signed integers from a packed block: seven bits a byte, the sign in the lowest bit.
export class IntegerReader {
  constructor(text) {
    this.bytes = unpack(text);
    this.at = 0;
  }
  next() {
    // Multiplications instead of shifts, since values may need more than 32 bits.
    let value = 0, scale = 1, byte;
    do {
      byte = this.bytes[this.at++];
      value += (byte & 127) * scale;
      scale *= 128;
    } while (byte & 128);
    return value % 2 === 0 ? value / 2 : -(value + 1) / 2;
  }
  /// Reads `count` values from their second differences and calls put(index, value) for each.
  smooth(count, put) {
    let last = 0, slope = 0;
    for (let k = 0; k < count; ++k) {
      const step = k === 0 ? this.next() : (slope += this.next());
      last += step;
      if (k === 0) slope = 0;
      put(k, last);
    }
  }
  /// Reads `count` values from their first differences.
  steps(count, put) {
    let last = 0;
    for (let k = 0; k < count; ++k) put(k, last += this.next());
  }
}

function floats(text, Type) {
  const bytes = unpack(text);
  return new Type(bytes.buffer, bytes.byteOffset, bytes.byteLength / Type.BYTES_PER_ELEMENT);
}

function decodePoses(motion, bodies) {
  const {frames, position_resolution_m: position, quaternion_resolution: turn} = motion;
  const reader = new IntegerReader(motion.poses);
  const stride = bodies * kPose;
  const poses = new Float32Array(frames * stride);
  for (let b = 1; b < bodies; ++b) {
    for (let c = 0; c < kPose; ++c) {
      const unit = c < 3 ? position : turn;
      const start = b * kPose + c;
      reader.smooth(frames, (k, value) => poses[k * stride + start] = value * unit);
    }
  }
  for (let k = 0; k < frames; ++k) poses[k * stride + 3] = 1;  // the world
  return poses;
}

/// Flags by frame and item, stored by first differences.
function decodeFlags(text, frames, items) {
  const flags = new Uint8Array(frames * items);
  if (!text) return flags;
  const reader = new IntegerReader(text);
  for (let i = 0; i < items; ++i) reader.steps(frames, (k, value) => flags[k * items + i] = value);
  return flags;
}

export class Motion {
  constructor(packed, bodies, trees) {
    this.name = packed.name;
    this.frames = packed.frames;
    this.bodies = bodies;
    this.trees = trees;
    this.time = floats(packed.time, Float64Array);
    this.poses = decodePoses(packed, bodies);
    this.asleep = decodeFlags(packed.asleep, this.frames, trees);
    this.atLimit = decodeFlags(packed.at_limit, this.frames, bodies);
  }
  get start() { return this.time[0]; }
  get end() { return this.time[this.frames - 1]; }
  /// The last frame at or before a time [s], and the fraction of the way to the next (0 ... 1).
  at(time) {
    let low = 0, high = this.frames - 1;
    if (time <= this.time[0]) return {frame: 0, share: 0};
    if (time >= this.time[high]) return {frame: high, share: 0};
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.time[middle] <= time) low = middle; else high = middle;
    }
    return {frame: low, share: (time - this.time[low]) / (this.time[high] - this.time[low])};
  }
  /// Writes x y z qw qx qy qz of a body to `out`, interpolated linearly between frames with the
  /// quaternion normalized.
  pose(body, {frame, share}, out) {
    const stride = this.bodies * kPose;
    const a = frame * stride + body * kPose;
    const b = share > 0 ? a + stride : a;
    for (let c = 0; c < kPose; ++c)
      out[c] = this.poses[a + c] + share * (this.poses[b + c] - this.poses[a + c]);
    const length = Math.hypot(out[3], out[4], out[5], out[6]) || 1;
    for (let c = 3; c < kPose; ++c) out[c] /= length;
    return out;
  }
}

/// Contact forces by frame: position [m] and force [N] of each, and the pair of shapes; `most` of a frame.
export class Contacts {
  constructor(packed, frames) {
    this.pairs = packed.pairs;
    this.first = new Uint32Array(frames + 1);
    const tracks = [], reader = new IntegerReader(packed.data);
    for (let i = 0; i < packed.tracks; ++i) {
      const track = {pair: reader.next(), start: reader.next(), count: reader.next(), values: null};
      track.values = new Float32Array(6 * track.count);
      for (let c = 0; c < 6; ++c) {
        const unit = c < 3 ? packed.position_resolution_m : packed.force_resolution_N;
        reader.steps(track.count, (k, value) => track.values[6 * k + c] = value * unit);
      }
      for (let k = 0; k < track.count; ++k) ++this.first[track.start + k + 1];
      tracks.push(track);
    }
    for (let k = 0; k < frames; ++k) this.first[k + 1] += this.first[k];
    this.values = new Float32Array(6 * this.first[frames]);
    this.pair = new Uint32Array(this.first[frames]);
    const fill = this.first.slice();
    for (const track of tracks) {
      for (let k = 0; k < track.count; ++k) {
        const slot = fill[track.start + k]++;
        this.pair[slot] = track.pair;
        this.values.set(track.values.subarray(6 * k, 6 * k + 6), 6 * slot);
      }
    }
    this.typical = typicalForce(this.values);
    this.most = this.first.subarray(1).reduce((most, end, k) => Math.max(most, end - this.first[k]), 0);
  }
}

/// The 90 % quantile of the forces [N], by which arrows are scaled.
function typicalForce(values) {
  const sizes = [];
  const stride = 6 * Math.max(1, Math.floor(values.length / 6 / 20000));
  for (let i = 0; i < values.length; i += stride)
    sizes.push(Math.hypot(values[i + 3], values[i + 4], values[i + 5]));
  sizes.sort((a, b) => a - b);
  return sizes[Math.floor(0.9 * sizes.length)] || 1;
}

/// A ghost's curve takes the colour of the first curve of its group.
function decodeCurves(packed, frames) {
  if (!packed) return [];
  const reader = new IntegerReader(packed.data);
  return packed.list.map((entry) => {
    const values = new Float64Array(frames);
    reader.smooth(frames, (k, value) => values[k] = entry.offset + value * entry.resolution);
    return {...entry, values, like: entry.ghost === undefined ? undefined : 0};
  });
}

/// Decodes a motion with the forces and curves that belong to it; null: it has no such forces.
export function decodeMotion(packed, {contacts, closure_forces, curves}, bodies, trees, Kind = Motion) {
  const motion = new Kind(packed, bodies, trees), {frames} = motion;
  return {
    motion, contacts: contacts ? new Contacts(contacts, frames) : null,
    closureForces: closure_forces ? new Contacts(closure_forces, frames) : null, curves: decodeCurves(curves, frames),
  };
}

/// Kind: the class of the motions.
export function decode(packed, Kind = Motion) {
  const {trees} = packed, bodies = packed.bodies.length, [first, ...ghosts] = packed.motions;
  const {motion, ...forces} = decodeMotion(first, packed, bodies, trees, Kind);
  return {
    ...packed, ...forces, motions: [motion, ...ghosts.map((ghost) => new Kind(ghost, bodies, trees))],
    meshes: packed.meshes.map((mesh) => ({
      vertices: floats(mesh.vertices, Float32Array), triangles: floats(mesh.triangles, Uint32Array),
    })),
  };
}
