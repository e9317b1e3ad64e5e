// One model in the views: what of it is drawn, and in which colours.
import {
  BufferAttribute, BufferGeometry, DoubleSide, DynamicDrawUsage, GLSL3, Group, Mesh, Plane, Points, ShaderMaterial,
  Vector3, Vector4,
} from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import { colourTable, type Theme } from "./colours";
import { surfaceFacets, solidFacets, type Facets } from "./facets";
import type { Measure, Model, Payload } from "./payload";

export interface Cut {
  axis: number; // 0, 1, 2, or -1: no cut
  at: number; // along the axis; what is beyond is cut away
  flip: boolean;
}

export const isCut = (cut: Cut, coordinate: number) =>
  cut.axis >= 0 && (cut.flip ? -1 : 1) * (coordinate - cut.at) > 0;

export type Filters = Map<string, [from: number, to: number]>; // bins or groups, both included

export interface Look {
  measure: Measure | null;
  edges: boolean;
  features: boolean;
  cut: Cut;
  filters: Filters;
  theme: Theme;
}

const VERTEX = `
in vec3 first, second, third;
out vec3 corner, seen, at, colour0, colour1, colour2;
void main() {
  at = position;
  int k = gl_VertexID % 3;
  corner = vec3(k == 0, k == 1, k == 2);
  colour0 = first; colour1 = second; colour2 = third;
  vec4 place = modelViewMatrix * vec4(position, 1.0);
  seen = place.xyz;
  gl_Position = projectionMatrix * place;
}`;

// Vertices' whole numbers are shown as patches around them, not blended.
const FRAGMENT = `
precision highp float;
uniform bool patches, edges;
uniform vec3 line;
uniform vec4 cut;
in vec3 corner, seen, at, colour0, colour1, colour2;
out vec4 colour;
void main() {
  if (dot(cut.xyz, at) > cut.w) discard;
  vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
  float facing = abs(dot(normal, normalize(vec3(0.25, 0.35, 1.0))));
  vec3 base = colour0 * corner.x + colour1 * corner.y + colour2 * corner.z;
  if (patches) base = corner.x > corner.y ? (corner.x > corner.z ? colour0 : colour2)
                                          : (corner.y > corner.z ? colour1 : colour2);
  base *= 0.45 + 0.58 * facing;
  if (edges) {
    vec3 width = fwidth(corner);
    vec3 near = smoothstep(width * 0.4, width * 1.3, corner);
    float on = 1.0 - min(near.x, min(near.y, near.z));
    float fine = 1.0 - smoothstep(0.06, 0.4, max(width.x, max(width.y, width.z)));
    base = mix(base, line, 0.6 * on * fine);
  }
  colour = vec4(base, 1.0);
}`;

const POINT_VERTEX = `
uniform float size;
in vec3 first;
out vec3 tint, at;
void main() {
  at = position;
  tint = first;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
  gl_PointSize = size;
}`;

const POINT_FRAGMENT = `
precision highp float;
uniform vec4 cut;
in vec3 tint, at;
out vec4 colour;
void main() {
  if (dot(cut.xyz, at) > cut.w) discard;
  colour = vec4(tint, 1.0);
}`;

export class Shape {
  readonly group = new Group();
  readonly model: Model;
  readonly positions: Float32Array; // in the views' unit
  readonly facets: Facets;
  readonly isPoints: boolean;
  readonly isSolid: boolean;
  cut: Cut = { axis: -1, at: 0, flip: false }; // what was cut last
  readonly drawn = { facets: new Int32Array(0), count: 0 }; // what was drawn last
  private readonly codes = new Map<string, Int32Array>();
  private readonly tetCentres: Float32Array;
  private readonly geometry = new BufferGeometry();
  private readonly material: ShaderMaterial;
  private readonly lines: LineSegments2 | null = null;
  private tables = new Map<string, Uint8Array>();
  private theme: Theme | null = null;

  constructor(private readonly payload: Payload, model: Model, place: (p: ArrayLike<number>, at: number) => Vector3) {
    this.model = model;
    const { step, origin } = payload.header;
    const grid = payload.integers(model.vertices, 3);
    this.positions = new Float32Array(grid.length);
    const world = [0, 0, 0];
    for (let i = 0; i < grid.length; i += 3) {
      for (let k = 0; k < 3; ++k) world[k] = origin[k] + step * grid[i + k];
      place(world, 0).toArray(this.positions, i);
    }
    const tets = payload.integers(model.tets, 4), triangles = payload.integers(model.triangles, 3);
    this.isSolid = tets.length > 0;
    this.isPoints = !this.isSolid && triangles.length === 0;
    this.facets = this.isSolid ? solidFacets(tets, triangles, grid.length / 3) : surfaceFacets(triangles);
    this.tetCentres = this.centres(tets);
    for (const [key, values] of Object.entries(model.values))
      if (values.codes) this.codes.set(key, payload.integers(values.codes, 1));

    this.material = new ShaderMaterial({
      glslVersion: GLSL3, vertexShader: this.isPoints ? POINT_VERTEX : VERTEX,
      fragmentShader: this.isPoints ? POINT_FRAGMENT : FRAGMENT, side: DoubleSide, polygonOffset: true,
      polygonOffsetFactor: 1, polygonOffsetUnits: 1,
      uniforms: { cut: { value: new Vector4() }, patches: { value: false }, edges: { value: true },
        line: { value: new Vector3() },
        size: { value: 2 * Math.min(window.devicePixelRatio, 2) } },
    });
    const object = this.isPoints ? new Points(this.geometry, this.material) : new Mesh(this.geometry, this.material);
    object.frustumCulled = false;
    this.group.add(object);
    const ends = payload.integers(model.lines, 2);
    if (ends.length > 0) {
      this.lines = this.segments(ends);
      this.group.add(this.lines);
    }
  }

