// Marks beside the bodies: contact forces, centre of mass, frames, joints at limits, closures.
import * as THREE from 'three';

const kForce = '#e4402c', kCut = '#f2a07e', kPoint = '#7a1d12', kLimit = '#c2289d', kClosure = '#7d4fd1';
export const kPull = ['#4a1fa8', '#9d86d8', '#2c1266'];
const kUp = new THREE.Vector3(0, 0, 1);

/// Length that scales the marks [m]: the radius of the scene, or less if its bodies are small.
export function markSize(replay) { return Math.min(replay.radius, 7 * replay.body_radius); }

export function instanced(geometry, material, capacity, scene) {
  const mesh = new THREE.InstancedMesh(geometry, material, Math.max(1, capacity));
  mesh.frustumCulled = false;
  mesh.count = 0;
  scene.add(mesh);
  return mesh;
}

/// Length of arrows, with one scale for all: a typical force is a third of the size of marks.
export class ForceScale {
  constructor(replay) {
    this.size = markSize(replay);
    this.enlarge = 1;
    this.forces = replay.contacts ?? replay.closureForces;
  }
  /// A typical force [N]; it changes in a live simulation.
  get typical() { return this.forces?.typical; }
  /// Scale [m/N].
  get scale() { return this.enlarge * 0.33 * this.size / this.typical; }
  /// Longer arrows are cut to this length [m] and drawn paler.
  get longest() { return 1.2 * this.size; }
}

/// Arrows of contacts or closures.
export class Forces {
  /// colors: of whole arrows, of cut arrows, of points.
  constructor(contacts, scale, scene, [whole, cut, point] = [kForce, kCut, kPoint]) {
    this.contacts = contacts;
    this.of = scale;
    this.shown = [];
    if (!this.contacts) return;
    this.color = whole;
    const {most} = this.contacts;
    this.most = most;
    const material = () => new THREE.MeshStandardMaterial({roughness: 0.5, emissive: point,
                                                           emissiveIntensity: 0.35});
    const many = most > 400;  // with many arrows each is drawn with fewer triangles
    const shaft = new THREE.CylinderGeometry(1, 1, 1, many ? 5 : 12, 1, many).rotateX(Math.PI / 2).translate(0, 0, 0.5);
    const head = new THREE.ConeGeometry(1, 1, many ? 6 : 16).rotateX(Math.PI / 2).translate(0, 0, 0.5);
    this.shafts = instanced(shaft, material(), most, scene);
    this.heads = instanced(head, material(), most, scene);
    this.points = instanced(many ? new THREE.OctahedronGeometry(1) : new THREE.SphereGeometry(1, 12, 8),
                            new THREE.MeshBasicMaterial({color: point}), most, scene);
    for (const mesh of [this.shafts, this.heads]) mesh.castShadow = !many;
    this.behind = [this.shafts, this.heads].map((mesh) => this.seenThrough(mesh, most, scene));
    this.colors = [new THREE.Color(whole), new THREE.Color(cut)];
  }

  /// Draws the same arrows again, faintly and in front of everything, so that those inside bodies
  /// stay visible.
  seenThrough(mesh, capacity, scene) {
    const material = new THREE.MeshBasicMaterial({color: this.color, transparent: true, opacity: 0.22, depthTest: false,
                                                  depthWrite: false});
    const faint = instanced(mesh.geometry, material, capacity, scene);
    faint.instanceMatrix = mesh.instanceMatrix;
    faint.renderOrder = 2;
    return faint;
  }

