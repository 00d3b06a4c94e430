// Bodies with their shapes: one InstancedMesh for all shapes of a kind, so that a thousand boxes
// take one draw call.
import * as THREE from 'three';

const kPalette = ['#d9a441', '#4fa39a', '#8c9d4c', '#a281b8', '#c27f5c', '#6f9fc0', '#c06f8b', '#7f8a99'];
const kRobot = ['#8fa5bd', '#c5d0da', '#a9b9ca'];
const kWorld = '#a7adb4';

/// A white texture with marks in a paler tone, which make rotations visible.
function marks(draw) {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 256;
  const context = canvas.getContext('2d');
  context.fillStyle = '#fff';
  context.fillRect(0, 0, 256, 256);
  draw(context);
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.anisotropy = 4;
  return texture;
}

const kChecks = () => marks((c) => {
  c.fillStyle = '#d3d7dc';
  for (let i = 0; i < 8; ++i)
    for (let j = 0; j < 4; ++j) if ((i + j) % 2) c.fillRect(32 * i, 64 * j, 32, 64);
});

/// Darkens the edges of a box by lines of a fixed width in pixels, independent of the size of the
/// face.
function drawEdges(shader) {
  shader.fragmentShader = shader.fragmentShader.replace('#include <map_fragment>', `#include <map_fragment>
    vec2 fromEdge = min(vMapUv, 1.0 - vMapUv) / fwidth(vMapUv);
    diffuseColor.rgb *= mix(0.55, 1.0, smoothstep(0.7, 1.8, min(fromEdge.x, fromEdge.y)));`);
}

/// Turns the axis of a geometry from y (three.js) to z (the engine).
function alongZ(geometry) { return geometry.rotateX(Math.PI / 2); }

function meshGeometry(mesh) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(mesh.vertices, 3));
  geometry.setIndex(new THREE.BufferAttribute(mesh.triangles, 1));
  geometry.computeVertexNormals();
  return geometry;
}

/// The kind of a shape: the geometry it shares, its scale and its texture.
function kindOf(shape, replay, given) {
  const [x, y, z] = shape.size;
  switch (shape.type) {
    case 'sphere':
      return {key: 'sphere', make: () => alongZ(new THREE.SphereGeometry(1, 32, 20)),
              scale: [x, x, x], map: kChecks};
    case 'box':
      return {key: 'box', make: () => new THREE.BoxGeometry(2, 2, 2), scale: [x, y, z], map: () => marks(() => {}), edges: true};
    case 'capsule':
      return {key: `capsule ${x} ${y}`, scale: [1, 1, 1], map: kChecks,
              make: () => alongZ(new THREE.CapsuleGeometry(x, 2 * y, 10, 24))};
    case 'cylinder':
      return {key: 'cylinder', make: () => alongZ(new THREE.CylinderGeometry(1, 1, 2, 40)),
              scale: [x, x, y], map: kChecks};
    case 'mesh':
    case 'terrain': {
      const index = given && shape.given >= 0 ? shape.given : shape.mesh;
      return {key: `mesh ${index}`, make: () => meshGeometry(replay.meshes[index]),
              scale: [1, 1, 1], flat: true, twoSided: shape.type === 'terrain' || given || shape.visual};
    }
    default:
      return null;  // planes: stage.js
  }
}

function localMatrix(shape, scale) {
  const [x, y, z, qw, qx, qy, qz] = shape.pose;
  return new THREE.Matrix4().compose(new THREE.Vector3(x, y, z),
                                     new THREE.Quaternion(qx, qy, qz, qw), new THREE.Vector3(...scale));
}

export class Bodies {
  /// ghost: draws translucent, in one colour, without shadow.
  constructor(replay, motion, scene, ghost) {
    this.replay = replay;
    this.motion = motion;
    this.ghost = ghost;
    this.group = new THREE.Group();
    scene.add(this.group);
    this.matrices = replay.bodies.map(() => new THREE.Matrix4());
    this.items = [];
    this.kinds = new Map();
    this.hidden = new Set(replay.dressed);  // instances that have visuals
    for (const shape of replay.shapes) this.addShape(shape);
    for (const kind of this.kinds.values()) this.finishKind(kind);
    this.show({hull: false, visuals: true, wireframe: false});
  }

  addShape(shape) {
    if (this.ghost && shape.body === 0) return;
    const variants = shape.type === 'mesh' && shape.given >= 0 ? [false, true] : [false];
    for (const given of variants) {
      const kind = kindOf(shape, this.replay, given);
      if (!kind) continue;
      const only = variants.length === 1 ? 'always' : given ? 'given' : 'hull';
      const role = shape.visual ? 'visual' : this.hidden.has(shape.instance) ? 'collision' : 'both';
      const key = `${kind.key} ${only} ${role}`;
      if (!this.kinds.has(key)) this.kinds.set(key, {...kind, only, role, items: []});
      this.kinds.get(key).items.push({shape, local: localMatrix(shape, kind.scale)});
    }
  }

