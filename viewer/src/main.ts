import { Vector3 } from "three";
import { css, DARK, groupColour, LIGHT, scaleColour } from "./colours";
import { byId, counted, make, short, whole } from "./dom";
import { Histogram, NOUNS } from "./histogram";
import { readPayload, type Measure, type Model, type Payload, type WorstElement } from "./payload";
import { Shape, type Look } from "./shape";
import { Stage } from "./stage";
import { inWords, lead, type Json } from "./words";

const dark = matchMedia("(prefers-color-scheme: dark)");
const theme = () => (dark.matches ? DARK : LIGHT);

function showWords(report: Json): void {
  byId("title").textContent = document.title;
  byId("lead").textContent = lead(report);
  if (report.warnings?.length > 0) {
    byId("warnings").hidden = false;
    byId("warnings").append(...report.warnings.map((text: string) => make("li", {}, text)));
  }
  const words = inWords(report);
  byId("words").hidden = words.length === 0;
  byId("words-list").append(...words.map(([heading, text]) =>
    make("div", {}, make("dt", {}, heading), make("dd", {}, text))));
  byId("version").textContent = `Written by Bisector ${report.version}.`;
}

function showTime(report: Json): void {
  const phases = Object.entries<number>(report.seconds ?? {}).filter(([name, s]) => name !== "total" && s >= 0.0005);
  // The whole pipeline's own sum would hide its phases.
  const rows = phases.filter(([name]) => name !== report.command);
  if (rows.length === 0) return;
  byId("time").hidden = false;
  const most = Math.max(...rows.map(([, s]) => s));
  const body = byId("time-table").querySelector("tbody")!;
  for (const [name, s] of rows.sort((a, b) => b[1] - a[1])) {
    const bar = make("span", { class: "bar" });
    bar.style.width = `${(100 * s) / most}%`;
    body.append(make("tr", {}, make("th", { scope: "row" }, name.replaceAll("_", " ")),
      make("td", { class: "number" }, s.toFixed(s < 1 ? 3 : 2)), make("td", { class: "track" }, bar)));
  }
}

function cell(value: Json, column = ""): string {
  if (column === "memory") return `${(value / 2 ** 30).toFixed(1)} GiB`;
  if (value === null || value === undefined) return "";
  if (typeof value === "boolean") return value ? "yes" : "no";
  if (typeof value === "number") return Number.isInteger(value) ? whole(value) : short(value);
  if (typeof value === "object") return Object.values(value).map((x) => cell(x)).join(" ");
  return String(value);
}

// Arrays of objects, as devices and the rows of a check.
function showTables(report: Json): void {
  for (const [key, title] of [["devices", "Devices"], ["failed", "Failed"], ["rows", "Cases"], ["trees", "Trees"]]) {
    const rows: Json[] = report[key] ?? [];
    if (rows.length === 0) continue;
    const columns = [...new Set(rows.flatMap((row) => Object.keys(row)))];
    const head = columns.map((c) => make("th", { scope: "col" }, c.replaceAll("_", " ")));
    const body = rows.map((row) => make("tr", {}, ...columns.map((c) => make("td", {}, cell(row[c], c)))));
    byId("tables").append(make("h2", {}, title),
      make("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": title },
        make("table", {}, make("thead", {}, make("tr", {}, ...head)), make("tbody", {}, ...body))));
  }
}

function showFigures(text: string, command: string): void {
  const link = byId("download") as HTMLAnchorElement;
  link.href = URL.createObjectURL(new Blob([text], { type: "application/json" }));
  link.download = `${command}.json`;
  const details = byId("json").closest("details")!;
  const most = 200_000;
  details.addEventListener("toggle", () => {
    byId("json").textContent = text.length > most ? `${text.slice(0, most)}\n… (download it for the rest)` : text;
  }, { once: true });
}

// What the views and their tools share.
class Viewer {
  private readonly look: Look;
  private readonly shapes: Shape[];
  private readonly stage: Stage;
  private readonly histograms: Histogram[] = [];
  private readonly radius: number;
  private readonly middle = new Vector3();
  private waiting = false;