  hasValues(measure: Measure): boolean {
    return this.codes.has(measure.key);
  }

  // Which elements a filter leaves, by their codes.
  private passes(filters: Filters, element: string): ((i: number) => boolean) | null {
    const tests: [Int32Array, number, number][] = [];
    for (const [key, [from, to]] of filters) {
      const measure = this.payload.header.measures.find((m) => m.key === key);
      const codes = this.codes.get(key);
      if (!measure || !codes || (measure.element !== element && !this.isPoints)) continue;
      const steps = measure.groups ? 1 : this.payload.header.bin_steps;
      tests.push([codes, 1 + from * steps, (to + 1) * steps]);
    }
    if (tests.length === 0) return null;
    return (i) => tests.every(([codes, from, to]) => codes[i] >= from && codes[i] <= to);
  }

  // Draws what the cut and the filters leave; returns the number of facets or points in colour.
  update(look: Look): number {
    this.cut = look.cut;
    if (this.theme !== look.theme) this.tables.clear();
    this.theme = look.theme;
    const { axis, at, flip } = look.cut;
    const side = axis < 0 ? 0 : flip ? -1 : 1;
    const normal = new Vector3();
    if (axis >= 0) normal.setComponent(axis, side);
    // Tetrahedra are kept whole, all else is cut where the plane is.
    if (!this.isSolid) this.material.uniforms.cut.value.set(...normal.toArray(), side * at);
    if (this.lines) {
      this.lines.material.clippingPlanes = axis < 0 ? null : [new Plane(normal.clone().negate(), side * at)];
      this.lines.visible = look.features;
      (this.lines.material as LineMaterial).color.setRGB(...(look.theme.line.map((c) => (c / 255) ** 2.2) as
        [number, number, number]));
    }
    const measure = look.measure && this.hasValues(look.measure) ? look.measure : null;
    this.material.uniforms.patches.value = measure?.worst === "off_six" || measure?.groups !== undefined;
    this.material.uniforms.edges.value = look.edges && this.model.edges;
    this.material.uniforms.line.value.fromArray(look.theme.line.map((c) => c / 255));
    return this.isPoints ? this.updatePoints(look, measure) : this.updateFacets(look, measure);
  }

  private table(measure: Measure, theme: Theme): Uint8Array {
    let table = this.tables.get(measure.key);
    if (!table) {
      table = colourTable(this.payload, measure, measure.element === "tet" ? theme.plain : theme.inside);
      this.tables.set(measure.key, table);
    }
    return table;
  }

  private visibleFacets(look: Look): number {
    const { count, first, second } = this.facets;
    const { axis } = look.cut;
    const drawn = this.drawn.facets.length === count ? this.drawn.facets : (this.drawn.facets = new Int32Array(count));
    let n = 0;
    if (first && second) {
      const kept = new Uint8Array(this.tetCentres.length / 3);
      const passes = this.passes(look.filters, "tet");
      for (let t = 0; t < kept.length; ++t)
        kept[t] = Number(!isCut(look.cut, this.tetCentres[3 * t + axis]) && (!passes || passes(t)));
      for (let f = 0; f < count; ++f)
        if (kept[first[f]] !== (second[f] < 0 ? 0 : kept[second[f]])) drawn[n++] = f;
      this.keptTets = kept;
    } else {
      for (; n < count; ++n) drawn[n] = n;
    }
    this.drawn.count = n;
    return n;
  }

  private keptTets: Uint8Array | null = null;

