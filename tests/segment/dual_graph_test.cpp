#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "segment/dual_graph.h"
#include "support/models.h"

namespace bisector::test {
namespace {

using Edge = std::array<Index, 2>;

std::set<Edge> edges_of(const Triangle& t) {
  std::set<Edge> edges;
  for (int k = 0; k < 3; ++k) edges.insert({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])});
  return edges;
}

double length(const TriangleMesh& mesh, const Edge& e) { return norm(mesh.vertices[e[1]] - mesh.vertices[e[0]]); }

struct Named {
  std::string name;
  TriangleMesh mesh;
};
std::vector<Named> meshes() {
  return {{"single_triangle", single_triangle()},
          {"sphere", icosphere(2)},
          {"torus", torus(9, 5)},
          {"grid", grid_patch(5, 3)},
          {"pages", pages()},
          {"two_spheres", two_spheres()},
          {"soup", soup(40, 3)},
          {"duplicated", duplicated_triangles()},
          {"needles", needles()},
          {"collinear", collinear_among_good()}};
}

TEST(DualGraph, IsThePairsOfTrianglesWithCommonEdges) {
  for (const auto& [name, mesh] : meshes()) {
    SCOPED_TRACE(name);
    const DualGraph graph = dual_graph(mesh.triangles, mesh.vertices);
    ASSERT_EQ(graph.neighbours.rows(), mesh.triangles.size());
    ASSERT_EQ(graph.edge_length.size(), graph.neighbours.values.size());
    std::set<Edge> all;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const std::set<Edge> mine = edges_of(mesh.triangles[t]);
      all.insert(mine.begin(), mine.end());
      std::map<Index, double> expected;
      for (std::size_t u = 0; u < mesh.triangles.size(); ++u)
        for (const Edge& e : edges_of(mesh.triangles[u]))
          if (u != t && mine.count(e)) expected[static_cast<Index>(u)] += length(mesh, e);
      ASSERT_EQ(graph.neighbours.size(t), expected.size()) << "triangle " << t;
      std::size_t k = graph.neighbours.offsets[t];
      for (const auto& [u, shared] : expected) {
        EXPECT_EQ(graph.neighbours.values[k], u);
        EXPECT_NEAR(graph.edge_length[k], shared, 1e-15 * (1 + shared));
        ++k;
      }
    }
    double sum = 0;
    for (const Edge& e : all) sum += length(mesh, e);
    EXPECT_NEAR(graph.mean_edge_length, sum / static_cast<double>(all.size()), 1e-12 * sum);
  }
}

TEST(DualGraph, OfNothingIsEmpty) {
  const DualGraph graph = dual_graph({}, {});
  EXPECT_EQ(graph.neighbours.rows(), 0u);
  EXPECT_EQ(graph.mean_edge_length, 0);
  EXPECT_TRUE(connected_parts(graph).empty());
}

TEST(ConnectedParts, AreNumberedByTheirLowestTriangle) {
  for (const auto& [name, mesh] : meshes()) {
    SCOPED_TRACE(name);
    const DualGraph graph = dual_graph(mesh.triangles, mesh.vertices);
    SplitMix64 random(5);
    std::vector<Index> labels(mesh.triangles.size());
    for (Index& label : labels) label = static_cast<Index>(random.below(2));
    for (const bool labelled : {false, true}) {
      const std::vector<Index> part = connected_parts(graph, labelled ? labels : std::vector<Index>{});
      ASSERT_EQ(part.size(), labels.size());
      // The finest partition that joins neighbours of equal labels, by relaxation.
      std::vector<Index> lowest(labels.size());
      for (std::size_t t = 0; t < lowest.size(); ++t) lowest[t] = static_cast<Index>(t);
      for (bool changed = true; changed;) {
        changed = false;
        for (std::size_t t = 0; t < lowest.size(); ++t)
          for (const Index* u = graph.neighbours.begin(t); u != graph.neighbours.end(t); ++u)
            if ((!labelled || labels[t] == labels[*u]) && lowest[*u] < lowest[t]) {
              lowest[t] = lowest[*u];
              changed = true;
            }
      }
      std::map<Index, Index> number;
      for (std::size_t t = 0; t < lowest.size(); ++t) {
        number.try_emplace(lowest[t], static_cast<Index>(number.size()));
        EXPECT_EQ(part[t], number.at(lowest[t]));
      }
    }
  }
}

TEST(BorderLength, IsThatOfTheEdgesBetweenLabels) {
  const TriangleMesh mesh = grid_patch(6, 4);
  const DualGraph graph = dual_graph(mesh.triangles, mesh.vertices);
  std::vector<Index> labels(mesh.triangles.size(), 0);
  EXPECT_EQ(border_length(graph, labels), 0);
  for (std::size_t t = 0; t < labels.size(); ++t) {
    double x = 0;
    for (const Index v : mesh.triangles[t]) x += mesh.vertices[v].x / 3;
    labels[t] = x > 2 ? 7 : 3;
  }
  EXPECT_DOUBLE_EQ(border_length(graph, labels), 4);
}

}  // namespace
}  // namespace bisector::test
