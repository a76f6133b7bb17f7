// The picture: a figure that can be turned with a finger. Drawn when something is new, and only then.

import * as THREE from "../vendor/three/three.module.js";
import { OrbitControls } from "../vendor/three/OrbitControls.js";
import { Figure } from "./figure.js";
import { painter } from "./painter.js";
import { dark } from "./theme.js";

const BOTTOM = 0.5; // m above the floor: a hanging hand
const HEAD = 1.8;
const SPARE = 0.12;
const SIDEWAYS = 1.9; // m, both arms stretched out
const FOV_DEG = 26;
const VIEWS = { front: [0.14, 1, 0.1], side: [1, 0.22, 0.1], above: [0.25, 0.75, 1.1] };
const LEFT = new Set(["left"]);

export class Picture {
  constructor(box) {
    this.box = box;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(FOV_DEG, 1, 0.1, 30);
    this.camera.up.set(0, 0, 1);
    this.renderer = painter(box);
    this.floor = this.ground();
    this.figure = new Figure(this.scene);
    box.drawn = () => this.figure.drawn();
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.enablePan = false;
    this.controls.minDistance = 1.2;
    this.controls.maxDistance = 9;
    this.controls.addEventListener("change", () => this.draw());
    this.controls.addEventListener("start", () => {
      this.own = true; // a person chose what is seen: it is theirs until a view is chosen
      this.turned?.();
    });
    this.due = false;
    this.drawn = null;
    new ResizeObserver(() => this.fit()).observe(box);
    document.addEventListener("theme", () => this.dress());
    this.top = HEAD;
    this.chosen = ["front", 1];
    this.dress();
    this.frame();
  }

  ground() {
    const grid = new THREE.PolarGridHelper(1.1, 12, 4, 64);
    grid.rotation.x = Math.PI / 2;
    grid.material.transparent = true;
    this.scene.add(grid);
    return grid;
  }

  dress() {
    this.figure.dress(dark());
    this.floor.material.opacity = dark() ? 0.25 : 0.3;
    this.draw();
  }

  /** Look from the front, the side (of the arm that is there) or above. */
  view(name, sides = []) {
    this.chosen = [name, sides.length === 1 && LEFT.has(sides[0]) ? -1 : 1];
    this.own = false;
    this.top = HEAD;
    this.frame();
  }

  /** Put the camera where all of the person is seen, from hanging hands to the highest that an arm went. */
  frame() {
    const [name, mirrored] = this.chosen;
    const [x, y, z] = VIEWS[name];
    const high = this.top - BOTTOM + SPARE;
    const half = Math.tan((FOV_DEG * Math.PI) / 360);
    const distance = Math.max(high / 2 / half, SIDEWAYS / 2 / half / Math.max(this.camera.aspect, 0.1) / 1.35);
    const way = new THREE.Vector3(mirrored * x, y, z).setLength(distance);
    this.controls.target.set(0, 0.05, (this.top + BOTTOM) / 2);
    this.camera.position.copy(this.controls.target).add(way);
    this.controls.update();
    this.draw();
  }

  fit() {
    const { clientWidth: wide, clientHeight: high } = this.box;
    if (!wide || !high) return;
    this.renderer.setSize(wide, high, false);
    this.camera.aspect = wide / high;
    this.camera.updateProjectionMatrix();
    if (!this.own) this.frame();
    this.renderer.render(this.scene, this.camera); // at once: another size emptied the canvas
  }

  show(arms, beyond) {
    const top = this.figure.show(arms, beyond);
    if (top > this.top && !this.own) {
      this.top = top;
      this.frame();
    } else {
      this.draw();
    }
  }

  /** Draw at the next chance; asked often, it draws once. */
  draw() {
    if (this.due) return;
    this.due = true;
    requestAnimationFrame(() => {
      this.due = false;
      this.renderer.render(this.scene, this.camera);
      this.drawn?.();
    });
  }
}