  constructor(private readonly payload: Payload, report: Json) {
    const { models, measures } = payload.header;
    this.radius = this.frame();
    this.shapes = models.map((model) => new Shape(payload, model, (p, at) => this.place(p, at)));
    this.look = { measure: this.firstMeasure(), edges: true, features: true,
      cut: { axis: -1, at: 0, flip: false }, filters: new Map(), theme: theme() };
    byId("look").hidden = false;
    const cells = models.map((model) => this.cell(model));
    byId("views").append(...cells);
    byId("views").classList.toggle("pair", models.length > 1);
    this.stage = new Stage(byId("views"), cells, this.shapes,
      report.command === "tree" ? new Vector3(0, 0, 1) : new Vector3(0, 1, 0));
    this.stage.onPick = (view, facet) => this.say(`${models[view].title}: ${this.shapes[view].describe(facet)}.`);
    this.tools(measures);
    this.measures(measures);
    this.noteSimplified();
    dark.addEventListener("change", () => {
      this.look.theme = theme();
      this.update();
    });
    this.draw();
  }

  // The radius of all models about the middle of their box.
  private frame(): number {
    const { payload } = this;
    const lo = new Vector3(Infinity, Infinity, Infinity), hi = lo.clone().negate();
    const grids = payload.header.models.map((model) => payload.integers(model.vertices, 3));
    const p = new Vector3();
    for (const grid of grids)
      for (let i = 0; i < grid.length; i += 3) {
        lo.min(p.fromArray(grid, i));
        hi.max(p);
      }
    const middle = lo.clone().add(hi).divideScalar(2);
    let squared = 0;
    for (const grid of grids)
      for (let i = 0; i < grid.length; i += 3)
        squared = Math.max(squared, p.fromArray(grid, i).distanceToSquared(middle));
    const { origin, step } = payload.header;
    this.middle.copy(middle).multiplyScalar(step).add(new Vector3(...origin));
    return Math.max(step * Math.sqrt(squared), Number.MIN_VALUE);
  }

  private place(p: ArrayLike<number>, at: number): Vector3 {
    return new Vector3(p[at], p[at + 1], p[at + 2]).sub(this.middle).divideScalar(this.radius);
  }

  // What the result is about.
  private firstMeasure(): Measure | null {
    const { measures } = this.payload.header;
    const last = this.shapes.at(-1)!;
    return measures.find((m) => m.groups && this.shapes.some((s) => s.hasValues(m))) ??
      measures.find((m) => last.hasValues(m)) ?? null;
  }

  private cell(model: Model): HTMLElement {
    const { vertices, triangles, tets } = model.sizes;
    const of = tets > 0 ? counted(tets, "tetrahedron", "tetrahedra") : triangles > 0 ? counted(triangles, "triangle")
      : counted(vertices, "point");
    return make("figure", { class: "view", tabindex: 0, role: "group",
      "aria-label": `3D view of the ${model.title.toLowerCase()}, ${of}` },
    make("figcaption", {}, make("strong", {}, model.title), ` ${of}`));
  }

  private say(text: string): void {
    byId("status").textContent = text;
  }

  private noteSimplified(): void {
    const notes = this.payload.header.models.flatMap((model) => {
      if (!model.shown) return [];
      const is = `${model.title}: too large to turn smoothly, so it is shown simplified, `;
      if (model.sizes.triangles === 0 && model.sizes.tets === 0)
        return [`${is}with ${counted(model.shown.vertices, "point")} of ${whole(model.sizes.vertices)}.`];
      return [`${is}with ${counted(model.shown.triangles, "triangle")} for ${whole(model.sizes.triangles)}` +
        (model.sizes.tets > 0 ? " on the boundary and no tetrahedra inside" : "") +
        ". Where several elements became one, it has the worst value; histograms and lists are of all elements."];
    });
    byId("views-note").hidden = notes.length === 0;
    byId("views-note").textContent = notes.join(" ");
  }

  private tools(measures: Measure[]): void {
    const tools = byId("tools");
    const select = make("select", { id: "colour" }, make("option", { value: "" }, "one colour"),
      ...measures.filter((m) => this.shapes.some((s) => s.hasValues(m)))
        .map((m) => make("option", { value: m.key }, m.label)));
    select.value = this.look.measure?.key ?? "";
    select.addEventListener("change", () => {
      this.look.measure = measures.find((m) => m.key === select.value) ?? null;
      this.update();
    });
    tools.append(make("label", {}, "Colours: ", select), make("span", { id: "legend" }));
    const box = (id: string, text: string, on: boolean, change: (on: boolean) => void) => {
      const input = make("input", { type: "checkbox", id });
      input.checked = on;
      input.addEventListener("change", () => {
        change(input.checked);
        this.update();
      });
      tools.append(make("label", {}, input, ` ${text}`));
    };
    const { models } = this.payload.header;
    if (models.some((m) => m.edges && m.triangles[1] > 0))
      box("edges", "edges", true, (on) => { this.look.edges = on; });
    if (models.some((m) => m.lines[1] > 0)) box("features", "features", true, (on) => { this.look.features = on; });
    if (models.some((m) => m.triangles[1] > 0)) this.cutTools(tools);
    const all = make("button", { type: "button", id: "reset" }, "Show all of it");
    all.addEventListener("click", () => this.stage.reset());
    tools.append(all);
  }

