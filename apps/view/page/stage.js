// Light, ground, camera and renderer.
import * as THREE from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';

const kThemes = {
  light: {background: '#e9edf2', ground: '#f4f5f7', line: '#c3cad3', sky: '#ffffff', below: '#b9b2a6',
          sun: 2.3, ambient: 1.25},
  dark: {background: '#14181e', ground: '#262c34', line: '#3d4651', sky: '#c9d6e6', below: '#3a352e',
         sun: 2.2, ambient: 0.85},
};

/// Rounds to 1, 2 or 5 times a power of ten.
export function roundStep(x) {
  const power = 10 ** Math.floor(Math.log10(x));
  const share = x / power;
  return power * (share < 1.5 ? 1 : share < 3.5 ? 2 : share < 7.5 ? 5 : 10);
}

function groundTexture(theme) {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 512;
  const context = canvas.getContext('2d');
  context.fillStyle = theme.ground;
  context.fillRect(0, 0, 512, 512);
  context.strokeStyle = theme.line;
  context.lineWidth = 1.5;  // five cells a side; the outer lines are thicker
  for (let i = 1; i < 5; ++i) {
    const at = 512 * i / 5;
    context.beginPath();
    context.moveTo(at, 0);
    context.lineTo(at, 512);
    context.moveTo(0, at);
    context.lineTo(512, at);
    context.stroke();
  }
  context.lineWidth = 5;
  context.strokeRect(0, 0, 512, 512);
  const texture = new THREE.CanvasTexture(canvas);
  texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.anisotropy = 8;
  return texture;
}

export class Stage {
  constructor(replay, holder) {
    this.replay = replay;
    this.renderer = new THREE.WebGLRenderer({antialias: true});
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFSoftShadowMap;
    holder.append(this.renderer.domElement);
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(38, 1, 0.01, 1000);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.enableDamping = false;
    this.controls.zoomToCursor = true;
    this.hemisphere = new THREE.HemisphereLight();
    this.hemisphere.position.set(0, 0, 1);
    this.sun = new THREE.DirectionalLight('#fff8ee');
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(2048, 2048);
    this.sun.shadow.bias = -0.0004;
    this.scene.add(this.hemisphere, this.sun, this.sun.target);
    this.grounds = replay.shapes.filter((shape) => shape.type === 'plane').map((shape) => this.ground(shape));
    this.reset();
  }

  /// Radius of the ball around all moving bodies over the whole motion [m].
  get radius() { return this.replay.radius; }

  ground(shape) {
    this.cell = roundStep(this.radius / 4);
    const side = 400 * this.cell;
    const material = new THREE.MeshStandardMaterial({roughness: 0.95});
    const mesh = new THREE.Mesh(new THREE.PlaneGeometry(side, side), material);
    const [x, y, z, qw, qx, qy, qz] = shape.pose;
    mesh.position.set(x, y, z);
    mesh.quaternion.set(qx, qy, qz, qw);
    mesh.receiveShadow = true;
    // A body that lies in the plane is drawn in front of it.
    material.polygonOffset = true;
    material.polygonOffsetFactor = material.polygonOffsetUnits = 1;
    this.scene.add(mesh);
    return mesh;
  }

  theme(name) {
    const theme = kThemes[name];
    this.background = new THREE.Color(theme.background);
    this.scene.background = this.background;
    this.scene.fog = new THREE.Fog(theme.background, 1, 2);
    this.hemisphere.color.set(theme.sky);
    this.hemisphere.groundColor.set(theme.below);
    this.hemisphere.intensity = theme.ambient;
    this.sun.intensity = theme.sun;
    for (const mesh of this.grounds) {
      mesh.material.map?.dispose();
      mesh.material.map = groundTexture(theme);
      mesh.material.map.repeat.set(80, 80);  // 400 cells, five a tile
      mesh.material.map.offset.set(0, 0);
      mesh.material.needsUpdate = true;
    }
  }