  material(kind) {
    const look = {side: kind.twoSided ? THREE.DoubleSide : THREE.FrontSide,
                  flatShading: Boolean(kind.flat), map: kind.map && !this.ghost ? kind.map() : null};
    if (this.ghost)
      return new THREE.MeshStandardMaterial({...look, color: '#2f7fe6', transparent: true,
                                             opacity: 0.32, depthWrite: false, roughness: 0.9});
    const material = new THREE.MeshStandardMaterial({...look, roughness: 0.62, metalness: 0.05});
    if (kind.edges) material.onBeforeCompile = drawEdges;
    return material;
  }

  finishKind(kind) {
    const mesh = new THREE.InstancedMesh(kind.make(), this.material(kind), kind.items.length);
    mesh.frustumCulled = false;  // instances move, and no common bound is kept
    mesh.castShadow = !this.ghost;
    mesh.receiveShadow = !this.ghost;
    mesh.userData.items = kind.items;
    kind.mesh = mesh;
    kind.items.forEach((item, slot) => Object.assign(item, {mesh, slot}));
    this.items.push(...kind.items);
    this.group.add(mesh);
  }

  /// Selects meshes as given or as hulls, and robots by visuals or by collision shapes.
  show({hull, visuals, wireframe}) {
    Object.assign(this, {hull, visuals, wireframe});
    for (const kind of this.kinds.values()) {
      kind.mesh.material.wireframe = wireframe;
      kind.mesh.visible = (kind.only === 'always' || (kind.only === 'hull') === hull) &&
                          (kind.role === 'both' || (kind.role === 'visual') === visuals);
    }
  }

  colorOf(shape) {
    if (shape.color) return new THREE.Color().setRGB(...shape.color.slice(0, 3), THREE.SRGBColorSpace);
    if (shape.body === 0) return new THREE.Color(kWorld);
    const single = this.replay.instances <= 1;
    const palette = single && this.replay.bodies.length > 3 ? kRobot : kPalette;
    const index = single ? shape.body - 1 : shape.instance;
    return new THREE.Color(palette[Math.max(0, index) % palette.length]);
  }

  /// Colours all shapes; those of sleeping trees fade towards `background`.
  paint(frame, options) {
    if (this.ghost) return;
    const trees = this.motion.trees;
    for (const item of this.items) {
      const {body} = item.shape;
      const color = this.colorOf(item.shape);
      const tree = this.replay.bodies[body].tree;
      if (options.sleep && tree >= 0 && this.motion.asleep[frame * trees + tree])
        color.lerp(options.background, 0.45);
      if (body > 0 && body === options.selected) color.lerp(new THREE.Color('#ffd84d'), 0.5);
      if (body > 0 && body === options.hovered) color.lerp(new THREE.Color('#ffffff'), 0.3);
      item.mesh.setColorAt(item.slot, color);
    }
    for (const kind of this.kinds.values())
      if (kind.mesh.instanceColor) kind.mesh.instanceColor.needsUpdate = true;
  }

  /// Moves all bodies to their poses at `at` (Motion.at).
  update(at) {
    const pose = new Float64Array(7), place = new THREE.Vector3(), turn = new THREE.Quaternion();
    const one = new THREE.Vector3(1, 1, 1), matrix = new THREE.Matrix4();
    this.matrices.forEach((out, body) => {
      this.motion.pose(body, at, pose);
      out.compose(place.set(pose[0], pose[1], pose[2]), turn.set(pose[4], pose[5], pose[6], pose[3]), one);
    });
    for (const item of this.items)
      item.mesh.setMatrixAt(item.slot, matrix.multiplyMatrices(this.matrices[item.shape.body], item.local));
    for (const kind of this.kinds.values()) {
      kind.mesh.instanceMatrix.needsUpdate = true;
      kind.mesh.boundingSphere = null;
    }
  }

  /// Share of the bodies hidden from a point by shapes fixed to the world.
  hiddenFrom(eye) {
    const list = this.replay.bodies.map((_, i) => i).slice(1, 60), ray = new THREE.Raycaster();
    const hidden = list.filter((body) => {
      const to = new THREE.Vector3().setFromMatrixPosition(this.matrices[body]).sub(eye);
      ray.far = 0.99 * to.length();
      ray.set(eye, to.normalize());
      return this.pick(ray)?.body === 0;
    });
    return hidden.length / Math.max(1, list.length);
  }

  /// The first shape that a ray hits, and the point [m]; null if it hits none.
  hit(raycaster) {
    const [hit] = raycaster.intersectObjects(this.group.children.filter((mesh) => mesh.visible), false);
    return hit ? {shape: hit.object.userData.items[hit.instanceId].shape, point: hit.point} : null;
  }
  pick(raycaster) { return this.hit(raycaster)?.shape ?? null; }
}
