// The person in the picture: a plain body, and arms in one piece. Metres, z up, x to the person's right, y forward.

import * as THREE from "../vendor/three/three.module.js";
import { MEASURED } from "./quality.js";
import { joined, lead, rod, Surface } from "./solids.js";

const CHEST = 1.38; // m above the floor: the picture shows a pose, not a body's height
const HIP = new THREE.Vector3(0, 0, -0.46); // where a leaning trunk turns, from the chest
const COLOURS = { upper_arm: 0xe69f00, forearm: 0x3a9bd6, hand: 0x009e73 };
const NOT_MEASURED = 0x8a939b;
const BEYOND = 0xd55e00;
const HANGING = { shoulder: [0.19, 0, 0], elbow: [0.215, -0.01, -0.3], wrist: [0.222, 0.03, -0.55], hand: [0.218, 0.045, -0.71] };
const SAME = 0.005; // of its length: a limb is stretched so far before it is shaped anew

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
const HEAD = { at: [0, 0.012, 0.225], size: [0.083, 0.1, 0.118], sides: 20 };
const NOSE = { at: [0, 0.112, 0.215], size: [0.014, 0.02, 0.022], sides: 8 };
const YOKE = [[-0.17, -0.02, -0.012], [0.17, -0.02, -0.012], 0.058, 0.058]; // from shoulder to shoulder
const LEGS = [
  [[-0.09, -0.03, 0.84], [-0.1, -0.015, 0.45], 0.082, 0.058],
  [[-0.1, -0.015, 0.45], [-0.105, -0.02, 0.09], 0.056, 0.042],
  [[-0.105, -0.03, 0.05], [-0.11, 0.12, 0.035], 0.045, 0.034],
];

class Limb {
  constructor(parent, { near, far, part }) {
    this.near = near;
    this.far = far;
    this.length = 0;
    this.surface = new Surface(COLOURS[part]);
    this.rod = new THREE.Mesh(new THREE.BufferGeometry(), this.surface);
    parent.add(this.rod);
  }

  place(from, to) {
    const length = Math.max(lead(this.rod, from, to), 1e-4);
    if (Math.abs(length - this.length) > SAME * this.length) {
      this.length = length;
      this.rod.geometry.dispose();
      this.rod.geometry = rod(this.near, this.far, length);
    }
    this.rod.scale.y = length / this.length;
  }

  /** The middles of its two ends as they are drawn, in the room: those of the rod, not what it was told. */
  ends() {
    this.rod.updateWorldMatrix(true, false);
    return [0, this.length].map((y) => this.rod.localToWorld(new THREE.Vector3(0, y, 0)).toArray());
  }
}

class Arm {
  constructor(parent) {
    this.group = new THREE.Group();
    parent.add(this.group);
    this.limbs = LIMBS.map((row) => ({ ...row, limb: new Limb(this.group, row) }));
  }

  /** An arm of which nothing is known belongs to the body: it hangs, in the body's colour. */
  hang(mirror, colour) {
    this.known = false;
    const at = (joint) => new THREE.Vector3(...HANGING[joint]).multiply(new THREE.Vector3(mirror, 1, 1));
    for (const { from, to, limb } of this.limbs) {
      limb.rod.visible = true;
      limb.place(at(from), at(to));
      limb.surface.paint(colour);
    }
  }

  show(arm, beyond) {
    this.known = true;
    for (const { part, from, to, limb } of this.limbs) {
      const first = arm.positions[from];
      const last = arm.positions[to];
      limb.rod.visible = Boolean(first && last);
      if (!limb.rod.visible) continue;
      limb.place(new THREE.Vector3(...first), new THREE.Vector3(...last));
      const measured = !arm.stale && MEASURED.has(arm.parts[part]);
      limb.surface.paint(!measured ? NOT_MEASURED : beyond ? BEYOND : COLOURS[part]);
    }
  }
}

function torso() {
  const outline = OUTLINE.map(([half, height]) => new THREE.Vector2(half, height));
  const round = new THREE.LatheGeometry(new THREE.SplineCurve(outline).getPoints(18), 24);
  return round.rotateX(Math.PI / 2).scale(1, DEPTH, 1).translate(0, -0.03, 0);
}

function ball({ at, size, sides }) {
  return new THREE.SphereGeometry(1, sides, Math.round(0.7 * sides)).scale(...size).translate(...at);
}

function bone([from, to, near, far], mirror = 1) {
  const place = new THREE.Object3D();
  const [first, last] = [from, to].map(([x, y, z]) => new THREE.Vector3(mirror * x, y, z));
  const length = lead(place, first, last);
  place.updateMatrix();
  return rod(near, far, length, 14).applyMatrix4(place.matrix);
}

export class Figure {
  constructor(scene) {
    this.body = new Surface(0xc3ccd4);
    this.trunk = new THREE.Group();
    this.trunk.position.set(0, 0, CHEST + HIP.z);
    this.chest = new THREE.Group();
    this.chest.position.copy(HIP).negate();
    this.trunk.add(this.chest);
    const legs = [1, -1].flatMap((mirror) => LEGS.map((leg) => bone(leg, mirror)));
    scene.add(new THREE.Mesh(joined(legs), this.body), this.trunk);
    this.chest.add(new THREE.Mesh(joined([torso(), ball(HEAD), ball(NOSE), bone(YOKE)]), this.body));
    this.arms = { right: new Arm(this.chest), left: new Arm(this.chest) };
    this.dress(false);
  }

  dress(dark) {
    this.colour = dark ? 0x66727d : 0xc3ccd4;
    this.body.paint(this.colour);
    for (const [side, arm] of Object.entries(this.arms)) if (!arm.known) this.hang(side);
  }

  hang(side) {
    this.arms[side].hang(side === "right" ? 1 : -1, this.colour);
  }

  /** Show the arms of a frame; `beyond` names the side that is past its limit. Returns how high they reach, m. */
  show(arms, beyond) {
    for (const [side, arm] of Object.entries(this.arms)) {
      if (arms[side]) arm.show(arms[side], beyond === side);
      else if (arm.known) this.hang(side);
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
    return Object.fromEntries(
      Object.entries(this.arms).map(([side, { limbs }]) => {
        const seen = limbs.filter(({ limb }) => limb.rod.visible);
        return [side, Object.fromEntries(seen.map(({ part, limb }) => [part, limb.ends()]))];
      }),
    );
  }
}