  update(frame, {forces, points}) {
    this.shown = [];
    if (!this.contacts) return;
    const {first, values} = this.contacts;
    const begin = first[frame], count = forces || points ? Math.min(first[frame + 1] - begin, this.most) : 0;
    const matrix = new THREE.Matrix4(), place = new THREE.Vector3(), force = new THREE.Vector3();
    const turn = new THREE.Quaternion(), stretch = new THREE.Vector3();
    const thick = 0.009 * this.of.size;
    for (let i = 0; i < count; ++i) {
      const at = 6 * (begin + i);
      place.fromArray(values, at);
      force.fromArray(values, at + 3);
      const size = force.length(), wanted = size * this.of.scale;
      const length = Math.min(wanted, this.of.longest), tip = Math.min(0.4 * length, 4.5 * thick);
      const width = Math.min(thick, 0.12 * length);
      turn.setFromUnitVectors(kUp, force.divideScalar(size || 1));
      this.shafts.setMatrixAt(i, matrix.compose(place, turn, stretch.set(width, width, length - tip)));
      this.points.setMatrixAt(i, matrix.compose(place, turn, stretch.setScalar(1.3 * thick)));
      place.addScaledVector(force, length - tip);
      this.heads.setMatrixAt(i, matrix.compose(place, turn, stretch.set(2.4 * width, 2.4 * width, tip)));
      const color = this.colors[wanted > length ? 1 : 0];
      this.shafts.setColorAt(i, color);
      this.heads.setColorAt(i, color);
      this.shown.push({pair: this.contacts.pair[begin + i], size, position: [...values.subarray(at, at + 3)]});
    }
    for (const mesh of [this.shafts, this.heads, this.points]) {
      mesh.count = count;
      mesh.instanceMatrix.needsUpdate = true;
      if (mesh.instanceColor) mesh.instanceColor.needsUpdate = true;
      mesh.visible = mesh === this.points ? points : forces;
    }
    for (const mesh of this.behind) Object.assign(mesh, {count, visible: forces});
  }
}

export class CentreOfMass {
  constructor(replay, scene) {
    this.bodies = replay.bodies;
    this.mass = replay.bodies.reduce((sum, body) => sum + body.mass, 0);
    this.mark = new THREE.Mesh(new THREE.SphereGeometry(0.03 * markSize(replay), 16, 12),
                               new THREE.MeshBasicMaterial({color: '#ffb000', depthTest: false,
                                                            transparent: true, opacity: 0.9}));
    this.mark.renderOrder = 5;
    scene.add(this.mark);
  }
  update(matrices, visible) {
    this.mark.visible = visible && this.mass > 0;
    const point = new THREE.Vector3();
    this.mark.position.set(0, 0, 0);
    this.bodies.forEach((body, i) => {
      if (body.mass > 0)
        this.mark.position.addScaledVector(point.fromArray(body.com).applyMatrix4(matrices[i]),
                                           body.mass / this.mass);
    });
  }
}

/// Bodies without shapes: a rod from the joint to the body's centre of mass, another from the
/// parent's joint to it, and a ball at the centre of mass.
export class Sticks {
  constructor(replay, group) {
    const bodies = (wanted) => new Set(replay.shapes.filter(wanted).map((shape) => shape.body));
    const shaped = bodies((shape) => !shape.visual);
    this.thick = 0.012 * markSize(replay);
    // Visuals smaller than the rod's ball would not be seen, so these bodies keep the rod.
    this.seen = bodies((shape) => shape.visual && (shape.mesh !== undefined || Math.max(...shape.size) > 3 * this.thick));
    this.list = replay.bodies.map((body, i) => ({...body, i})).filter(({i}) => i > 0 && !shaped.has(i));
    const material = new THREE.MeshStandardMaterial({color: '#8fa5bd', roughness: 0.6});
    const rod = new THREE.CylinderGeometry(1, 1, 1, 10).rotateX(Math.PI / 2).translate(0, 0, 0.5);
    this.rods = instanced(rod, material, 2 * this.list.length, group);
    this.balls = instanced(new THREE.SphereGeometry(3 * this.thick, 20, 14), material, this.list.length, group);
    for (const mesh of [this.rods, this.balls]) mesh.castShadow = true;
  }

  rod(slot, from, to, matrix) {
    const along = to.clone().sub(from), length = Math.max(along.length(), 1e-9);
    const turn = new THREE.Quaternion().setFromUnitVectors(kUp, along.divideScalar(length));
    this.rods.setMatrixAt(slot, matrix.compose(from, turn, new THREE.Vector3(this.thick, this.thick, length)));
  }

  /// visuals: visuals are shown, so that bodies with one need no rod.
  update(matrices, visuals) {
    const matrix = new THREE.Matrix4();
    const list = visuals ? this.list.filter((body) => !this.seen.has(body.i)) : this.list;
    list.forEach((body, slot) => {
      const joint = new THREE.Vector3().setFromMatrixPosition(matrices[body.i]);
      const centre = new THREE.Vector3().fromArray(body.com).applyMatrix4(matrices[body.i]);
      const parent = body.parent > 0 ? new THREE.Vector3().setFromMatrixPosition(matrices[body.parent]) : joint;
      this.rod(2 * slot, joint, centre, matrix);
      this.rod(2 * slot + 1, parent, joint, matrix);
      this.balls.setMatrixAt(slot, matrix.makeTranslation(centre));
    });
    // Items as in bodies.js, so that the pointer finds these bodies too.
    this.balls.userData.items = list.map(({i, name}) => ({shape: {body: i, name}}));
    this.rods.userData.items = this.balls.userData.items.flatMap((item) => [item, item]);
    for (const mesh of [this.rods, this.balls]) {
      mesh.count = mesh.userData.items.length;
      mesh.instanceMatrix.needsUpdate = true;
      mesh.boundingSphere = null;
    }
  }
}

