// Histograms whose bars can be chosen, with the pointer or by two sliders.
import { css, scaleColour } from "./colours";
import { counted, make, short, svg, whole } from "./dom";
import type { Measure, Model } from "./payload";

export const NOUNS = { vertex: ["vertex", "vertices"], triangle: ["triangle", "triangles"],
  tet: ["tetrahedron", "tetrahedra"] } as const;

export type Change = (range: [number, number] | null) => void;

const WIDTH = 300, HEIGHT = 90;

const sum = (counts: number[], from = 0, to = counts.length - 1) =>
  counts.slice(from, to + 1).reduce((a, b) => a + b, 0);

// A value at the lower end of a bin.
function at(measure: Measure, bin: number): number {
  return measure.least + (bin / measure.bins) * (measure.most - measure.least);
}

export class Histogram {
  readonly element: HTMLElement;
  private from: HTMLInputElement;
  private to: HTMLInputElement;
  private readonly bars: SVGElement[] = [];
  private readonly said: HTMLElement;

  constructor(private readonly measure: Measure, private readonly models: Model[], private readonly change: Change) {
    const last = measure.bins - 1;
    const slider = (value: number, what: string) => {
      const input = make("input",
        { type: "range", min: 0, max: last, value, "aria-label": `${measure.label}, ${what}` });
      input.addEventListener("input", () => this.changed(input));
      return input;
    };
    this.from = slider(0, "from");
    this.to = slider(last, "to");
    this.said = make("output", { class: "range" });
    this.element = make("figure", { class: "histogram", "data-measure": measure.key },
      make("figcaption", {}, measure.label + (measure.unit ? `, ${measure.unit}` : "")),
      this.plot(), make("div", { class: "ends" }, this.from, this.to), this.said);
    this.show();
  }

  private get counts(): number[] {
    const model = this.models.findLast((m) => m.values[this.measure.key]?.counts);
    return model!.values[this.measure.key].counts!;
  }

  // Bars of the last model that has the measure; of another one a line.
  private plot(): Element {
    const { measure } = this;
    const having = this.models.filter((m) => m.values[measure.key]?.counts);
    const shares = having.map((m) => {
      const counts = m.values[measure.key].counts!;
      const all = Math.max(sum(counts), 1);
      return counts.map((n) => n / all);
    });
    const most = Math.max(...shares.flat(), 1e-9);
    const picture = svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT + 14}`, role: "img",
      "aria-label": `Histogram of ${measure.label}` });
    const wide = WIDTH / measure.bins;
    const height = (share: number) => (share > 0 ? Math.max(1.5, (share / most) * HEIGHT) : 0);
    shares.at(-1)!.forEach((share, k) => {
      const bar = svg("rect", { x: k * wide, width: Math.max(wide - 0.6, 0.6), y: HEIGHT - height(share),
        height: height(share), fill: css(scaleColour(measure, (k + 0.5) / measure.bins)) });
      bar.append(svg("title", {}));
      bar.firstChild!.textContent =
        `${short(at(measure, k))} to ${short(at(measure, k + 1))}: ${whole(this.counts[k])}`;
      this.bars.push(bar);
      picture.append(bar);
    });
    if (shares.length > 1) {
      const steps = shares[0].map((share, k) =>
        `${k === 0 ? "M" : "L"}${k * wide} ${HEIGHT - height(share)}H${(k + 1) * wide}`);
      picture.append(svg("path", { d: steps.join(""), class: "other" }));
    }
    picture.append(svg("line", { x1: 0, x2: WIDTH, y1: HEIGHT, y2: HEIGHT, class: "base" }));
    for (const [x, anchor] of [[0, "start"], [0.5, "middle"], [1, "end"]] as const) {
      const value = measure.worst === "off_six" ? [3, 7, 12][2 * x] : at(measure, x * measure.bins);
      const place = measure.worst === "off_six" ? (value - 2.5) * wide : x * WIDTH;
      const label = svg("text",
        { x: place, y: HEIGHT + 12, "text-anchor": measure.worst === "off_six" ? "middle" : anchor });
      label.textContent = short(value);
      picture.append(label);
    }
    this.brush(picture);
    return picture;
  }

  private brush(picture: SVGElement): void {
    let start = -1;
    const bin = (event: PointerEvent) => {
      const box = picture.getBoundingClientRect();
      const k = Math.floor(((event.clientX - box.left) / box.width) * this.measure.bins);
      return Math.min(Math.max(k, 0), this.measure.bins - 1);
    };
    picture.addEventListener("pointerdown", (event) => {
      picture.setPointerCapture(event.pointerId);
      start = bin(event);
      this.set(start, start);
    });
    picture.addEventListener("pointermove", (event) => {
      if (start >= 0) this.set(Math.min(start, bin(event)), Math.max(start, bin(event)));
    });
    for (const end of ["pointerup", "pointercancel"] as const) picture.addEventListener(end, () => { start = -1; });
  }

  private changed(moved: HTMLInputElement): void {
    const from = Number(this.from.value), to = Number(this.to.value);
    if (from > to) (moved === this.from ? this.to : this.from).value = moved.value;
    this.set(Number(this.from.value), Number(this.to.value));
  }

  clear(): void {
    this.from.value = "0";
    this.to.value = String(this.measure.bins - 1);
    this.show();
  }

  private set(from: number, to: number): void {
    this.from.value = String(from);
    this.to.value = String(to);
    this.show();
    this.change(from === 0 && to === this.measure.bins - 1 ? null : [from, to]);
  }

  private show(): void {
    const { measure } = this;
    const from = Number(this.from.value), to = Number(this.to.value);
    const all = sum(this.counts), chosen = sum(this.counts, from, to);
    this.bars.forEach((bar, k) => bar.classList.toggle("out", k < from || k > to));
    const low = measure.worst === "off_six" ? 3 + from : at(measure, from);
    const high = measure.worst === "off_six" ? 3 + to : at(measure, to + 1);
    for (const [input, value] of [[this.from, low], [this.to, high]] as const)
      input.setAttribute("aria-valuetext", `${short(value)}${measure.unit}`);
    const [one, many] = NOUNS[measure.element];
    this.said.textContent = from === 0 && to === measure.bins - 1 ? counted(all, one, many)
      : `${whole(chosen)} of ${counted(all, one, many)} from ${short(low)} to ${short(high)}`;
  }
}
