// Two views of one camera in one canvas.
import {
  Group, PerspectiveCamera, Quaternion, Ray, Scene, Triangle, Vector3, WebGLRenderer, type Object3D,
} from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import { HIGHLIGHT } from "./colours";
import { isCut, type Shape } from "./shape";

interface View {
  target: Vector3;
  distance: number;
  turn: Quaternion; // of the camera
}

const FIELD = 32; // degrees
const FLIGHT = 600; // milliseconds

export class Stage {
  onPick: (view: number, facet: number) => void = () => {};
  private readonly renderer: WebGLRenderer;
  private readonly camera = new PerspectiveCamera(FIELD, 1, 0.01, 100);
  private readonly scenes: Scene[] = [];
  private readonly marks: Group[] = [];
  private view: View;
  private size = [0, 0]; // of what is drawn
  private waiting = false;
  private flight = 0;

  // Throws if there is no WebGL.
  constructor(private readonly host: HTMLElement, private readonly cells: HTMLElement[],
    private readonly shapes: Shape[], private readonly up: Vector3) {
    this.renderer = new WebGLRenderer({ antialias: true, alpha: true });
    this.renderer.setClearColor(0, 0);
    this.renderer.autoClear = false;
    this.renderer.localClippingEnabled = true;
    this.host.prepend(this.renderer.domElement);
    for (const shape of shapes) {
      const scene = new Scene(), mark = new Group();
      scene.add(shape.group, mark);
      this.scenes.push(scene);
      this.marks.push(mark);
    }
    this.view = this.whole();
    cells.forEach((cell, k) => this.listen(cell, k));
    new ResizeObserver(() => {
      if (host.clientWidth !== this.size[0] || host.clientHeight !== this.size[1]) this.draw();
    }).observe(host);
  }

