// What the person in the picture is made of. A tablet without a graphics card draws it thirty times a second, so:
// few triangles, few pieces, and light reckoned at their corners.

import * as THREE from "../vendor/three/three.module.js";

const CORNERS = `
uniform vec3 colour;
varying vec3 shade;
const vec3 SUN = normalize(vec3(1.5, 2.5, 3.0));
void main() {
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  vec3 out_of = normalize(mat3(modelMatrix) * normal);
  vec3 sky = mix(vec3(0.17, 0.21, 0.245), vec3(0.67), 0.5 + 0.5 * out_of.y);
  shade = pow(colour * (sky + 0.605 * max(dot(out_of, SUN), 0.0)), vec3(1.0 / 2.2));
}`;
const BETWEEN = `
varying vec3 shade;
void main() { gl_FragColor = vec4(shade, 1.0); }`;
const CAP = [90, 60, 30, 0].map((degrees) => (degrees * Math.PI) / 180);

/** A dull surface of a colour, in the light of a window in front and above. */
export class Surface extends THREE.ShaderMaterial {
  constructor(colour) {
    super({ vertexShader: CORNERS, fragmentShader: BETWEEN, uniforms: { colour: { value: new THREE.Color(colour) } } });
  }

  paint(colour) {
    this.uniforms.colour.value.setHex(colour);
  }
}

/** A tapered tube along y, from the origin, with half a ball at each end: limbs that meet in a point are one piece. */
export function rod(near, far, length, sides = 16) {
  const outline = [
    ...CAP.map((at) => new THREE.Vector2(near * Math.cos(at), -near * Math.sin(at))),
    ...CAP.toReversed().map((at) => new THREE.Vector2(far * Math.cos(at), length + far * Math.sin(at))),
  ];
  return new THREE.LatheGeometry(outline, sides);
}

const UP = new THREE.Vector3(0, 1, 0);

/** Turn and move something along y so that it leads from one point to another; returns how far they are apart. */
export function lead(object, from, to) {
  const way = to.clone().sub(from);
  const length = way.length();
  object.position.copy(from);
  object.quaternion.setFromUnitVectors(UP, way.normalize());
  return length;
}

/** Several shapes as one: what is one piece is drawn in one go. */
export function joined(shapes) {
  const whole = new THREE.BufferGeometry();
  for (const name of ["position", "normal"]) {
    const all = shapes.flatMap((shape) => [...shape.attributes[name].array]);
    whole.setAttribute(name, new THREE.Float32BufferAttribute(all, 3));
  }
  let first = 0;
  const corners = [];
  for (const shape of shapes) {
    for (const corner of shape.index.array) corners.push(first + corner);
    first += shape.attributes.position.count;
  }
  return whole.setIndex(corners);
}