  private cutTools(tools: HTMLElement): void {
    const axis = make("select", { id: "cut" }, make("option", { value: -1 }, "none"),
      ...["x", "y", "z"].map((name, k) => make("option", { value: k }, `across ${name}`)));
    const at = make("input", { type: "range", id: "cut-at", min: -100, max: 100, value: 0, disabled: true,
      "aria-label": "Place of the cut" });
    const flip = make("input", { type: "checkbox", id: "cut-flip", disabled: true });
    const change = () => {
      const k = Number(axis.value);
      at.disabled = flip.disabled = k < 0;
      this.look.cut = { axis: k, at: k < 0 ? 0 : (Number(at.value) / 100) * this.extent(k), flip: flip.checked };
      this.update();
    };
    for (const input of [axis, at, flip]) input.addEventListener("input", change);
    tools.append(make("span", { class: "group" }, make("label", {}, "Cut: ", axis), at,
      make("label", {}, flip, " other side")));
  }

  private extent(axis: number): number {
    let most = 0;
    for (const shape of this.shapes)
      for (let i = axis; i < shape.positions.length; i += 3) most = Math.max(most, Math.abs(shape.positions[i]));
    return most;
  }

  private measures(measures: Measure[]): void {
    const { models } = this.payload.header;
    const having = measures.filter((m) => models.some((model) => model.values[m.key]?.counts));
    if (having.length === 0) return;
    byId("measures").hidden = false;
    for (const measure of having) {
      if (measure.groups) {
        byId("histograms").append(this.groups(measure));
        continue;
      }
      const histogram = new Histogram(measure, models, (range) => this.filter(measure, range));
      this.histograms.push(histogram);
      byId("histograms").append(histogram.element);
    }
    if (having.some((m) => !m.groups && models.filter((model) => model.values[m.key]?.counts).length > 1))
      byId("histograms").append(make("p", { class: "hint" }, `Bars are of the ${
        models.at(-1)!.title.toLowerCase()}, lines of the ${models[0].title.toLowerCase()}.`));
    byId("clear").addEventListener("click", () => {
      this.look.filters.clear();
      for (const histogram of this.histograms) histogram.clear();
      for (const button of document.querySelectorAll("[aria-pressed]")) button.setAttribute("aria-pressed", "false");
      this.update();
    });
  }

  // Groups as buttons that show one alone.
  private groups(measure: Measure): HTMLElement {
    const { payload } = this;
    const values = payload.header.models.findLast((m) => m.values[measure.key]?.counts)!.values[measure.key];
    const colours = measure.colours && payload.integers(measure.colours, 3);
    const buttons = measure.names!.map((name, k) => {
      const swatch = make("span", { class: "swatch" });
      swatch.style.background = colours ? css(colours, 3 * k) : css(groupColour(k));
      const button = make("button", { type: "button", "aria-pressed": "false" }, swatch, ` ${name} `,
        make("small", {}, whole(values.counts![k])));
      button.addEventListener("click", () => {
        const on = button.getAttribute("aria-pressed") !== "true";
        for (const other of buttons) other.setAttribute("aria-pressed", "false");
        button.setAttribute("aria-pressed", String(on));
        this.filter(measure, on ? [k, k] : null);
      });
      return button;
    });
    return make("figure", { class: "groups", "data-measure": measure.key }, make("figcaption", {}, measure.label),
      make("div", {}, ...buttons));
  }

  private filter(measure: Measure, range: [number, number] | null): void {
    if (range) this.look.filters.set(measure.key, range);
    else this.look.filters.delete(measure.key);
    this.update();
  }

  private legend(): void {
    const legend = byId("legend");
    legend.replaceChildren();
    const { measure } = this.look;
    if (!measure || measure.groups) return;
    const stops = Array.from({ length: 25 }, (_, k) => css(scaleColour(measure, Math.min(k / 24, 0.9999))));
    const bar = make("span", { class: "scale" });
    bar.style.background = `linear-gradient(to right, ${stops.join(", ")})`;
    const ends = measure.worst === "off_six" ? ["3", "12"] : [measure.least, measure.most].map((x) => short(x));
    legend.append(ends[0], bar, `${ends[1]}${measure.unit.startsWith("%") ? " " : ""}${measure.unit}`);
  }

