// Included by polygon_batch.cpp, once for each set of instructions (core/lanes.h). The operations are those of
// Clipper's start(), begin(), place_lines(), add_line(), meet() and integrate() in their order, lane by lane, so the
// bits are the same.

// Some lanes of a batch.
struct PolygonLanes {
  PolygonBatch& batch;
  std::size_t from;

  using Row = PolygonBatch::Row;
  Numbers load(const Row& row) const { return *reinterpret_cast<const Numbers*>(row + from); }
  Lanes3 load3(const Row* rows) const { return {load(rows[0]), load(rows[1]), load(rows[2])}; }
  void store(Row& row, const Numbers& n) const { *reinterpret_cast<Numbers*>(row + from) = n; }
  void store3(Row* rows, const Lanes3& n) const {
    store(rows[0], n.x);
    store(rows[1], n.y);
    store(rows[2], n.z);
  }
};

// The vertices of the polygons, relative to the seeds.
struct Placed {
  Lanes3 anchor, at[PolygonBatch::kMost];
  Numbers squared[PolygonBatch::kMost];
  Masks on_edge[PolygonBatch::kMost][3];  // whether the edge that starts there lies on one of the facet's
  Masks is_corner[PolygonBatch::kMost];   // of the facet
};

// Sets them, and what the certificate needs of them.
inline void place(const PolygonLanes& lanes, Placed& placed) {
  PolygonBatch& batch = lanes.batch;
  const std::size_t n = batch.corners;
  const Numbers zero{}, one = zero + 1;
  const Lanes3 seed = lanes.load3(batch.seed), normal = lanes.load3(batch.normal);
  Lanes3 local[3];
  Numbers reach = zero;
  for (int k = 0; k < 3; ++k) {
    local[k] = lanes.load3(batch.corner[k]) - seed;
    reach = largest(reach, largest(absolute(local[k].x), largest(absolute(local[k].y), absolute(local[k].z))));
  }
  const Numbers which = lanes.load(batch.anchor);
  placed.anchor = select(which == zero, local[0], select(which == one, local[1], local[2]));
  const Numbers height = dot(normal, placed.anchor);
  const Lanes3 foot = times(height, normal);

  struct Line {
    Lanes3 m, along;
    Numbers offset, squared;
  };
  Line edges[3];
  Numbers edge_size[3];
  Masks runs_on[3];
  for (int k = 0; k < 3; ++k) {
    const Masks own = lanes.load(batch.runs_on[k]) > 0;
    const Lanes3 here = lanes.load3(batch.corner[k]), next = lanes.load3(batch.corner[(k + 1) % 3]);
    Line& line = edges[k];
    line.along = select(own, here, next) - select(own, next, here);
    line.m = cross(line.along, normal);
    line.squared = norm2(line.along);
    line.offset = dot(line.m, select(own, local[k], local[(k + 1) % 3])) - height * dot(normal, line.m);
    runs_on[k] = own;
    edge_size[k] = absolute(line.m.x) + absolute(line.m.y) + absolute(line.m.z);
  }
  Line lines[PolygonBatch::kMost];
  auto& on_edge = placed.on_edge;
  for (std::size_t k = 0; k < n; ++k) {
    Line& line = lines[k];
    line.m = lanes.load3(batch.other[k]) - seed;
    line.along = cross(normal, line.m);
    line.squared = norm2(line.m);
    line.offset = 0.5 * line.squared - height * dot(normal, line.m);
    const Numbers edge = lanes.load(batch.edge[k]);
    for (int e = 0; e < 3; ++e) {
      const Masks mask = on_edge[k][e] = edge == zero + e;
      line.m = select(mask, edges[e].m, line.m);
      line.along = select(mask, edges[e].along, line.along);
      line.squared = mask ? edges[e].squared : line.squared;
      line.offset = mask ? edges[e].offset : line.offset;
    }
  }

  Masks fits = one > 0;
  auto& at = placed.at;
  auto& squared = placed.squared;
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t previous = k ? k - 1 : n - 1;
    const Line &before = lines[previous], &after = lines[k];
    const Numbers determinant = dot(before.along, after.m);
    const Numbers squares = before.squared * after.squared;
    const Numbers square = determinant * determinant;
    const Numbers inverse = 1 / determinant;
    const Lanes3 w = times(inverse, times(after.offset, before.along) - times(before.offset, after.along));
    // The root of squares / square, the inverse sine, is at most the mean of that and 1.
    const Numbers slack = (1001 * kUnit) * reach * (1 + squares * (inverse * inverse));
    const Masks edge_before = on_edge[previous][0] | on_edge[previous][1] | on_edge[previous][2];
    const Masks edge_after = on_edge[k][0] | on_edge[k][1] | on_edge[k][2];
    const Masks corner = placed.is_corner[k] = edge_before & edge_after;
    const Lanes3 facet_corner = select(on_edge[k][0], local[0], select(on_edge[k][1], local[1], local[2]));
    at[k] = select(corner, facet_corner, foot + w);
    const Numbers error = corner ? kCornerSlack * reach : slack;
    Masks inside = square > kShallow * squares;
    for (int e = 0; e < 3; ++e) {
      const Numbers above = dot(edges[e].m, at[k] - local[e]);
      inside &=
          on_edge[previous][e] | on_edge[k][e] | ((runs_on[e] ? above : -above) > 2 * error * edge_size[e] + kTiny);
    }
    fits &= corner | inside;
    lanes.store3(batch.at[k], at[k]);
    squared[k] = norm2(at[k]);
    lanes.store(batch.squared[k], squared[k]);
    lanes.store(batch.slack[k], error);
  }
  lanes.store(batch.fits, fits ? one : zero);
}

