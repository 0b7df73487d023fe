// body_gl.js: the body drawn by WebGL through three.js. Everything is on the graphics card once; a frame sets a few
// numbers: the factor of the displacements, the camera.

import { BufferAttribute, BufferGeometry, Color, DoubleSide, LineSegments, Mesh, OrthographicCamera, Scene, ShaderMaterial, Vector3, Vector4,
  WebGLRenderer } from "three";
import { obstacle_patches } from "./body_obstacles.js";
import { VIRIDIS } from "./body_surface.js";

const MOVE = `
  attribute vec3 displacement;
  uniform float factor;
  varying vec3 v_before;
  vec4 moved() {
    v_before = position;
    return modelViewMatrix * vec4(position + factor * displacement, 1.0);
  }`;

// What lies beyond the plane, before the body was deformed, is not there.
const CUT = `
  uniform vec4 cut;
  varying vec3 v_before;
  void stay() { if (dot(v_before, cut.xyz) > cut.w) discard; }`;
const NOWHERE = new Vector4(0, 0, 0, 1);

// Flat shading: the normal of a triangle is that of its plane as the pixels see it. A shade below 0 is "no value".
const BODY = {
  vertexShader: `${MOVE}
    attribute float shade;
    varying float v_shade;
    varying vec3 v_place;
    void main() {
      vec4 place = moved();
      v_shade = shade;
      v_place = place.xyz;
      gl_Position = projectionMatrix * place;
    }`,
  fragmentShader: `${CUT}
    uniform vec3 stops[${VIRIDIS.length}];
    uniform vec3 none;
    uniform float lit;
    uniform float through; // what has no value is not drawn
    varying float v_shade;
    varying vec3 v_place;
    void main() {
      stay();
      float at = clamp(v_shade, 0.0, 1.0) * ${(VIRIDIS.length - 1).toFixed(1)};
      vec3 colour = stops[0];
      for (int i = 1; i < ${VIRIDIS.length}; i++) colour = mix(colour, stops[i], clamp(at - float(i - 1), 0.0, 1.0));
      if (v_shade < -0.001 && through > 0.5) discard;
      if (v_shade < -0.001) colour = none;
      vec3 normal = cross(dFdx(v_place), dFdy(v_place));
      float facing = abs(normal.z) / max(length(normal), 1e-30);
      gl_FragColor = vec4(colour * mix(1.0, 0.55 + 0.45 * facing, lit), 1.0);
    }`,
};

const LINE = {
  vertexShader: `${MOVE}
    void main() { gl_Position = projectionMatrix * moved(); }`,
  fragmentShader: `${CUT}
    uniform vec3 ink;
    uniform float opacity;
    void main() { stay(); gl_FragColor = vec4(ink, opacity); }`,
};

const PATCH = {
  vertexShader: `
    varying vec3 v_place;
    void main() {
      vec4 place = modelViewMatrix * vec4(position, 1.0);
      v_place = place.xyz;
      gl_Position = projectionMatrix * place;
      gl_Position.z += 1e-3; // some thousandths of the body: facets of what is round dip into what touches it
    }`,
  fragmentShader: `
    uniform vec3 ink;
    uniform float opacity;
    varying vec3 v_place;
    void main() {
      vec3 normal = cross(dFdx(v_place), dFdy(v_place));
      float facing = abs(normal.z) / max(length(normal), 1e-30);
      gl_FragColor = vec4(ink * (0.6 + 0.4 * facing), opacity);
    }`,
};

/** Draws on a canvas. Throws where there is no WebGL. */
export class BodyGL {
  constructor(canvas) {
    const wish = { alpha: true, antialias: true, premultipliedAlpha: true, powerPreference: "low-power" };
    const context = canvas.getContext("webgl2", wish) || canvas.getContext("webgl", wish);
    if (!context) throw new Error("there is no WebGL");
    this.renderer = new WebGLRenderer({ canvas, context, alpha: true });
    this.renderer.setClearColor(0x000000, 0);
    this.camera = new OrthographicCamera(-1, 1, 1, -1, 0, 1);
    this.camera.matrixAutoUpdate = false;
    this.scene = null;
  }

  /** Replaces what is drawn. */
  take(surface, shades) {
    this.clear();
    this.surface = surface;
    this.scene = new Scene();
    const part = parts_of(surface), add = (object) => this.add(object), faces = part(surface.triangle);
    this.shade = new BufferAttribute(shades, 1);
    faces.setAttribute("shade", this.shade);
    this.plane = new Vector4().copy(NOWHERE);
    this.body = add(new Mesh(faces, body_material(surface.dim === 3, this.plane)));
    this.wire = add(new LineSegments(part(surface.line), line_material(0.35, this.plane)));
    this.cap = [];
    this.before = add(new LineSegments(part(surface.outline), line_material(1, NOWHERE)));
    this.patches = (surface.dim === 3 ? obstacle_patches(surface) : []).map((one) => add(patch_mesh(one)));
  }