  // Everything from the front, somewhat from above.
  private whole(): View {
    const side = Math.abs(this.up.z) > 0.5;
    const azimuth = (30 * Math.PI) / 180, elevation = (20 * Math.PI) / 180;
    const turn = new Quaternion().setFromAxisAngle(this.up, azimuth);
    if (side) turn.multiply(new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), Math.PI / 2));
    turn.multiply(new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), -elevation));
    return { target: new Vector3(), distance: 1.08 / Math.sin((FIELD * Math.PI) / 360), turn };
  }

  draw(): void {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.render();
    });
  }

  private render(): void {
    const frame = this.host.getBoundingClientRect();
    if (frame.width === 0) return;
    this.size = [this.host.clientWidth, this.host.clientHeight];
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(frame.width, frame.height);
    this.renderer.setScissorTest(false);
    this.renderer.clear();
    this.renderer.setScissorTest(true);
    this.cells.forEach((cell, k) => {
      const box = cell.getBoundingClientRect();
      const left = box.left - frame.left, bottom = frame.bottom - box.bottom;
      this.renderer.setViewport(left, bottom, box.width, box.height);
      this.renderer.setScissor(left, bottom, box.width, box.height);
      this.aim(box.width / box.height);
      this.renderer.render(this.scenes[k], this.camera);
    });
    this.host.dataset.drawn = "true";
  }

  private aim(aspect: number): void {
    const { target, distance, turn } = this.view;
    // The narrower side decides how far away all is seen.
    const away = distance * Math.max(1, 1 / aspect);
    this.camera.aspect = aspect;
    this.camera.near = Math.max(away - 2.5 - target.length(), away / 200);
    this.camera.far = away + 2.5 + target.length();
    this.camera.quaternion.copy(turn);
    this.camera.position.set(0, 0, away).applyQuaternion(turn).add(target);
    this.camera.updateProjectionMatrix();
    this.camera.updateMatrixWorld();
  }

  reset(): void {
    this.fly(this.whole());
  }

  turn(right: number, upwards: number): void {
    this.flight = 0;
    const sideways = new Quaternion().setFromAxisAngle(this.up, -right);
    const pitch = new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), -upwards);
    this.view.turn.premultiply(sideways).multiply(pitch).normalize();
    this.draw();
  }

  // In heights of a view.
  pan(right: number, upwards: number): void {
    this.flight = 0;
    const height = 2 * this.view.distance * Math.tan((FIELD * Math.PI) / 360);
    this.view.target.add(new Vector3(-right * height, -upwards * height, 0).applyQuaternion(this.view.turn));
    this.draw();
  }

  zoom(factor: number): void {
    this.flight = 0;
    this.view.distance = Math.min(Math.max(this.view.distance * factor, 1e-4), 40);
    this.draw();
  }

  // Goes where an element fills a good part of the view, and faces it if it has a normal.
  visit(places: Vector3[], normal: Vector3 | null, size: number): void {
    const target = places.reduce((sum, p) => sum.add(p), new Vector3()).divideScalar(places.length);
    let turn = this.view.turn.clone();
    if (normal) {
      const towards = new Vector3(0, 0, 1).applyQuaternion(turn);
      turn = new Quaternion().setFromUnitVectors(towards, normal).multiply(turn);
    }
    this.fly({ target, distance: Math.max(14 * size, 1e-3), turn });
  }

  private fly(to: View): void {
    const from = { target: this.view.target.clone(), distance: this.view.distance, turn: this.view.turn.clone() };
    const start = performance.now();
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const flight = ++this.flight || (this.flight = 1);
    const step = () => {
      if (this.flight !== flight) return;
      const t = still ? 1 : Math.min((performance.now() - start) / FLIGHT, 1);
      const s = t * t * (3 - 2 * t);
      this.view = { target: from.target.clone().lerp(to.target, s),
        distance: from.distance ** (1 - s) * to.distance ** s, turn: from.turn.clone().slerp(to.turn, s) };
      this.draw();
      if (t < 1) requestAnimationFrame(step);
    };
    step();
  }

  // An outline that is seen through everything, in one of the views.
  mark(view: number, corners: Vector3[], size: number): void {
    for (const group of this.marks) group.clear();
    const ends: Vector3[] = [];
    if (corners.length === 1)
      for (const axis of [new Vector3(size / 4), new Vector3(0, size / 4), new Vector3(0, 0, size / 4)])
        ends.push(corners[0].clone().sub(axis), corners[0].clone().add(axis));
    for (let i = 0; i < corners.length; ++i)
      for (let j = i + 1; j < corners.length; ++j) ends.push(corners[i], corners[j]);
    const material = new LineMaterial({ linewidth: 4, depthTest: false });
    material.color.setRGB(...(HIGHLIGHT.map((c) => (c / 255) ** 2.2) as [number, number, number]));
    const outline = new LineSegments2(
      new LineSegmentsGeometry().setPositions(ends.flatMap((p) => p.toArray())), material);
    outline.renderOrder = 1;
    outline.frustumCulled = false;
    this.marks[view].add(outline as Object3D);
    this.draw();
  }

  private pick(view: number, x: number, y: number): void {
    const box = this.cells[view].getBoundingClientRect();
    this.aim(box.width / box.height);
    const towards = new Vector3(((x - box.left) / box.width) * 2 - 1, 1 - ((y - box.top) / box.height) * 2, 0.5)
      .unproject(this.camera).sub(this.camera.position).normalize();
    const ray = new Ray(this.camera.position.clone(), towards);
    const shape = this.shapes[view];
    const p = shape.positions, { corners } = shape.facets;
    const triangle = new Triangle(), hit = new Vector3();
    let nearest = Infinity, found = -1;
    for (let d = 0; d < shape.drawn.count; ++d) {
      const f = shape.drawn.facets[d];
      triangle.a.fromArray(p, 3 * corners[3 * f]);
      triangle.b.fromArray(p, 3 * corners[3 * f + 1]);
      triangle.c.fromArray(p, 3 * corners[3 * f + 2]);
      if (!ray.intersectTriangle(triangle.a, triangle.b, triangle.c, false, hit)) continue;
      if (!shape.isSolid && isCut(shape.cut, hit.getComponent(Math.max(shape.cut.axis, 0)))) continue;
      const away = hit.distanceToSquared(ray.origin);
      if (away < nearest) [nearest, found] = [away, f];
    }
    if (found < 0) return;
    this.mark(view, [0, 1, 2].map((k) => new Vector3().fromArray(p, 3 * corners[3 * found + k])), 0);
    this.onPick(view, found);
  }

  private listen(cell: HTMLElement, view: number): void {
    const held = new Map<number, { x: number; y: number }>();
    let moved = 0;
    cell.addEventListener("pointerdown", (event) => {
      cell.setPointerCapture(event.pointerId);
      held.set(event.pointerId, { x: event.clientX, y: event.clientY });
      moved = 0;
    });
    cell.addEventListener("pointermove", (event) => {
      const last = held.get(event.pointerId);
      if (!last) return;
      const dx = event.clientX - last.x, dy = event.clientY - last.y;
      moved += Math.abs(dx) + Math.abs(dy);
      if (held.size === 2) {
        const [other] = [...held].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
        const before = Math.hypot(last.x - other.x, last.y - other.y);
        const after = Math.hypot(event.clientX - other.x, event.clientY - other.y);
        if (before > 0 && after > 0) this.zoom(before / after);
        this.pan(dx / cell.clientHeight / 2, -dy / cell.clientHeight / 2);
      } else if (event.shiftKey || event.buttons & 6) {
        this.pan(dx / cell.clientHeight, -dy / cell.clientHeight);
      } else {
        this.turn((dx / cell.clientHeight) * Math.PI, (dy / cell.clientHeight) * Math.PI);
      }
      held.set(event.pointerId, { x: event.clientX, y: event.clientY });
    });
    for (const end of ["pointerup", "pointercancel"] as const)
      cell.addEventListener(end, (event) => {
        held.delete(event.pointerId);
        if (end === "pointerup" && moved < 4 && event.button === 0) this.pick(view, event.clientX, event.clientY);
      });
    cell.addEventListener("contextmenu", (event) => event.preventDefault());
    cell.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(Math.min(Math.max(event.deltaY, -200), 200) * 0.0015));
    }, { passive: false });
    cell.addEventListener("keydown", (event) => this.press(event));
  }

  private press(event: KeyboardEvent): void {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const arrows: Record<string, [number, number]> = {
      ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1],
    };
    const arrow = arrows[event.key];
    if (arrow && event.shiftKey) this.pan(arrow[0] * 0.05, arrow[1] * 0.05);
    else if (arrow) this.turn(arrow[0] * 0.12, -arrow[1] * 0.12);
    else if (event.key === "+" || event.key === "=") this.zoom(1 / 1.2);
    else if (event.key === "-") this.zoom(1.2);
    else if (event.key === "0") this.reset();
    else return;
    event.preventDefault();
  }
}
