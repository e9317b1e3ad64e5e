// What src/view/payload.h encodes.

export type Ref = [offset: number, count: number];
export type ElementKind = "vertex" | "triangle" | "tet";

export interface Measure {
  key: string;
  label: string;
  unit: string;
  element: ElementKind;
  worst: "none" | "low" | "high" | "off_six";
  // Of a scale:
  least: number;
  most: number;
  bins: number;
  // Of groups:
  groups?: number;
  names?: string[];
  colours?: Ref;
}

export interface WorstElement {
  number: number;
  value: number;
  corners: [number, number, number][];
}

export interface Values {
  counts?: number[];
  worst?: WorstElement[];
  codes?: Ref;
}

export interface Sizes {
  vertices: number;
  triangles: number;
  tets: number;
}

export interface Model {
  title: string;
  file: string;
  sizes: Sizes;
  shown?: Sizes; // if it is simplified
  edges: boolean;
  vertices: Ref;
  triangles: Ref;
  tets: Ref;
  lines: Ref;
  values: Record<string, Values>;
}

export interface Header {
  report: Ref;
  origin: [number, number, number];
  step: number;
  bin_steps: number;
  measures: Measure[];
  models: Model[];
}

export class Payload {
  readonly header: Header;
  readonly reportText: string;
  private readonly arrays: Uint8Array;

  constructor(bytes: Uint8Array) {
    const length = new DataView(bytes.buffer, bytes.byteOffset).getUint32(0, true);
    const text = new TextDecoder();
    this.header = JSON.parse(text.decode(bytes.subarray(4, 4 + length))) as Header;
    this.arrays = bytes.subarray(4 + length);
    const [offset, count] = this.header.report;
    this.reportText = text.decode(this.arrays.subarray(offset, offset + count));
  }

  // Integers, each stored as its difference from the one `stride` before it.
  integers([offset, count]: Ref, stride: number): Int32Array {
    const values = new Int32Array(count);
    const bytes = this.arrays;
    let at = offset;
    for (let i = 0; i < count; ++i) {
      let rest = 0;
      let scale = 1;
      let byte = bytes[at++];
      for (; byte > 127; byte = bytes[at++]) {
        rest += (byte & 127) * scale;
        scale *= 128;
      }
      rest += byte * scale;
      const difference = rest % 2 ? -(rest + 1) / 2 : rest / 2;
      values[i] = (i < stride ? 0 : values[i - stride]) + difference;
    }
    return values;
  }
}

export async function readPayload(base64: string): Promise<Payload> {
  const text = atob(base64);
  const compressed = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) compressed[i] = text.charCodeAt(i);
  const stream = new Blob([compressed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Payload(new Uint8Array(await new Response(stream).arrayBuffer()));
}