  add(object) {
    object.frustumCulled = false; // its bounds do not know of the displacements
    this.scene.add(object);
    return object;
  }

  /** Leaves out what lies beyond a plane, [normal, offset], or nothing (null); section: what stands in the plane, with its shades. */
  cut(plane, section, shades) {
    if (plane) this.plane.set(...plane[0], plane[1]);
    else this.plane.copy(NOWHERE);
    for (const object of this.cap) {
      this.scene.remove(object);
      free(object);
    }
    this.cap = [];
    if (!section) return;
    const part = parts_of(section), faces = part(section.triangle);
    faces.setAttribute("shade", new BufferAttribute(shades, 1));
    this.cap = [this.add(new Mesh(faces, body_material(false, NOWHERE))), this.add(new LineSegments(part(section.line), line_material(0.35, NOWHERE)))];
    this.cap[1].material.uniforms.ink.value.set(0x282830);
    this.cap[1].visible = this.wire.visible;
  }

  /** Changes the values by vertex. */
  colour(shades) {
    this.shade.array.set(shades);
    this.shade.needsUpdate = true;
  }

  /** before, obstacle: CSS colours. What is drawn on the body itself does not change with the theme. */
  ink({ before, obstacle }) {
    this.wire.material.uniforms.ink.value.set(0x282830);
    this.before.material.uniforms.ink.value.set(before);
    for (const patch of this.patches) patch.material.uniforms.ink.value.set(obstacle);
  }

  show({ wire, before, obstacles }) {
    this.wire.visible = wire;
    if (this.cap[1]) this.cap[1].visible = wire;
    this.before.visible = before;
    for (const patch of this.patches) patch.visible = obstacles;
  }

  resize(width, height, ratio) {
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
  }

  /** through: faces without a value are left out. */
  render(view, factor, through) {
    const { camera } = this, [right, up, eye] = view.axes.map((axis) => new Vector3(...axis));
    const far = 4 + 2 * factor * (this.surface.largest_displacement / this.surface.unit) + view.width / view.scale;
    this.body.material.uniforms.factor.value = factor;
    this.body.material.uniforms.through.value = through ? 1 : 0;
    for (const one of [this.wire, ...this.cap]) one.material.uniforms.factor.value = factor;
    camera.left = -view.width / 2 / view.scale;
    camera.right = -camera.left;
    camera.top = view.height / 2 / view.scale;
    camera.bottom = -camera.top;
    camera.near = 0;
    camera.far = 2 * far;
    camera.matrix.makeBasis(right, up, eye).setPosition(new Vector3(...view.target).addScaledVector(eye, far));
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld(true);
    this.renderer.render(this.scene, camera);
  }

  clear() {
    this.scene?.traverse(free);
    this.scene = null;
  }

  dispose() {
    this.clear();
    this.renderer.dispose();
    this.renderer.forceContextLoss?.();
  }
}

function free(object) {
  object.geometry?.dispose();
  object.material?.dispose();
}

/** Geometries on the vertices of a surface, each with indices of its own. */
function parts_of(surface) {
  const position = new BufferAttribute(surface.position, 3), displacement = new BufferAttribute(surface.displacement, 3);
  return (index) => {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", position);
    geometry.setAttribute("displacement", displacement);
    geometry.setIndex(new BufferAttribute(index, 1));
    return geometry;
  };
}

function body_material(lit, cut) {
  return new ShaderMaterial({
    ...BODY, side: DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1, extensions: { derivatives: true },
    uniforms: {
      factor: { value: 0 }, through: { value: 0 }, lit: { value: lit ? 1 : 0 }, none: { value: new Color(0x8a8f96) }, cut: { value: cut },
      stops: { value: VIRIDIS.map((rgb) => new Vector3(...rgb.map((x) => x / 255))) },
    },
  });
}

function line_material(opacity, cut) {
  return new ShaderMaterial({ ...LINE, transparent: opacity < 1, uniforms: { cut: { value: cut }, factor: { value: 0 }, ink: { value: new Color() }, opacity: { value: opacity } } });
}

function patch_mesh({ points, index }) {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(points, 3));
  geometry.setIndex(new BufferAttribute(index, 1));
  return new Mesh(geometry, new ShaderMaterial({
    ...PATCH, side: DoubleSide, transparent: true, depthWrite: false, extensions: { derivatives: true },
    uniforms: { ink: { value: new Color() }, opacity: { value: 0.3 } },
  }));
}