template <bool kUniform>
inline void integrate(const PolygonLanes& lanes, const Placed& placed) {
  PolygonBatch& batch = lanes.batch;
  const std::size_t n = batch.corners;
  const Numbers zero{};
  const Lanes3 normal = lanes.load3(batch.normal);
  const auto& at = placed.at;
  const auto& squared = placed.squared;
  Numbers densities[PolygonBatch::kMost];
  if constexpr (!kUniform) {
    const Numbers r[3] = {lanes.load(batch.density[0]), lanes.load(batch.density[1]), lanes.load(batch.density[2])};
    const Numbers lowest = least(least(r[0], r[1]), r[2]), highest = largest(largest(r[0], r[1]), r[2]);
    const Numbers which = lanes.load(batch.anchor);
    const Numbers r_anchor = which == zero ? r[0] : (which == zero + 1 ? r[1] : r[2]);
    const Lanes3 gradient = lanes.load3(batch.gradient);
    for (std::size_t k = 0; k < n; ++k) {
      const Numbers value = r_anchor + dot(gradient, at[k] - placed.anchor);
      const Numbers within = least(largest(value, lowest), highest);
      const Numbers of_corner = placed.on_edge[k][0] ? r[0] : (placed.on_edge[k][1] ? r[1] : r[2]);
      densities[k] = placed.is_corner[k] ? of_corner : within;
    }
  }
  const Lanes3 a = at[0];
  Numbers mass = zero, second = zero;
  Lanes3 first{zero, zero, zero};
  for (std::size_t k = 1; k + 1 < n; ++k) {
    const Lanes3 &b = at[k], &c = at[k + 1];
    const Numbers area = 0.5 * dot(normal, cross(b - a, c - a));
    if constexpr (kUniform) {
      const Lanes3 sum = a + b + c;
      mass += area;
      first = first + times(kThird * area, sum);
      second += (kTwelfth * area) * (norm2(sum) + (squared[0] + squared[k] + squared[k + 1]));
    } else {
      const Numbers &ra = densities[0], &rb = densities[k], &rc = densities[k + 1];
      const Numbers s = ra + rb + rc;
      const Lanes3 weighted = times(s + ra, a) + times(s + rb, b) + times(s + rc, c);
      const Numbers squares = (s + ra + ra) * squared[0] + (s + rb + rb) * squared[k] + (s + rc + rc) * squared[k + 1];
      const Numbers products = (s + ra + rb) * dot(a, b) + (s + rb + rc) * dot(b, c) + (s + rc + ra) * dot(c, a);
      mass += (kThird * area) * s;
      first = first + times(kTwelfth * area, weighted);
      second += (kThirtieth * area) * (squares + products);
    }
  }
  lanes.store(batch.mass, mass);
  lanes.store3(batch.first, first);
  lanes.store(batch.second, second);
}

inline void compute(PolygonBatch& batch, bool uniform) {
  for (std::size_t from = 0; from < PolygonBatch::kLanes; from += kWidth) {
    const PolygonLanes lanes{batch, from};
    Placed placed;
    place(lanes, placed);
    if (uniform) integrate<true>(lanes, placed);
    else integrate<false>(lanes, placed);
  }
}
