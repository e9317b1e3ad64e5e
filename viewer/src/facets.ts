// The triangles that may be drawn: those of a surface, or all facets of tetrahedra.

export interface Facets {
  count: number;
  corners: Int32Array; // three vertices each
  triangle: Int32Array; // of the surface, or -1 inside
  // Of tetrahedra: those on both sides; -1 where there is none.
  first: Int32Array | null;
  second: Int32Array | null;
}

export function surfaceFacets(triangles: Int32Array): Facets {
  const count = triangles.length / 3;
  return { count, corners: triangles, triangle: Int32Array.from({ length: count }, (_, i) => i), first: null,
    second: null };
}

// Facet k is opposite corner k, counter-clockwise seen from outside.
const SIDES = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

// Facets by their lowest vertex, in lists.
class FacetTable {
  readonly corners: Int32Array;
  count = 0;
  private readonly heads: Int32Array;
  private readonly next: Int32Array;

  constructor(vertices: number, most: number) {
    this.heads = new Int32Array(vertices).fill(-1);
    this.next = new Int32Array(most);
    this.corners = new Int32Array(3 * most);
  }

  find(a: number, b: number, c: number): number {
    const low = Math.min(a, b, c);
    for (let f = this.heads[low]; f >= 0; f = this.next[f]) {
      const x = this.corners[3 * f], y = this.corners[3 * f + 1], z = this.corners[3 * f + 2];
      if ((x === a || y === a || z === a) && (x === b || y === b || z === b) && (x === c || y === c || z === c))
        return f;
    }
    return -1;
  }

  add(a: number, b: number, c: number): number {
    const f = this.count++;
    const low = Math.min(a, b, c);
    this.corners.set([a, b, c], 3 * f);
    this.next[f] = this.heads[low];
    this.heads[low] = f;
    return f;
  }
}

export function solidFacets(tets: Int32Array, triangles: Int32Array, vertices: number): Facets {
  const table = new FacetTable(vertices, tets.length);
  const first = new Int32Array(tets.length), second = new Int32Array(tets.length).fill(-1);
  for (let t = 0; 4 * t < tets.length; ++t)
    for (const side of SIDES) {
      const [a, b, c] = side.map((k) => tets[4 * t + k]);
      const found = table.find(a, b, c);
      if (found >= 0) second[found] = t;
      else first[table.add(a, b, c)] = t;
    }
  const triangle = new Int32Array(table.count).fill(-1);
  for (let i = 0; 3 * i < triangles.length; ++i) {
    const f = table.find(triangles[3 * i], triangles[3 * i + 1], triangles[3 * i + 2]);
    if (f >= 0) triangle[f] = i;
  }
  return { count: table.count, corners: table.corners, triangle, first, second };
}
