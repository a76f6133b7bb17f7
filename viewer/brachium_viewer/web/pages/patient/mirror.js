// The patient as in a mirror: from the front, the right arm at the right.

import * as THREE from "../vendor/three/three.module.js";
import { Figure } from "../app/figure.js";
import { painter } from "../app/painter.js";
import { dark } from "../app/theme.js";

const CHEST = 1.34; // m above the floor: the middle of what is shown
const REACH = [0.98, 0.88]; // m from there to either side and up: an arm stretched out stays in the picture
const ANGLE = 30;

export class Mirror {
  constructor(place) {
    this.place = place;
    try {
      this.renderer = painter(place);
    } catch {
      return; // a device that draws nothing in three dimensions: count and words remain
    }
    this.scene = new THREE.Scene();
    this.scene.scale.x = -1; // the mirror
    this.camera = new THREE.PerspectiveCamera(ANGLE, 1, 0.1, 20);
    this.camera.up.set(0, 0, 1);
    this.figure = new Figure(this.scene);
    place.drawn = () => this.figure.drawn();
    new ResizeObserver(() => this.fit()).observe(place);
    document.addEventListener("theme", () => this.dress());
    this.dress();
  }

  dress() {
    this.figure.dress(dark());
    this.draw();
  }

  fit() {
    const { clientWidth: wide, clientHeight: high } = this.place;
    if (!wide || !high) return;
    this.renderer.setSize(wide, high, false);
    this.camera.aspect = wide / high;
    const seen = Math.max(REACH[1], REACH[0] / this.camera.aspect);
    this.camera.position.set(0, seen / Math.tan((ANGLE * Math.PI) / 360), CHEST + 0.1);
    this.camera.lookAt(0, 0, CHEST);
    this.camera.updateProjectionMatrix();
    this.renderer.render(this.scene, this.camera); // at once: another size emptied the canvas
  }

  /** The newest of one arm; the other one hangs. */
  show(side, arm, beyond) {
    if (!this.renderer) return;
    this.figure.show({ [side]: arm }, beyond ? side : null);
    this.draw();
  }

  /** Draw at the next chance; asked often, it draws once. */
  draw() {
    if (this.due) return;
    this.due = true;
    requestAnimationFrame(() => {
      this.due = false;
      this.renderer.render(this.scene, this.camera);
    });
  }
}
