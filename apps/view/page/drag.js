// The hand: a body that is dragged with the mouse or a finger, and the force on it.
import * as THREE from 'three';
import {text} from './dom.js';
import {Forces, markSize} from './marks.js';

const kHand = ['#0f8f7f', '#7cc4ba', '#0a5f55'];
const kStart = 3;  // the pointer's way before a drag begins [CSS pixels]
const kHold = 200;  // a drag also begins when the pointer rests for this time [ms]

export class Drag {
  constructor(view) {
    this.view = view;
    this.gesture = null;
    // Captured above the canvas: before the camera's controls, which listen there.
    const listen = (name, act) => view.panel.picture.addEventListener(name, act, {capture: true});
    listen('pointerdown', (event) => this.down(event));
    listen('pointermove', (event) => { if (this.owns(event)) this.gesture.pointer = event; });
    for (const name of ['pointerup', 'pointercancel', 'lostpointercapture'])
      listen(name, (event) => { if (this.owns(event)) this.end(); });
  }

  owns({pointerId}) { return this.gesture?.pointer.pointerId === pointerId; }

  down(event) {
    const {view} = this;
    if (this.gesture) {  // a second finger, hidden from the camera
      event.stopPropagation();
      return this.end();
    }
    if (event.button !== 0 || !event.isPrimary || !view.canDrag) return;
    const hit = view.bodies.hit(view.rayAt(event)), body = hit?.shape.body;
    if (!(body > 0)) return;
    const point = hit.point.clone().applyMatrix4(view.bodies.matrices[body].clone().invert());
    this.gesture = {body, point: point.toArray(), at: hit.point, from: event, pointer: event, turns: event.ctrlKey,
                    since: performance.now()};
    view.stage.controls.enabled = false;
    view.canvas.setPointerCapture(event.pointerId);
  }

  /// The pointer's way since the start of the gesture [CSS pixels]: to the right, down.
  get way() {
    const {from, pointer} = this.gesture;
    return [pointer.clientX - from.clientX, pointer.clientY - from.clientY];
  }

  /// Where the pointer is, on the plane through the point taken that faces the camera [m].
  get target() {
    const {view} = this, plane = new THREE.Plane();
    plane.setFromNormalAndCoplanarPoint(view.stage.camera.getWorldDirection(new THREE.Vector3()), this.gesture.at);
    return view.rayAt(this.gesture.pointer).ray.intersectPlane(plane, new THREE.Vector3()) ?? this.gesture.at;
  }

  /// Torque of a turning gesture [N m]: to the right about the camera's upward axis, down about its
  /// axis to the right, as if the pointer pushed the near side. Half the height of the picture gives
  /// the weight of the body's tree times the radius of bodies.
  get torque() {
    const {view} = this, {bodies, body_radius: radius} = view.replay;
    const {tree} = bodies[this.gesture.body];
    const mass = bodies.reduce((sum, body) => sum + (body.tree === tree ? body.mass : 0), 0);
    const [right, down] = this.way, size = 9.81 * mass * radius / (0.5 * view.canvas.clientHeight);
    return new THREE.Vector3(down * size, right * size, 0).applyQuaternion(view.stage.camera.quaternion);
  }

  /// Queues the message of the gesture, once a picture and only if it changed.
  update() {
    const {gesture} = this;
    if (!gesture) return;
    if (!this.view.canDrag) return this.end();
    gesture.began ||= Math.hypot(...this.way) > kStart || performance.now() - gesture.since > kHold;
    if (!gesture.began) return;
    const {body, point} = gesture;
    const message = gesture.turns ? {do: 'turn', body, torque: this.torque.toArray()}
      : {do: 'drag', body, point, target: this.target.toArray()};
    const words = JSON.stringify(message);
    if (words !== gesture.words) this.view.live.queue('hand', message);
    gesture.words = words;
    this.view.redraw();
  }

  end() {
    const {gesture, view} = this;
    this.gesture = null;
    view.stage.controls.enabled = true;
    view.live.cancel('hand');
    if (gesture.words) view.live.send({do: 'release'});
    view.redraw();
  }
}

/// The arrow of the hand's force, and a line from the point taken to the pointer.
export class HandMarks {
  constructor(replay, scale, scene) {
    this.scale = scale;
    this.radius = replay.body_radius;
    this.arrow = {first: [0, 1], values: new Float32Array(6), pair: [], most: 1};
    this.forces = new Forces(this.arrow, scale, scene, kHand);
    this.line = new THREE.Line(new THREE.BufferGeometry(),
                               new THREE.LineBasicMaterial({color: kHand[0], depthTest: false}));
    this.line.frustumCulled = false;
    this.ball = new THREE.Mesh(new THREE.SphereGeometry(0.012 * markSize(replay), 12, 8),
                               new THREE.MeshBasicMaterial({color: kHand[0]}));
    scene.add(this.line, this.ball);
  }

  /// hand: {point, force, turns}, or null; target: where the pointer pulls [m], or null.
  update(hand, target) {
    this.line.visible = this.ball.visible = Boolean(hand && target);
    this.label = null;
    if (hand) {
      // A torque has the arrow of the force that causes it at the radius of bodies.
      const share = hand.turns ? 1 / this.radius : 1;
      this.arrow.values.set([...hand.point, ...hand.force.map((x) => x * share)]);
      const force = new THREE.Vector3(...hand.force), size = force.length();
      const tip = force.setLength(Math.min(size * share * this.scale.scale, this.scale.longest));
      this.label = {name: `${text(size)} ${hand.turns ? 'N m' : 'N'}`,
                    point: tip.add(new THREE.Vector3(...hand.point))};
    }
    this.forces.update(0, {forces: Boolean(hand), points: Boolean(hand)});
    if (!this.line.visible) return;
    this.line.geometry.setFromPoints([new THREE.Vector3(...hand.point), target]);
    this.ball.position.copy(target);
  }
}
