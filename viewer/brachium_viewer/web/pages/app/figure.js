// The person in the picture: a plain body, and arms in one piece. Metres, z up, x to the person's right, y forward.

import * as THREE from "../vendor/three/three.module.js";
import { MEASURED } from "./quality.js";

const CHEST = 1.38; // m above the floor: the picture shows a pose, not a body's height
const HIP = new THREE.Vector3(0, 0, -0.46); // where a leaning trunk turns, from the chest
const COLOURS = { upper_arm: 0xe69f00, forearm: 0x3a9bd6, hand: 0x009e73 };
const NOT_MEASURED = 0x8a939b;
const BEYOND = 0xd55e00;

const LIMBS = [
  { part: "upper_arm", from: "shoulder", to: "elbow", near: 0.056, far: 0.042 },
  { part: "forearm", from: "elbow", to: "wrist", near: 0.042, far: 0.03 },
  { part: "hand", from: "wrist", to: "hand", near: 0.034, far: 0.024 },
];
const OUTLINE = [
  [0.02, -0.585], [0.1, -0.57], [0.155, -0.51], [0.163, -0.45], [0.142, -0.34], [0.134, -0.27],
  [0.15, -0.17], [0.17, -0.08], [0.168, -0.01], [0.145, 0.035], [0.09, 0.065], [0.05, 0.085], [0.046, 0.14],
]; // of the trunk: half its width, and the height from the chest
const DEPTH = 0.64; // of its width
const HEAD = { at: [0, 0.012, 0.225], size: [0.083, 0.1, 0.118] };
const NOSE = { at: [0, 0.112, 0.215], size: [0.014, 0.02, 0.022] };
const LEGS = [
  [[-0.09, -0.03, 0.84], [-0.1, -0.015, 0.45], 0.082, 0.058],
  [[-0.1, -0.015, 0.45], [-0.105, -0.02, 0.09], 0.056, 0.042],
  [[-0.105, -0.03, 0.05], [-0.11, 0.12, 0.035], 0.045, 0.034],
];

const UP = new THREE.Vector3(0, 1, 0);
const BALL = new THREE.SphereGeometry(1, 18, 12);

function material(colour) {
  return new THREE.MeshLambertMaterial({ color: colour }); // cheap where there is no graphics card
}

/** A limb between two points: a tapered tube with a ball at each end, so that limbs that meet are one piece. */
class Limb {
  constructor(parent, near, far, surface) {
    this.near = near;
    this.far = far;
    this.tube = new THREE.Mesh(new THREE.CylinderGeometry(far, near, 1, 18, 1, true), surface);
    this.first = new THREE.Mesh(BALL, surface);
    this.last = new THREE.Mesh(BALL, surface);
    this.first.scale.setScalar(near);
    this.last.scale.setScalar(far);
    this.group = new THREE.Group();
    this.group.add(this.tube, this.first, this.last);
    parent.add(this.group);
  }

  place(from, to) {
    const way = to.clone().sub(from);
    const length = way.length();
    this.tube.position.copy(from).addScaledVector(way, 0.5);
    this.tube.scale.set(1, Math.max(length, 1e-4), 1);
    this.tube.quaternion.setFromUnitVectors(UP, way.normalize());
    this.first.position.copy(from);
    this.last.position.copy(to);
  }

  /** Its two ends as they are drawn, in the room: those of the tube, not what it was told. */
  ends() {
    this.group.updateWorldMatrix(true, true);
    return [-0.5, 0.5].map((y) => this.tube.localToWorld(new THREE.Vector3(0, y, 0)).toArray());
  }
}

class Arm {
  constructor(parent) {
    this.group = new THREE.Group();
    parent.add(this.group);
    this.limbs = LIMBS.map((row) => {
      const surface = material(COLOURS[row.part]);
      return { ...row, surface, limb: new Limb(this.group, row.near, row.far, surface) };
    });
  }

  show(arm, beyond) {
    this.group.visible = true;
    for (const { part, from, to, surface, limb } of this.limbs) {
      const first = arm.positions[from];
      const last = arm.positions[to];
      limb.group.visible = Boolean(first && last);
      if (!limb.group.visible) continue;
      limb.place(new THREE.Vector3(...first), new THREE.Vector3(...last));
      const measured = !arm.stale && MEASURED.has(arm.parts[part]);
      surface.color.setHex(!measured ? NOT_MEASURED : beyond ? BEYOND : COLOURS[part]);
    }
  }
}

export class Figure {
  constructor(scene) {
    this.body = material(0xc3ccd4);
    const legs = new THREE.Group();
    this.trunk = new THREE.Group();
    this.trunk.position.set(0, 0, CHEST + HIP.z);
    this.chest = new THREE.Group();
    this.chest.position.copy(HIP).negate();
    this.trunk.add(this.chest);
    scene.add(legs, this.trunk);
    this.chest.add(this.torso(), this.ball(HEAD), this.ball(NOSE));
    this.fixed(this.chest, [-0.17, -0.02, -0.012], [0.17, -0.02, -0.012], 0.058, 0.058);
    for (const mirror of [1, -1]) {
      for (const [from, to, near, far] of LEGS) {
        this.fixed(legs, [mirror * from[0], from[1], from[2]], [mirror * to[0], to[1], to[2]], near, far);
      }
    }
    this.arms = { right: new Arm(this.chest), left: new Arm(this.chest) };
    for (const arm of Object.values(this.arms)) arm.group.visible = false;
  }

  torso() {
    const outline = OUTLINE.map(([half, height]) => new THREE.Vector2(half, height));
    const curve = new THREE.SplineCurve(outline).getPoints(30);
    const torso = new THREE.Mesh(new THREE.LatheGeometry(curve, 32), this.body);
    torso.rotation.x = Math.PI / 2;
    torso.scale.set(1, 1, DEPTH);
    torso.position.y = -0.03;
    return torso;
  }

  ball({ at, size }) {
    const ball = new THREE.Mesh(BALL, this.body);
    ball.position.set(...at);
    ball.scale.set(...size);
    return ball;
  }

  fixed(parent, from, to, near, far) {
    new Limb(parent, near, far, this.body).place(new THREE.Vector3(...from), new THREE.Vector3(...to));
  }

  dress(dark) {
    this.body.color.setHex(dark ? 0x66727d : 0xc3ccd4);
  }

  /** Show the arms of a frame; `beyond` names the side that is past its limit. Returns how high they reach, m. */
  show(arms, beyond) {
    for (const [side, arm] of Object.entries(this.arms)) {
      if (arms[side]) arm.show(arms[side], beyond === side);
      else arm.group.visible = false;
    }
    const first = Object.values(arms)[0];
    if (first) {
      const [w, x, y, z] = first.trunk;
      this.trunk.quaternion.set(x, y, z, w);
    }
    const heights = Object.values(arms).flatMap((arm) => Object.values(arm.positions).map((at) => at[2]));
    return CHEST + Math.max(0, ...heights);
  }
  /** What is drawn of the arms, for whoever checks it: by side and part, the two ends of each limb. */
  drawn() {
    const shown = Object.entries(this.arms).filter(([, arm]) => arm.group.visible);
    return Object.fromEntries(
      shown.map(([side, { limbs }]) => {
        const seen = limbs.filter(({ limb }) => limb.group.visible);
        return [side, Object.fromEntries(seen.map(({ part, limb }) => [part, limb.ends()]))];
      }),
    );
  }
}