/// Axes of every body frame: x red, y green, z blue.
export class Frames {
  constructor(replay, scene) {
    const length = 0.09 * markSize(replay);
    this.lines = ['#e0442f', '#2fa84f', '#2f6fe0'].map((color, axis) => {
      const end = [0, 0, 0];
      end[axis] = length;
      const geometry = new THREE.CylinderGeometry(0.05 * length, 0.05 * length, length, 6);
      if (axis === 0) geometry.rotateZ(-Math.PI / 2);
      if (axis === 2) geometry.rotateX(Math.PI / 2);
      geometry.translate(...end.map((x) => x / 2));
      const material = new THREE.MeshBasicMaterial({color, depthTest: false, transparent: true});
      const mesh = instanced(geometry, material, replay.bodies.length, scene);
      mesh.renderOrder = 4;
      return mesh;
    });
  }
  update(matrices, visible) {
    for (const mesh of this.lines) {
      mesh.visible = visible;
      mesh.count = matrices.length;
      if (!visible) continue;
      matrices.forEach((matrix, i) => mesh.setMatrixAt(i, matrix));
      mesh.instanceMatrix.needsUpdate = true;
    }
  }
}

/// Rings around joints at a limit.
export class Limits {
  constructor(replay, motion, scene) {
    this.motion = motion;
    const size = 0.032 * markSize(replay);
    this.rings = instanced(new THREE.TorusGeometry(size, 0.14 * size, 8, 24),
                           new THREE.MeshBasicMaterial({color: kLimit, depthTest: false, transparent: true}),
                           motion.bodies, scene);
    this.rings.renderOrder = 3;
  }
  update(frame, matrices, camera, visible) {
    let count = 0;
    const matrix = new THREE.Matrix4();
    for (let body = 1; visible && body < this.motion.bodies; ++body) {
      if (!this.motion.atLimit[frame * this.motion.bodies + body]) continue;
      matrix.makeRotationFromQuaternion(camera.quaternion).copyPosition(matrices[body]);
      this.rings.setMatrixAt(count++, matrix);
    }
    this.rings.count = count;
    this.rings.instanceMatrix.needsUpdate = true;
  }
}

/// A rod between the anchors of each closure, with a ball at either end.
export class Closures {
  constructor(replay, scene) {
    this.closures = replay.closures;
    const material = new THREE.MeshBasicMaterial({color: kClosure});
    this.thick = 0.008 * markSize(replay);
    this.rods = instanced(new THREE.CylinderGeometry(1, 1, 1, 8).rotateX(Math.PI / 2).translate(0, 0, 0.5),
                          material, this.closures.length, scene);
    this.balls = instanced(new THREE.SphereGeometry(2 * this.thick, 12, 8), material,
                           2 * this.closures.length, scene);
  }
  update(matrices, visible) {
    const a = new THREE.Vector3(), b = new THREE.Vector3(), matrix = new THREE.Matrix4();
    const turn = new THREE.Quaternion(), along = new THREE.Vector3();
    this.closures.forEach((closure, i) => {
      a.fromArray(closure.anchor_a).applyMatrix4(matrices[closure.body_a]);
      b.fromArray(closure.anchor_b).applyMatrix4(matrices[closure.body_b]);
      this.balls.setMatrixAt(2 * i, matrix.makeTranslation(a));
      this.balls.setMatrixAt(2 * i + 1, matrix.makeTranslation(b));
      along.subVectors(b, a);
      const length = Math.max(along.length(), 1e-9);
      turn.setFromUnitVectors(kUp, along.divideScalar(length));
      this.rods.setMatrixAt(i, matrix.compose(a, turn, new THREE.Vector3(this.thick, this.thick, length)));
    });
    const count = visible ? this.closures.length : 0;
    this.rods.count = count;
    this.balls.count = 2 * count;
    this.rods.instanceMatrix.needsUpdate = this.balls.instanceMatrix.needsUpdate = true;
  }
}