  private updateFacets(look: Look, measure: Measure | null): number {
    const n = this.visibleFacets(look);
    const [place, ...tints] = this.attributes(3 * n);
    const { corners, triangle, first, second } = this.facets;
    const codes = measure ? this.codes.get(measure.key)! : null;
    const table = measure ? this.table(measure, look.theme) : null;
    const ofTriangle = this.passes(look.filters, "triangle"), ofVertex = this.passes(look.filters, "vertex");
    const p = this.positions;
    let coloured = 0;
    for (let d = 0; d < n; ++d) {
      const f = this.drawn.facets[d];
      const t = triangle[f];
      for (let k = 0; k < 3; ++k) {
        const v = 3 * corners[3 * f + k];
        const at = 3 * (3 * d + k);
        place[at] = p[v];
        place[at + 1] = p[v + 1];
        place[at + 2] = p[v + 2];
      }
      const stays = (!ofTriangle || (t >= 0 && ofTriangle(t))) && (!ofVertex || (ofVertex(corners[3 * f]) ||
        ofVertex(corners[3 * f + 1]) || ofVertex(corners[3 * f + 2])));
      coloured += Number(stays);
      const plain = !stays ? look.theme.faded : t >= 0 ? look.theme.plain : look.theme.inside;
      for (let k = 0; k < 3; ++k) {
        let source: ArrayLike<number> = plain;
        let from = 0;
        if (stays && measure && codes && table) {
          let code = 0;
          if (measure.element === "vertex") code = codes[corners[3 * f + k]];
          else if (measure.element === "tet" && first && second)
            code = codes[this.keptTets![first[f]] ? first[f] : second[f]];
          else if (t >= 0 && measure.element === "triangle") code = codes[t];
          if (code > 0 || measure.element === "tet") {
            source = table;
            from = 3 * code;
          }
        }
        // Each corner of the facet has the colours of all three.
        const tint = tints[k];
        for (let at = 9 * d; at < 9 * d + 9; at += 3) {
          tint[at] = source[from];
          tint[at + 1] = source[from + 1];
          tint[at + 2] = source[from + 2];
        }
      }
    }
    this.geometry.setDrawRange(0, 3 * n);
    return coloured;
  }

  private updatePoints(look: Look, measure: Measure | null): number {
    const n = this.positions.length / 3;
    const [place, tint] = this.attributes(n);
    const codes = measure ? this.codes.get(measure.key)! : null;
    const table = measure ? this.table(measure, look.theme) : null;
    const passes = this.passes(look.filters, "vertex");
    let coloured = 0;
    place.set(this.positions);
    for (let i = 0; i < n; ++i) {
      const stays = !passes || passes(i);
      coloured += Number(stays);
      const code = codes ? codes[i] : 0;
      const source = stays && table && code > 0 ? table : stays ? look.theme.plain : look.theme.faded;
      for (let k = 0; k < 3; ++k) tint[3 * i + k] = source[(source === table ? 3 * code : 0) + k];
    }
    this.geometry.setDrawRange(0, n);
    return coloured;
  }

  // Arrays for so many vertices: places and the three colours.
  private attributes(n: number): [Float32Array, Uint8Array, Uint8Array, Uint8Array] {
    const names = ["position", "first", "second", "third"];
    if ((this.geometry.getAttribute("position")?.count ?? -1) < n) {
      this.geometry.dispose();
      const capacity = Math.ceil(1.2 * n);
      names.forEach((name, k) => {
        const attribute = k === 0 ? new BufferAttribute(new Float32Array(3 * capacity), 3)
          : new BufferAttribute(new Uint8Array(3 * capacity), 3, true);
        this.geometry.setAttribute(name, attribute.setUsage(DynamicDrawUsage));
      });
    }
    return names.map((name) => {
      const attribute = this.geometry.getAttribute(name) as BufferAttribute;
      attribute.needsUpdate = true;
      return attribute.array;
    }) as [Float32Array, Uint8Array, Uint8Array, Uint8Array];
  }

  private centres(tets: Int32Array): Float32Array {
    const centres = new Float32Array((tets.length / 4) * 3);
    for (let i = 0; i < tets.length; ++i)
      for (let k = 0; k < 3; ++k) centres[3 * (i >> 2) + k] += this.positions[3 * tets[i] + k] / 4;
    return centres;
  }

  private segments(ends: Int32Array): LineSegments2 {
    const places = new Float32Array(3 * ends.length);
    ends.forEach((v, i) => places.set(this.positions.subarray(3 * v, 3 * v + 3), 3 * i));
    const lines = new LineSegments2(new LineSegmentsGeometry().setPositions(places),
      new LineMaterial({ linewidth: 2.2 * Math.min(window.devicePixelRatio, 2) }));
    lines.frustumCulled = false;
    return lines;
  }

  // What is said of a facet that was clicked.
  describe(f: number): string {
    const parts: string[] = [];
    const t = this.facets.triangle[f];
    const tet = this.facets.first && this.keptTets
      ? (this.keptTets[this.facets.first[f]] ? this.facets.first[f] : this.facets.second![f]) : -1;
    if (tet >= 0) parts.push(`tetrahedron ${tet}`);
    if (t >= 0) parts.push(this.model.shown ? "a triangle of the simplified surface" : `triangle ${t}`);
    for (const measure of this.payload.header.measures) {
      const codes = this.codes.get(measure.key);
      const i = measure.element === "tet" ? tet : measure.element === "triangle" ? t : -1;
      if (codes && i >= 0 && codes[i] > 0)
        parts.push(`${measure.label.toLowerCase()} ${this.valueOf(measure, codes[i])}`);
    }
    return parts.join(", ");
  }

  private valueOf(measure: Measure, code: number): string {
    if (measure.groups) return measure.names?.[code - 1] ?? String(code - 1);
    const share = (code - 0.5) / (measure.bins * this.payload.header.bin_steps);
    return `${(measure.least + share * (measure.most - measure.least)).toPrecision(3)}${measure.unit}`;
  }
}