  /// Looks at all moving bodies from the front right, or from the direction in which the fewest are
  /// hidden.
  reset(hidden = () => 0) {
    let best = null;
    for (const [azimuth, elevation] of [[-55, 20], [-125, 20], [55, 20], [125, 20], [-55, 60], [125, 60]]) {
      this.lookAtAll(azimuth, elevation);
      const share = hidden(this.camera.position);
      if (!best || share < best.share - 0.05) best = {share, azimuth, elevation};
      if (share === 0) break;
    }
    this.lookAtAll(best.azimuth, best.elevation);
  }

  lookAtAll(azimuth, elevation) {
    const aspect = Math.min(1, this.camera.aspect || 1);
    this.look(azimuth, elevation, 0.92 * this.radius / (Math.sin(THREE.MathUtils.degToRad(19)) * aspect),
              new THREE.Vector3(...this.replay.center));
  }

  /// Sets the view: angles [degrees], distance [m].
  look(azimuth, elevation, distance, target) {
    const a = THREE.MathUtils.degToRad(azimuth), e = THREE.MathUtils.degToRad(elevation);
    const flat = distance * Math.cos(e);
    this.controls.target.copy(target);
    this.camera.position.set(target.x + flat * Math.cos(a), target.y + flat * Math.sin(a),
                             target.z + distance * Math.sin(e));
    this.controls.update();
  }

  /// Returns the present view: [azimuth, elevation, distance, x, y, z].
  get view() {
    const arm = this.camera.position.clone().sub(this.controls.target), distance = arm.length();
    return [THREE.MathUtils.radToDeg(Math.atan2(arm.y, arm.x)),
            THREE.MathUtils.radToDeg(Math.asin(arm.z / distance)), distance, ...this.controls.target.toArray()];
  }

  /// Moves camera and target together.
  shift(move) {
    this.controls.target.add(move);
    this.camera.position.add(move);
    this.controls.update();
  }

  /// Shifts the picture by `pixels` to the right, since the legend covers the left.
  aside(pixels) {
    const {width, height} = this.renderer.getSize(new THREE.Vector2());  // Vector2 has width, height
    if (pixels) this.camera.setViewOffset(width, height, -pixels, 0, width, height);
    else this.camera.clearViewOffset();
  }

  resize(width, height, ratio) {
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height);
    this.camera.aspect = width / Math.max(1, height);
    this.camera.updateProjectionMatrix();
  }

  render() {
    const distance = this.camera.position.distanceTo(this.controls.target);
    const reach = distance + 3 * this.radius;
    this.camera.near = Math.max(1e-3 * reach, 0.02 * distance);
    this.camera.far = 40 * reach;
    this.camera.updateProjectionMatrix();
    this.scene.fog.near = 2.2 * reach;
    this.scene.fog.far = 9 * reach;
    this.placeSun(Math.min(1.6 * this.radius, 1.2 * distance));
    this.renderer.render(this.scene, this.camera);
  }

  placeSun(half) {
    const target = this.sun.target.position.copy(this.controls.target);
    this.sun.position.set(0.45, -0.6, 1.25).multiplyScalar(6 * half).add(target);
    const frustum = this.sun.shadow.camera;
    Object.assign(frustum, {left: -2 * half, right: 2 * half, bottom: -2 * half, top: 2 * half,
                            near: 0.5 * half, far: 20 * half});
    this.sun.shadow.normalBias = 0.004 * half;
    this.sun.shadow.radius = 3;
    frustum.updateProjectionMatrix();
  }

  /// Projects a point [m] to the screen [CSS pixels of the canvas].
  project(point) {
    this.camera.updateMatrixWorld();
    const p = new THREE.Vector3(...point).project(this.camera);
    const {clientWidth, clientHeight} = this.renderer.domElement;
    return {x: (p.x + 1) / 2 * clientWidth, y: (1 - p.y) / 2 * clientHeight, inFront: p.z < 1};
  }
}
