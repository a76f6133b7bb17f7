// What draws in three dimensions, on a device with a graphics card and on one without.

import * as THREE from "../vendor/three/three.module.js";

const BY_PROCESSOR = /swiftshader|llvmpipe|softpipe|software|basic render/i;

/** Make a canvas in a box; where the processor draws, its pixels are no finer than it keeps up with. Throws without WebGL. */
export function painter(box) {
  const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
  const gl = renderer.getContext();
  const known = gl.getExtension("WEBGL_debug_renderer_info");
  const name = gl.getParameter(known ? known.UNMASKED_RENDERER_WEBGL : gl.RENDERER);
  renderer.setPixelRatio(Math.min(devicePixelRatio, BY_PROCESSOR.test(name) ? 1 : 2));
  box.append(renderer.domElement);
  return renderer;
}