  private worst(): void {
    const { models, measures } = this.payload.header;
    const has = (model: Model, measure: Measure) => (model.values[measure.key]?.worst?.length ?? 0) > 0;
    const chosen = this.look.measure;
    // Groups have no worst ones.
    const measure = chosen && !chosen.groups ? chosen : measures.find((m) => models.some((model) => has(model, m)));
    const view = models.findLastIndex((model) => measure && has(model, measure));
    byId("worst").hidden = view < 0;
    if (!measure || view < 0) return;
    byId("worst-title").textContent =
      `The worst of the ${models[view].title.toLowerCase()}: ${measure.label.toLowerCase()}`;
    const noun = NOUNS[measure.element][0];
    byId("worst-list").replaceChildren(...models[view].values[measure.key].worst!.map((element) => {
      const text = `${noun[0].toUpperCase()}${noun.slice(1)} ${element.number}: ${short(element.value, 4)}${
        measure.unit.startsWith("%") ? " %" : measure.unit}`;
      const button = make("button", { type: "button" }, text);
      button.addEventListener("click", () => {
        this.visit(view, measure, element);
        this.say(`${models[view].title}: ${text}.`);
      });
      return make("li", {}, button);
    }));
  }

  private visit(view: number, measure: Measure, element: WorstElement): void {
    const corners = element.corners.map((p) => this.place(p, 0));
    const longest = Math.max(...corners.flatMap((p) => corners.map((q) => p.distanceTo(q))));
    const near = longest > 0 ? longest : this.edgeNear(view, corners[0]);
    const [a, b, c] = corners;
    const normal = measure.element === "tet" ? null
      : c ? b.clone().sub(a).cross(c.clone().sub(a)) : this.normalNear(view, a);
    const known = normal && normal.length() > 0 ? normal.normalize() : null;
    this.stage.mark(view, corners, near);
    this.stage.visit(corners, known, near);
  }

  // The triangles around the vertex that is nearest to a place.
  private around(view: number, place: Vector3): Vector3[][] {
    const { positions, facets } = this.shapes[view];
    let nearest = Infinity, vertex = -1;
    for (let i = 0; i < positions.length; i += 3) {
      const away = (positions[i] - place.x) ** 2 + (positions[i + 1] - place.y) ** 2 +
        (positions[i + 2] - place.z) ** 2;
      if (away < nearest) [nearest, vertex] = [away, i / 3];
    }
    const triangles: Vector3[][] = [];
    for (let f = 0; f < facets.count; ++f) {
      const corners = [0, 1, 2].map((k) => facets.corners[3 * f + k]);
      if (facets.triangle[f] >= 0 && corners.includes(vertex))
        triangles.push(corners.map((v) => new Vector3().fromArray(positions, 3 * v)));
    }
    return triangles;
  }

  private edgeNear(view: number, place: Vector3): number {
    return Math.max(1e-3, ...this.around(view, place).map(([a, b]) => a.distanceTo(b)));
  }

  private normalNear(view: number, place: Vector3): Vector3 {
    return this.around(view, place).reduce((sum, [a, b, c]) => sum.add(b.clone().sub(a).cross(c.clone().sub(a))),
      new Vector3());
  }

  // Once a frame at most.
  private update(): void {
    if (this.waiting) return;
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.draw();
    });
  }

  private draw(): void {
    const shown = this.shapes.map((shape) => shape.update(this.look));
    byId("views").dataset.shown = shown.join(" ");
    byId("clear").hidden = this.look.filters.size === 0;
    this.legend();
    this.worst();
    this.stage.draw();
  }
}

async function start(): Promise<void> {
  const payload = await readPayload(byId("data").textContent!.trim());
  const report: Json = JSON.parse(payload.reportText);
  showWords(report);
  showTime(report);
  showTables(report);
  showFigures(payload.reportText, report.command);
  if (payload.header.models.length > 0)
    try {
      new Viewer(payload, report);
    } catch (problem) {
      byId("look").hidden = false;
      byId("views").hidden = byId("tools").hidden = true;
      byId("views-note").hidden = false;
      byId("views-note").textContent =
        `No 3D views: ${(problem as Error).message} Turn on WebGL in the browser's settings.`;
    }
  document.documentElement.dataset.state = "ready";
}

start().catch((problem: Error) => {
  byId("lead").textContent = `This report cannot be shown: ${problem.message}. Use a browser of 2023 or newer.`;
  document.documentElement.dataset.state = "failed";
});
