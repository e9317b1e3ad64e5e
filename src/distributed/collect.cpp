#include "distributed/collect.h"

#include <algorithm>
#include <string>
#include <utility>

#include "checkpoint/bytes.h"
#include "core/parallel.h"
#include "voronoi/dual.h"
#include "voronoi/polygons.h"
#include "voronoi/totals.h"

namespace bisector {

void collect_cells(Ranks& ranks, const CellsOfRank& mine, std::size_t count, bool with_triangles, CellMoments& result) {
  ByteWriter message;
  message.put_all(mine.ids).put_all(mine.cells).put_all(mine.step_mass);
  if (with_triangles) message.put_all(mine.triangles.offsets).put_all(mine.triangles.values);
  const std::vector<std::string> received = ranks.collect(message.take());
  if (!ranks.is_root()) return;

  result.cells.assign(count, Moments{});
  result.step_mass.assign(count, 0);
  result.triangles.offsets.assign(with_triangles ? count + 1 : 1, 0);
  result.triangles.values.clear();
  std::vector<CellsOfRank> parts(received.size());
  for (std::size_t r = 0; r < received.size(); ++r) {
    CellsOfRank& part = parts[r];
    ByteReader reader(received[r]);
    reader.get_all(part.ids);
    reader.get_all(part.cells);
    reader.get_all(part.step_mass);
    if (with_triangles) {
      reader.get_all(part.triangles.offsets);
      reader.get_all(part.triangles.values);
    }
    reader.end();
    for (std::size_t k = 0; k < part.ids.size(); ++k) {
      result.cells[part.ids[k]] = part.cells[k];
      result.step_mass[part.ids[k]] = part.step_mass[k];
      if (with_triangles) result.triangles.offsets[part.ids[k] + 1] = part.triangles.size(k);
    }
  }
  if (with_triangles) {
    for (std::size_t i = 0; i < count; ++i) result.triangles.offsets[i + 1] += result.triangles.offsets[i];
    result.triangles.values.resize(result.triangles.offsets[count]);
    for (const CellsOfRank& part : parts)
      parallel_each(part.ids.size(), [&](std::size_t k) {
        std::copy(part.triangles.begin(k), part.triangles.end(k),
                  result.triangles.values.data() + result.triangles.offsets[part.ids[k]]);
      });
  }
  set_totals(result);
}

void collect_dual(Ranks& ranks, const Dual& mine, Dual& result) {
  const std::vector<std::string> received =
      ranks.collect(ByteWriter().put_all(mine.triangles).put_all(mine.multiplicity).put_all(mine.mesh_triangle).take());
  if (!ranks.is_root()) return;
  std::vector<Dual> parts(received.size());
  for (std::size_t r = 0; r < parts.size(); ++r) {
    ByteReader reader(received[r]);
    reader.get_all(parts[r].triangles);
    reader.get_all(parts[r].multiplicity);
    reader.get_all(parts[r].mesh_triangle);
    reader.end();
  }
  result = merge_duals(parts);
}

void collect_polygons(Ranks& ranks, RestrictedPolygons mine, RestrictedPolygons& result) {
  ByteWriter message;
  message.put_all(mine.pairs).put_all(mine.offsets).put_all(mine.labels).put_all(mine.vertices);
  mine = {};
  std::vector<std::string> received = ranks.collect(message.take());
  if (!ranks.is_root()) return;

  // The polygons of a triangle come from one rank.
  struct Run {
    Index triangle;
    std::size_t part, begin, end;
  };
  std::vector<RestrictedPolygons> parts(received.size());
  std::vector<Run> runs;
  std::size_t corners = 0, places = 0;
  for (std::size_t r = 0; r < parts.size(); ++r) {
    RestrictedPolygons& part = parts[r];
    ByteReader reader(received[r]);
    reader.get_all(part.pairs);
    reader.get_all(part.offsets);
    reader.get_all(part.labels);
    reader.get_all(part.vertices);
    reader.end();
    received[r] = {};
    corners += part.labels.size();
    places += part.vertices.size();
    for (std::size_t k = 0; k < part.pairs.size(); ++k) {
      const Index triangle = part.pairs[k].triangle;
      if (k == 0 || triangle != runs.back().triangle) runs.push_back({triangle, r, k, k});
      ++runs.back().end;
    }
  }
  sort_in_parallel(runs, [](const Run& a, const Run& b) { return a.triangle < b.triangle; });
  result = {};
  result.labels.reserve(corners);
  result.vertices.reserve(places);
  for (const Run& run : runs) append_polygons(parts[run.part], run.begin, run.end, result);
}

}  // namespace bisector
